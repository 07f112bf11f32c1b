//! An Empatica E4: its streaming server over TCP, on loopback.

use std::io;
use std::net::Ipv4Addr;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock;
use teampulse_emulators::devices::{E4Incident, E4Server};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{interval, sleep};

use super::Emulation;
use super::shimmer3::GRAIN;
use super::wardrobe::Dressed;

/// The largest number of request bytes read at once.
const PIECE: usize = 1024;
/// The pause between two lines, so that they arrive one by one.
const BETWEEN_LINES: Duration = Duration::from_millis(1);
/// The largest number of clients served at a time.
const MOST_CLIENTS: usize = 16;

/// The streaming server of an Empatica E4 that a simulated person wears, on loopback.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmulatedE4 {
    /// The person who wears it: `p001`.
    pub person: String,
    /// The TCP port; 0 for any free one. Default: 28000, as for Empatica's server.
    #[serde(default = "port")]
    pub port: u16,
    /// The faults of the E4 and its server, in order of time.
    #[serde(default)]
    pub faults: Vec<E4Incident>,
}

fn port() -> u16 {
    28000
}

impl EmulatedE4 {
    pub(super) async fn open(&self, worn: Dressed) -> io::Result<Emulation> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, self.port)).await;
        let listener = listener.map_err(|error| {
            let message = format!("an Empatica E4 at port {}: {error}", self.port);
            io::Error::new(error.kind(), message)
        })?;
        let address = listener.local_addr()?.to_string();
        Ok(Emulation {
            device: format!("Empatica E4 of {}", self.person),
            study: format!(
                "[[sources]]\ntype   = \"empatica_e4\"\nperson = \"{}\"\nserver = \"{address}\"",
                self.person
            ),
            address,
            serving: Box::pin(serve(listener, worn, self.faults.clone())),
        })
    }
}

/// Serves clients, each with its own session, as Empatica's server does.
async fn serve(listener: TcpListener, worn: Dressed, faults: Vec<E4Incident>) -> io::Result<()> {
    let mut clients = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept(), if clients.len() < MOST_CLIENTS => {
                let (client, _) = accepted?;
                clients.spawn(converse(client, worn.clone(), faults.clone()));
            }
            // A client that leaves in the middle of a line is not an error of the server.
            Some(_left) = clients.join_next() => {}
        }
    }
}

async fn converse(mut client: TcpStream, worn: Dressed, faults: Vec<E4Incident>) -> io::Result<()> {
    client.set_nodelay(true)?;
    // Like the real server, it stamps data with the clock of its computer, which is this one.
    let started = clock::wall() - worn.clock.elapsed();
    let server = E4Server::new(faults).started_at(started.nanos() as f64 * 1e-9);
    let (mut server, mut wearer) = (server, worn.wearer.at_wrist());
    let mut ticks = interval(GRAIN);
    let mut bytes = [0; PIECE];
    // Data measured before the client connected are discarded.
    server.until(worn.clock.elapsed().as_secs_f64(), &mut wearer);
    loop {
        ticks.tick().await;
        match client.try_read(&mut bytes) {
            Ok(0) => return Ok(()),
            Ok(count) => server.receive(bytes.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
        let sent = server.until(worn.clock.elapsed().as_secs_f64(), &mut wearer);
        // One TCP segment per line, as some programs take each read for a line.
        for line in sent.split_inclusive(|byte| *byte == b'\n') {
            client.write_all(line).await?;
            sleep(BETWEEN_LINES).await;
        }
    }
}
