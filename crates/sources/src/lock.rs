//! Locks between the processes of one computer, on things that only one of them can use.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

/// A lock that is held until it is dropped or its process ends: an abstract socket name, which needs no file.
#[derive(Debug)]
pub(crate) struct Lock {
    _socket: UnixDatagram,
}

/// Another process holds the lock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Locked;

impl Lock {
    /// Takes the lock on a thing of a kind; `None` where such sockets can't be created.
    pub(crate) fn on(kind: &str, thing: impl Hash) -> Result<Option<Lock>, Locked> {
        let mut hasher = DefaultHasher::new();
        thing.hash(&mut hasher);
        let name = format!("teampulse-{kind}-{:016x}", hasher.finish());
        let address = SocketAddr::from_abstract_name(name);
        match address.and_then(|address| UnixDatagram::bind_addr(&address)) {
            Ok(socket) => Ok(Some(Lock { _socket: socket })),
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => Err(Locked),
            Err(_) => Ok(None),
        }
    }
}
