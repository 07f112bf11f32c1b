//! The certificate for serving the dashboard over https.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{Error, ServerConfig};

/// A certificate with its key, ready to serve.
#[derive(Clone, Debug)]
pub struct Tls(Arc<ServerConfig>);

/// A certificate or a key that can't be used. The message fits after "failed to".
#[derive(Debug, Error)]
pub enum TlsError {
    /// A file can't be read.
    #[error("read {path}: {error}")]
    Unreadable {
        /// Whether this is the certificate or the key.
        file: TlsFile,
        /// The file.
        path: PathBuf,
        /// The reason.
        error: std::io::Error,
    },
    /// A file is not PEM, or does not contain what it should.
    #[error("read {path}: {why}")]
    Malformed {
        /// Whether this is the certificate or the key.
        file: TlsFile,
        /// The file.
        path: PathBuf,
        /// What is wrong with the file.
        why: String,
    },
    /// The key does not belong to the certificate.
    #[error("use {key} with {certificate}: it is the key of another certificate")]
    Mismatched {
        /// The file of the certificate.
        certificate: PathBuf,
        /// The file of the key.
        key: PathBuf,
    },
}

/// One of the two files for https.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TlsFile {
    /// The certificate, followed by the certificates that sign it.
    Certificate,
    /// The private key of the certificate.
    Key,
}

impl TlsFile {
    /// The name of the setting for this file.
    pub const fn setting(self) -> &'static str {
        match self {
            TlsFile::Certificate => "certificate",
            TlsFile::Key => "key",
        }
    }
}

impl TlsError {
    /// The faulty file.
    pub const fn file(&self) -> TlsFile {
        match self {
            TlsError::Unreadable { file, .. } | TlsError::Malformed { file, .. } => *file,
            TlsError::Mismatched { .. } => TlsFile::Key,
        }
    }

    /// What the user can do.
    pub const fn hint(&self) -> &'static str {
        match (self, self.file()) {
            (TlsError::Mismatched { .. }, _) => {
                "the certificate must come first in its file, before those that sign it; use the key \
                 that was made with it"
            }
            (TlsError::Unreadable { .. }, _) => {
                "paths are relative to the folder in which teampulse is started, and the file must be readable by you"
            }
            (_, TlsFile::Certificate) => {
                "a certificate in PEM has a line `-----BEGIN CERTIFICATE-----`; `mkcert` or your network's \
                 administrators can make one"
            }
            (_, TlsFile::Key) => {
                "a key in PEM has a line `-----BEGIN PRIVATE KEY-----`; `openssl pkey -in KEY -out NEW` removes a \
                 passphrase"
            }
        }
    }
}

impl Tls {
    /// Reads a certificate and its private key, both in PEM.
    pub fn read(certificate: &Path, key: &Path) -> Result<Tls, TlsError> {
        let malformed = |file, path: &Path, why: String| TlsError::Malformed {
            file,
            path: path.to_owned(),
            why,
        };
        let bytes = read(TlsFile::Certificate, certificate)?;
        let chain = CertificateDer::pem_slice_iter(&bytes).collect::<Result<Vec<_>, pem::Error>>();
        let chain = chain
            .map_err(|error| malformed(TlsFile::Certificate, certificate, error.to_string()))?;
        if chain.is_empty() {
            let why = "it contains no certificate".to_owned();
            return Err(malformed(TlsFile::Certificate, certificate, why));
        }
        let private = PrivateKeyDer::from_pem_slice(&read(TlsFile::Key, key)?);
        let private = private.map_err(|error| {
            let why = match error {
                pem::Error::NoItemsFound => {
                    "it contains no private key, or only one with a passphrase".to_owned()
                }
                error => error.to_string(),
            };
            malformed(TlsFile::Key, key, why)
        })?;
        let builder = ServerConfig::builder_with_provider(Arc::new(default_provider()));
        let builder = builder.with_safe_default_protocol_versions();
        let config =
            builder.and_then(|it| it.with_no_client_auth().with_single_cert(chain, private));
        let mut config = config.map_err(|error| match error {
            Error::InconsistentKeys(_) => {
                TlsError::Mismatched { certificate: certificate.to_owned(), key: key.to_owned() }
            }
            Error::InvalidCertificate(_) => {
                malformed(TlsFile::Certificate, certificate, error.to_string())
            }
            error => malformed(TlsFile::Key, key, error.to_string()),
        })?;
        config.alpn_protocols = vec![b"http/1.1".to_vec()];
        Ok(Tls(Arc::new(config)))
    }

    /// The acceptor for connections.
    pub(crate) fn acceptor(&self) -> TlsAcceptor {
        TlsAcceptor::from(Arc::clone(&self.0))
    }
}

fn read(file: TlsFile, path: &Path) -> Result<Vec<u8>, TlsError> {
    std::fs::read(path).map_err(|error| TlsError::Unreadable { file, path: path.to_owned(), error })
}
