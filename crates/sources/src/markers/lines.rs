//! Lines of text received over TCP, each of which is a marker.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use tokio::io::AsyncReadExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::mark;
use crate::SourceContext;

/// The longest line [bytes].
const LONGEST_BYTES: usize = 4096;
/// The largest number of programs connected at a time.
const MOST: usize = 32;
/// The shortest token [characters].
const SHORTEST_TOKEN: usize = 16;
/// How long a program may take to send its token.
const PATIENCE: Duration = Duration::from_secs(5);

/// Markers from any program that opens a TCP connection and writes lines: each line of text is a marker, at the time of
/// its arrival.
///
/// `echo "trial 1" | nc -N 127.0.0.1 5006` sets a marker. Other computers can reach the port only with a token, which
/// is then the first line of each connection: `token SECRET`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkerLines {
    /// The address and port to listen on; with `0.0.0.0:5006` other computers can reach it.
    #[serde(default = "listen")]
    pub listen: SocketAddr,
    /// The token of at least 16 characters with which each connection must begin, as a line `token SECRET`. Required if
    /// other computers can connect.
    #[serde(default)]
    pub token: Option<String>,
}

fn listen() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 5006))
}

impl Component<dyn Source, SourceContext> for MarkerLines {
    const EXAMPLE: &'static str = r#"listen = "127.0.0.1:5006""#;

    fn build(self, _: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        let wrong = |message: &str| {
            let hint = "set a token of at least 16 characters, such as the output of `openssl rand -hex 16`";
            Err(SettingsError::new(message).at("token").with_hint(hint))
        };
        match &self.token {
            None if !self.listen.ip().is_loopback() => {
                wrong("other computers can connect, but no token is set")
            }
            Some(token) if token.chars().count() < SHORTEST_TOKEN => {
                wrong("the token is too short")
            }
            Some(token) if token.contains(['\r', '\n']) => wrong("the token has several lines"),
            _ => Ok(Box::new(Door { listen: self.listen, token: self.token.map(Arc::from) })),
        }
    }
}

/// A port that receives markers.
struct Door {
    listen: SocketAddr,
    token: Option<Arc<str>>,
}

#[async_trait]
impl Source for Door {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let listener = TcpListener::bind(self.listen).await.map_err(|error| SourceError::Gone {
            message: format!("listen for markers on {}: {error}", self.listen),
            hint: "does another program, or another source of the study, use this port? Set another one as `listen`".into(),
        })?;
        let places = Arc::new(Semaphore::new(MOST));
        let mut writers: JoinSet<()> = JoinSet::new();
        let mut refused: u64 = 0;
        loop {
            let accepted = tokio::select! {
                accepted = listener.accept() => accepted,
                Some(ended) = writers.join_next() => {
                    // A task's panic is resumed here; it is caught further up.
                    if let Err(error) = ended {
                        std::panic::resume_unwind(error.into_panic());
                    }
                    continue;
                }
                () = outlet.closed() => {
                    report_refused(refused, outlet);
                    return Ok(());
                }
            };
            let Ok((link, peer)) = accepted else {
                // Accepting fails when no more files can be opened, for example.
                sleep(Duration::from_millis(100)).await;
                continue;
            };
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                // In a flood of connections the first refusal is reported at once, the number of refusals later.
                if refused == 0 {
                    outlet.happen(passing(format!(
                        "markers: more than {MOST} connections: the one from {peer} was refused"
                    )));
                }
                refused += 1;
                continue;
            };
            report_refused(std::mem::take(&mut refused), outlet);
            let (token, outlet) = (self.token.clone(), outlet.clone());
            writers.spawn(async move {
                if let Err(why) = read(link, token.as_deref(), &outlet).await {
                    outlet.happen(passing(format!(
                        "markers: the connection from {} was closed: {why}",
                        peer.ip()
                    )));
                }
                drop(place);
            });
        }
    }

    fn may_be_silent(&self) -> bool {
        true
    }
}

/// Reports the number of refused connections, unless it is only the one already reported.
fn report_refused(refused: u64, outlet: &Outlet) {
    if refused > 1 {
        outlet.happen(passing(format!("markers: {refused} connections were refused")));
    }
}

/// Reads lines until the connection ends.
async fn read(
    mut link: TcpStream,
    token: Option<&str>,
    outlet: &Outlet,
) -> Result<(), &'static str> {
    let mut lines = LineBuffer::default();
    if let Some(token) = token {
        let first = timeout(PATIENCE, next(&mut link, &mut lines)).await;
        let first = first.map_err(|_elapsed| "no token was sent")??;
        let given = first.as_deref().and_then(|line| line.strip_prefix("token "));
        if !given.is_some_and(|given| is_same(given.as_bytes(), token.as_bytes())) {
            return Err(
                "the token is missing or wrong: the first line must be `token` and the token",
            );
        }
    }
    while let Some(line) = next(&mut link, &mut lines).await? {
        if !line.trim().is_empty() {
            mark(line, f64::NAN, outlet.clock().now(), outlet);
        }
    }
    Ok(())
}

/// Returns the next line; `None` at the end.
async fn next(
    link: &mut TcpStream,
    lines: &mut LineBuffer,
) -> Result<Option<String>, &'static str> {
    let mut bytes = [0; 1024];
    loop {
        if let Some(line) = lines.take()? {
            return Ok(Some(line));
        }
        match link.read(&mut bytes).await {
            Ok(count) if count > 0 => lines.push(bytes.get(..count).unwrap_or_default()),
            // A last line without a line end counts, too.
            _ => return Ok(lines.rest()),
        }
    }
}

/// Whether two texts are equal, compared in a time that does not depend on where they differ.
fn is_same(one: &[u8], other: &[u8]) -> bool {
    let differing = one.iter().zip(other).fold(0, |all, (one, other)| all | (one ^ other));
    one.len() == other.len() && differing == 0
}

/// Assembles lines from bytes that arrive in pieces.
#[derive(Debug, Default)]
struct LineBuffer(Vec<u8>);

impl LineBuffer {
    fn push(&mut self, bytes: &[u8]) {
        self.0.extend(bytes);
    }

    fn take(&mut self) -> Result<Option<String>, &'static str> {
        match self.0.iter().position(|byte| *byte == b'\n') {
            Some(end) if end <= LONGEST_BYTES => {
                let rest = self.0.split_off(end + 1);
                Ok(Some(text(&std::mem::replace(&mut self.0, rest))))
            }
            None if self.0.len() <= LONGEST_BYTES => Ok(None),
            _ => Err("a line is longer than 4096 bytes"),
        }
    }

    fn rest(&mut self) -> Option<String> {
        let rest = std::mem::take(&mut self.0);
        (!rest.is_empty()).then(|| text(&rest))
    }
}

fn text(line: &[u8]) -> String {
    String::from_utf8_lossy(line).trim_matches(['\r', '\n']).to_owned()
}
