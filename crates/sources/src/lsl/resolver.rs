//! Finds streams: queries every computer in range repeatedly.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_devices::lsl::{Discovery, PORTS, StreamInfo, discovered};
use tokio::net::{UdpSocket, lookup_host};
use tokio::time::timeout;

use super::multicast::{groups, local_addresses, send, sender};

/// The largest datagram [bytes].
const LARGEST_BYTES: usize = 65_536;
/// How often the query is repeated in a scan.
const AGAIN: Duration = Duration::from_millis(500);

/// A stream in range.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundStream {
    /// The description of the stream.
    pub info: StreamInfo,
    /// The address of the sender.
    pub address: Ipv4Addr,
}

/// Returns the streams that reply to a query within a time, each once.
pub async fn resolve(
    query: &str,
    peers: &[String],
    within: Duration,
) -> std::io::Result<Vec<FoundStream>> {
    let mut resolver = Resolver::open(query.to_owned(), peers.to_vec())?;
    let mut found = BTreeMap::new();
    let began = Stopwatch::start();
    while let Some(left) = within.checked_sub(began.elapsed()).filter(|left| !left.is_zero()) {
        resolver.ask().await;
        let waiting = async {
            loop {
                let stream = resolver.next().await;
                found.entry(stream.info.uid.clone()).or_insert(stream);
            }
        };
        let _elapsed: Result<(), _> = timeout(left.min(AGAIN), waiting).await;
    }
    Ok(found.into_values().collect())
}

/// Queries for streams and receives the replies.
pub(super) struct Resolver {
    socket: UdpSocket,
    query: String,
    peers: Vec<String>,
    id: String,
    buffer: Vec<u8>,
}

impl Resolver {
    pub fn open(query: String, peers: Vec<String>) -> std::io::Result<Resolver> {
        let socket = sender()?;
        let id = format!("{}{}", std::process::id(), socket.local_addr()?.port());
        Ok(Resolver { socket, query, peers, id, buffer: vec![0; LARGEST_BYTES] })
    }

    /// Sends the query to everything that can be reached. If one network refuses it, the others are still queried.
    pub async fn ask(&self) {
        let port = self.socket.local_addr().map_or(0, |address| address.port());
        let datagram = Discovery { query: self.query.clone(), port, id: self.id.clone() }.encode();
        let datagram = datagram.as_bytes();
        for address in local_addresses() {
            for group in groups() {
                if let Err(error) = send(&self.socket, address, group, datagram).await {
                    tracing::debug!(%address, %group, "failed to search for LSL streams: {error}");
                }
            }
        }
        let mut asked = vec![Ipv4Addr::LOCALHOST];
        for peer in &self.peers {
            asked.extend(addresses(peer).await);
        }
        for address in asked {
            for port in PORTS {
                // A computer that is not there does not reply.
                drop(self.socket.send_to(datagram, (address, port)).await);
            }
        }
    }

    /// Returns the next stream that replies; the same one may be returned several times.
    pub async fn next(&mut self) -> FoundStream {
        loop {
            // Errors here are about earlier datagrams to a closed port.
            let Ok((count, SocketAddr::V4(peer))) = self.socket.recv_from(&mut self.buffer).await
            else {
                tokio::task::yield_now().await;
                continue;
            };
            let datagram = self.buffer.get(..count).unwrap_or_default();
            match discovered(datagram, &self.id) {
                Some(Ok(info)) => return FoundStream { info, address: *peer.ip() },
                Some(Err(error)) => tracing::debug!(%peer, "failed to {error}"),
                None => {}
            }
        }
    }
}

/// Returns the addresses of a host name.
async fn addresses(peer: &str) -> Vec<Ipv4Addr> {
    let found = lookup_host((peer, PORTS.start)).await;
    let found =
        found.map_err(|error| tracing::warn!("failed to find the LSL peer {peer}: {error}"));
    let v4 =
        |address| if let SocketAddr::V4(address) = address { Some(*address.ip()) } else { None };
    found.map(|found| found.filter_map(v4).collect()).unwrap_or_default()
}
