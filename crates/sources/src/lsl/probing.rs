//! Probes of the clock of a stream's sender.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;
use teampulse_devices::lsl::{ProbeReply, ProbeRequest};
use tokio::net::UdpSocket;
use tokio::time::{sleep, timeout};

/// The number of probes in a burst, the time between probes and the time between bursts, as in liblsl.
const BURST: i32 = 8;
const WITHIN_BURST: Duration = Duration::from_millis(64);
const BETWEEN_BURSTS: Duration = Duration::from_secs(4);
/// The longest round trip of a usable reply [ns].
const LONGEST_NANOS: i64 = 1_000_000_000;
/// The largest plausible offset of a clock [s].
const FURTHEST_SECS: f64 = 9e9;

/// The result of a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exchange {
    /// How far the sender's clock is ahead of the session's [s].
    pub offset_secs: f64,
    /// The round trip without the time spent at the sender [s].
    pub round_trip_secs: f64,
}

/// Probes a sender's clock in bursts until it is dropped.
pub(super) async fn probe(
    address: Ipv4Addr,
    port: u16,
    clock: &Clock,
    mut on_exchange: impl FnMut(Exchange),
) -> std::io::Result<()> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).await?;
    let to = SocketAddr::from((address, port));
    let mut buffer = [0; 1024];
    let mut wave: i32 = 0;
    loop {
        let mut sent = BTreeMap::new();
        for _ in 0..BURST {
            wave = wave.wrapping_add(1);
            let now = clock.now();
            sent.insert(wave, now);
            let request = ProbeRequest { wave, sent_secs: now.secs() }.encode();
            if let Err(error) = socket.send_to(request.as_bytes(), to).await {
                tracing::debug!("failed to probe the clock of {to}: {error}");
            }
            let listening = async {
                loop {
                    // Errors here are about earlier datagrams to a closed port.
                    let Ok((count, peer)) = socket.recv_from(&mut buffer).await else {
                        sleep(WITHIN_BURST).await;
                        continue;
                    };
                    let arrived = clock.now();
                    let reply = ProbeReply::parse(buffer.get(..count).unwrap_or_default());
                    let reply = reply.filter(|_| peer.ip() == to.ip());
                    let found = reply
                        .and_then(|reply| exchange(&reply, sent.remove(&reply.wave)?, arrived));
                    found.into_iter().for_each(&mut on_exchange);
                }
            };
            let _elapsed: Result<(), _> = timeout(WITHIN_BURST, listening).await;
        }
        sleep(BETWEEN_BURSTS).await;
    }
}

/// Returns the result of a reply; `None` if it is impossible.
fn exchange(reply: &ProbeReply, sent: Time, arrived: Time) -> Option<Exchange> {
    let near = |secs: &f64| secs.abs() < FURTHEST_SECS;
    let times = Some((reply.received_secs, reply.replied_secs));
    let (received_secs, replied_secs) =
        times.filter(|(received, replied)| near(received) && near(replied))?;
    let (received, replied) = ((received_secs * 1e9) as i64, (replied_secs * 1e9) as i64);
    let took = arrived.nanos_since(sent);
    let over_there = replied - received;
    let is_possible = (0..=LONGEST_NANOS).contains(&took) && (0..=took).contains(&over_there);
    let offset = i128::from(received) - i128::from(sent.nanos()) + i128::from(replied)
        - i128::from(arrived.nanos());
    is_possible.then(|| Exchange {
        offset_secs: offset as f64 * 0.5e-9,
        round_trip_secs: (took - over_there) as f64 * 1e-9,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_is_halfway_and_impossible_replies_are_ignored() {
        let at = |nanos: i64| Time::from_nanos(1_790_000_000_000_000_000 + nanos);
        let reply = |received_secs: f64, replied_secs: f64| ProbeReply {
            wave: 1,
            sent_secs: 0.0,
            received_secs,
            replied_secs,
        };
        let found = exchange(&reply(93.5, 93.501), at(0), at(3_000_000)).expect("is possible");
        assert!((found.offset_secs - (93.5005 - 1_790_000_000.001_5)).abs() < 1e-6, "{found:?}");
        assert!((found.round_trip_secs - 0.002).abs() < 1e-9, "{found:?}");
        assert_eq!(exchange(&reply(93.5, 93.0), at(0), at(3_000_000)), None);
        assert_eq!(exchange(&reply(93.5, 94.0), at(0), at(3_000_000)), None);
        assert_eq!(exchange(&reply(1e300, 1e300), at(0), at(3_000_000)), None);
    }
}
