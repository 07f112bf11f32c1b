//! The pages, as built from `web/`.

use std::io::Write;

use axum::body::Bytes;
use axum::http::header::{ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, VARY};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;

/// A file of the pages.
struct Asset {
    path: &'static str,
    kind: &'static str,
    bytes: &'static [u8],
}

macro_rules! assets {
    ($($path:literal $file:literal $kind:literal)*) => {
        [$(Asset {
            path: $path,
            kind: $kind,
            bytes: include_bytes!(concat!("../assets/", $file)),
        }),*]
    };
}

/// All files.
const ASSETS: [Asset; 4] = assets! {
    "/" "index.html" "text/html; charset=utf-8"
    "/app.js" "app.js" "text/javascript; charset=utf-8"
    "/app.css" "app.css" "text/css; charset=utf-8"
    "/icon.svg" "icon.svg" "image/svg+xml"
};

/// The files with their compressed forms, computed once.
#[derive(Clone, Debug)]
pub struct Assets(Vec<Bytes>);

impl Assets {
    /// Compresses all files.
    pub fn compressed() -> Assets {
        Assets(ASSETS.iter().map(|asset| gzip(asset.bytes).into()).collect())
    }

    /// Answers with the file at a path; `None` if there is none.
    pub fn answer(&self, path: &str, headers: &HeaderMap) -> Option<Response> {
        let place = ASSETS.iter().position(|asset| asset.path == path)?;
        let asset = &ASSETS[place];
        let head =
            [(CONTENT_TYPE, asset.kind), (CACHE_CONTROL, "no-cache"), (VARY, "accept-encoding")];
        let accepted = headers.get(ACCEPT_ENCODING).and_then(|value| value.to_str().ok());
        if accepted.is_some_and(accepts_gzip) {
            let body = self.0[place].clone();
            return Some(
                (StatusCode::OK, head, [(CONTENT_ENCODING, "gzip")], body).into_response(),
            );
        }
        Some((StatusCode::OK, head, Bytes::from_static(asset.bytes)).into_response())
    }
}

fn accepts_gzip(accepted: &str) -> bool {
    accepted.split(',').any(|coding| {
        let (name, weight) = coding.split_once(';').unwrap_or((coding, ""));
        let weight = weight.trim().strip_prefix("q=").and_then(|weight| weight.parse::<f64>().ok());
        name.trim() == "gzip" && weight != Some(0.0)
    })
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.expect("writing into memory does not fail")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_compressed_only_for_those_who_read_that() {
        assert!(accepts_gzip("br, gzip") && accepts_gzip("gzip;q=0.5"));
        assert!(!accepts_gzip("br") && !accepts_gzip("gzip;q=0"));
    }

    #[test]
    fn nothing_in_the_page_is_inline_or_fetched_from_elsewhere() {
        let page = std::str::from_utf8(ASSETS[0].bytes).unwrap();
        assert!(!page.contains("<style") && !page.contains(" style=") && !page.contains("://"));
        let scripts = page.matches("<script").count();
        assert_eq!(scripts, page.matches("<script type=\"module\" ").count());
        assert_eq!(scripts, page.matches(" src=\"").count());
    }
}
