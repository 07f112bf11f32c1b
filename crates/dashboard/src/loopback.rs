//! Decides which requests a server on loopback may answer: pages of any site can make the browser send requests to it.

use std::net::IpAddr;

use axum::http::header::{HOST, ORIGIN};
use axum::http::{HeaderMap, HeaderName, HeaderValue};

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Whether a server on loopback may answer a request: the request names this computer as its host, and it comes from a
/// program or from a page of the same server.
pub fn admits(headers: &HeaderMap) -> bool {
    is_for_this_computer(headers) && !is_foreign(headers)
}

/// Whether a request names this computer as its host; with DNS rebinding, it would name another host.
pub fn is_for_this_computer(headers: &HeaderMap) -> bool {
    host_of(headers).is_some_and(|host| is_this_computer(name_of(host)))
}

/// Whether a name, or an address as in URLs, means this computer: `localhost`, `127.0.0.1` or `[::1]`.
pub fn is_this_computer(name: &str) -> bool {
    match address_of(name) {
        Some(address) => address.is_loopback(),
        None => name.eq_ignore_ascii_case("localhost"),
    }
}

/// Returns a host without its port.
pub fn name_of(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|digit| digit.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Returns the host of a request; `None` unless there is exactly one.
pub(crate) fn host_of(headers: &HeaderMap) -> Option<&str> {
    let mut hosts = headers.get_all(HOST).iter();
    let host = hosts.next().filter(|_| hosts.next().is_none())?;
    host.to_str().ok()
}

/// Parses an address as written in URLs.
pub(crate) fn address_of(name: &str) -> Option<IpAddr> {
    name.trim_start_matches('[').trim_end_matches(']').parse().ok()
}

/// Whether a page of another server sent a request.
pub(crate) fn is_foreign(headers: &HeaderMap) -> bool {
    let host = host_of(headers);
    let is_other_origin = headers.get_all(ORIGIN).iter().any(|origin| {
        let origin = origin.to_str().unwrap_or_default();
        let of = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        !of.zip(host).is_some_and(|(of, host)| of.eq_ignore_ascii_case(host))
    });
    let site = headers.get(SEC_FETCH_SITE).map(HeaderValue::as_bytes);
    is_other_origin || !matches!(site, None | Some(b"same-origin" | b"none"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_and_own_pages_are_admitted_and_other_sites_and_names_are_not() {
        let host = ("host", "localhost:8750");
        let is_admitted = |headers: &[(&'static str, &'static str)]| {
            let mut map = HeaderMap::new();
            for (name, value) in headers {
                map.append(*name, HeaderValue::from_static(value));
            }
            admits(&map)
        };
        for admitted in [
            &[host][..],
            &[("host", "127.0.0.1:8750")],
            &[("host", "[::1]:8750")],
            &[host, ("origin", "http://localhost:8750"), ("sec-fetch-site", "same-origin")],
        ] {
            assert!(is_admitted(admitted), "{admitted:?}");
        }
        for refused in [
            &[][..],
            &[("host", "evil.example:8750")],
            &[("host", "localhost.evil.example")],
            &[("host", "192.168.1.7:8750")],
            &[host, ("host", "evil.example")],
            &[host, ("origin", "http://evil.example")],
            &[host, ("origin", "http://localhost:9999")],
            &[host, ("origin", "null")],
            &[host, ("sec-fetch-site", "cross-site")],
        ] {
            assert!(!is_admitted(refused), "{refused:?}");
        }
    }
}
