//! The addresses at which browsers open a dashboard.

use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

use crate::context::Settings;

/// The maximum number of addresses listed for other computers: a computer may have one for every container.
const MOST: usize = 3;

/// The addresses at which browsers open a dashboard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// The address for this computer.
    pub here: String,
    /// The addresses for other computers, if they differ.
    pub elsewhere: Vec<String>,
    /// The file of tokens, if each address must be completed with a token.
    pub tokens: Option<PathBuf>,
}

impl Addresses {
    /// The addresses of a dashboard that listens on a port.
    pub(crate) fn of(settings: &Settings, port: u16) -> Addresses {
        let (listen, scheme) = (settings.listen, settings.scheme());
        let query = if settings.tokens.is_empty() { "" } else { "?token=…" };
        let url = |host: &str| format!("{scheme}://{host}:{port}/{query}");
        let at = |address: IpAddr| format!("{scheme}://{}/{query}", SocketAddr::new(address, port));
        let here = if listen.is_unspecified() { url("localhost") } else { at(listen) };
        let elsewhere: Vec<String> = if listen.is_loopback() {
            Vec::new()
        } else {
            let names = settings.names.iter().map(|name| url(name));
            names.chain(settings.reached_at().map(at)).take(MOST).collect()
        };
        Addresses { here, elsewhere, tokens: settings.tokens.file().map(PathBuf::from) }
    }

    /// Returns the lines that are printed for the user.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!("the dashboard is at {}", self.here)];
        if !self.elsewhere.is_empty() {
            lines.push(format!("other computers open it at {}", self.elsewhere.join(" or ")));
        }
        if let Some(file) = &self.tokens {
            lines
                .push(format!("replace the … after `token=` with a token from {}", file.display()));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tokens::Tokens;

    /// The lines about a dashboard with tokens that listens at an address of a computer with two.
    fn lines(listen: &str, names: &[&str]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("tokens.txt");
        std::fs::write(&file, "watch watch-0123456789\n").unwrap();
        let settings = Settings {
            listen: listen.parse().unwrap(),
            local: ["127.0.0.1", "10.0.0.3", "192.168.1.7"].map(|it| it.parse().unwrap()).into(),
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            tokens: Tokens::read(&file).unwrap(),
            ..Settings::default()
        };
        let mut lines = Addresses::of(&settings, 8742).lines();
        let last = lines.pop().unwrap();
        assert_eq!(
            last,
            format!("replace the … after `token=` with a token from {}", file.display())
        );
        lines
    }

    #[test]
    fn a_dashboard_on_all_addresses_is_opened_at_one_that_works() {
        assert_eq!(
            lines("0.0.0.0", &[]),
            [
                "the dashboard is at http://localhost:8742/?token=…",
                "other computers open it at http://10.0.0.3:8742/?token=… or http://192.168.1.7:8742/?token=…",
            ]
        );
        let named = &lines("::", &["lab-pc"])[1];
        assert!(named.starts_with("other computers open it at http://lab-pc:8742/?token=… or "));
    }

    #[test]
    fn a_dashboard_on_one_address_is_opened_there() {
        assert_eq!(
            lines("192.168.1.7", &[]),
            ["the dashboard is at http://192.168.1.7:8742/?token=…"]
        );
        assert_eq!(lines("::1", &["lab-pc"]), ["the dashboard is at http://[::1]:8742/?token=…"]);
        let default = Addresses::of(&Settings::default(), 8743).lines();
        assert_eq!(default, ["the dashboard is at http://127.0.0.1:8743/"]);
    }
}
