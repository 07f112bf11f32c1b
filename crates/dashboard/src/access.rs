//! Who may connect, and what they may do.

use std::net::IpAddr;

use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, COOKIE};
use teampulse_core::command::Sender;
use thiserror::Error;

use crate::loopback::{address_of, host_of, is_foreign, is_this_computer, name_of};
use crate::tokens::Tokens;
use crate::wire::Right;

/// The cookie that holds a browser's token.
pub const COOKIE_NAME: &str = "teampulse_token";

/// The permissions of a client, and the address from which it connects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grant {
    /// The right of the client.
    pub right: Right,
    /// The address of the client; `None` for this computer.
    pub address: Option<IpAddr>,
}

impl Grant {
    /// The name of the client in the bag.
    pub fn sender(&self) -> Sender {
        let address = self.address.map(|address| address.to_string()).unwrap_or_default();
        Sender::through("dashboard", &address)
    }
}

/// The rules on who may connect.
#[derive(Clone, Debug)]
pub struct Access {
    is_loopback: bool,
    names: Vec<String>,
    tokens: Tokens,
}

/// Why a request was refused.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Denied {
    /// The `Host` header is missing or names another computer, as after DNS rebinding.
    #[error(
        "the host name in the address is unknown: open the dashboard at the address that \
         teampulse prints, or add the name to `names`"
    )]
    Host,
    /// The request comes from a page of another site.
    #[error("pages of other sites may not use the dashboard")]
    Origin,
    /// The request has no valid token.
    #[error(
        "a token is required: open the dashboard at /?token=… with a token from the tokens file"
    )]
    Token,
}

/// The tokens are missing although others can reach the address. The message fits after "failed to".
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("listen on {0} without a token: anybody on the network could see the team and set markers")]
pub struct NoToken(IpAddr);

impl Access {
    /// The access rules for a listening address, the other names of this computer, and the tokens. Fails if others can
    /// reach the address and there are no tokens.
    pub fn new(address: IpAddr, names: &[String], tokens: &Tokens) -> Result<Access, NoToken> {
        let is_loopback = address.is_loopback();
        if tokens.is_empty() && !is_loopback {
            return Err(NoToken(address));
        }
        let names = names.iter().map(|name| name.to_ascii_lowercase()).collect();
        Ok(Access { is_loopback, names, tokens: tokens.clone() })
    }

    /// Returns what a request may do. `asks` is false only for the page itself, to which other sites may link.
    pub fn admit(&self, headers: &HeaderMap, peer: IpAddr, asks: bool) -> Result<Grant, Denied> {
        let host = host_of(headers).ok_or(Denied::Host)?;
        if !self.is_known(name_of(host)) {
            return Err(Denied::Host);
        }
        if asks && is_foreign(headers) {
            return Err(Denied::Origin);
        }
        let address = (!peer.is_loopback()).then_some(peer);
        if self.tokens.is_empty() {
            return Ok(Grant { right: Right::Control, address });
        }
        let right = token_of(headers).and_then(|token| self.right_of(token));
        right.map(|right| Grant { right, address }).ok_or(Denied::Token)
    }

    /// Returns the right that a token grants.
    pub fn right_of(&self, token: &str) -> Option<Right> {
        self.tokens.right_of(token)
    }

    fn is_known(&self, name: &str) -> bool {
        match address_of(name) {
            Some(address) => address.is_loopback() || !self.is_loopback,
            None => is_this_computer(name) || self.names.contains(&name.to_ascii_lowercase()),
        }
    }
}

fn token_of(headers: &HeaderMap) -> Option<&str> {
    let authorization = headers.get(AUTHORIZATION).and_then(|value| value.to_str().ok());
    if let Some((scheme, token)) = authorization.and_then(|value| value.trim().split_once(' '))
        && scheme.eq_ignore_ascii_case("bearer")
    {
        return Some(token.trim());
    }
    let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut pairs =
        cookies.flat_map(|value| value.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find(|(name, _)| *name == COOKIE_NAME).map(|(_, token)| token)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);
    const ANYWHERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::UNSPECIFIED);

    fn admitted(
        access: &Access,
        headers: &[(&'static str, &'static str)],
    ) -> Result<Right, Denied> {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, HeaderValue::from_static(value));
        }
        access.admit(&map, HERE, true).map(|grant| grant.right)
    }

    #[test]
    fn a_name_that_was_rebound_to_this_computer_is_refused() {
        let access = Access::new(HERE, &["lab-pc".into()], &Tokens::default()).unwrap();
        for host in ["localhost:8742", "127.0.0.1:8742", "[::1]:8742", "LAB-PC:8742", "127.0.0.1"] {
            assert_eq!(admitted(&access, &[("host", host)]), Ok(Right::Control), "{host}");
        }
        for host in ["evil.example:8742", "localhost.evil.example", "192.168.1.7:8742", "", "[::1"]
        {
            assert_eq!(admitted(&access, &[("host", host)]), Err(Denied::Host), "{host}");
        }
        assert_eq!(admitted(&access, &[]), Err(Denied::Host));
        assert_eq!(
            admitted(&access, &[("host", "localhost"), ("host", "evil")]),
            Err(Denied::Host)
        );
    }

    #[test]
    fn pages_of_other_sites_are_refused() {
        let access = Access::new(HERE, &[], &Tokens::default()).unwrap();
        let host = ("host", "localhost:8742");
        let own = [host, ("origin", "http://localhost:8742"), ("sec-fetch-site", "same-origin")];
        assert_eq!(admitted(&access, &own), Ok(Right::Control));
        for origin in [
            "http://evil.example",
            "null",
            "http://localhost:9999",
            "http://localhost:8742.evil.example",
        ] {
            assert_eq!(
                admitted(&access, &[host, ("origin", origin)]),
                Err(Denied::Origin),
                "{origin}"
            );
        }
        for site in ["cross-site", "same-site"] {
            assert_eq!(admitted(&access, &[host, ("sec-fetch-site", site)]), Err(Denied::Origin));
        }
    }

    #[test]
    fn any_address_but_loopback_needs_a_token_and_the_right_comes_with_it() {
        assert_eq!(Access::new(ANYWHERE, &[], &Tokens::default()).unwrap_err(), NoToken(ANYWHERE));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("tokens");
        std::fs::write(&file, "# lab\nwatch watch-0123456789\n\ncontrol control-0123456789\n")
            .unwrap();
        let access = Access::new(ANYWHERE, &[], &Tokens::read(&file).unwrap()).unwrap();
        let host = ("host", "192.168.1.7:8742");
        let with = |name, value| admitted(&access, &[host, (name, value)]);
        for scheme in ["Bearer", "bearer", "BEARER"] {
            let value = format!("{scheme} control-0123456789").leak();
            assert_eq!(with("authorization", value), Ok(Right::Control));
        }
        assert_eq!(with("cookie", "a=b; teampulse_token=watch-0123456789"), Ok(Right::Watch));
        for wrong in [
            "Bearer control-012345678",
            "Bearer ",
            "Bearer control-01234567890",
            "Basic x",
            "Bearer",
        ] {
            assert_eq!(with("authorization", wrong), Err(Denied::Token), "{wrong}");
        }
        assert_eq!(admitted(&access, &[host]), Err(Denied::Token));
    }
}
