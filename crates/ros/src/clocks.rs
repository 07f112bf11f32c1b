//! Probes of other computers' clocks, and replies to their probes.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;
use teampulse_messages::standard::Message;
use teampulse_messages::standard::teampulse_msgs::{
    ProbeClockRequest as Request, ProbeClockResponse as Response,
};
use tokio::sync::mpsc::{self, Sender};
use tokio::time::sleep;

use crate::bus::{Bus, BusError, Client, Reply, Subscription};
use crate::graph::{Gid, Graph};

/// The type of the clock service.
const PROBE_CLOCK: &str = "teampulse_msgs/srv/ProbeClock";
/// The number of requests in a burst.
const BURST: u32 = 8;
/// The time between requests of a burst.
const WITHIN_BURST: Duration = Duration::from_millis(64);
/// The time between bursts.
const BETWEEN_BURSTS: Duration = Duration::from_secs(4);
/// The longest round trip of a usable reply [ns].
const LONGEST_NANOS: i64 = 1_000_000_000;
/// The most services that are probed.
const MOST_ASKED: usize = 64;
/// The most replies that are queued; a burst has fewer.
const WAITING: usize = 4096;

/// Reads the clock that is reported to other computers.
pub type ReadClock = Arc<dyn Fn() -> Time + Send + Sync>;

/// The result of one probe of another computer's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exchange {
    /// The offset of the other clock [s], positive if it is ahead; the error is at most half the round trip.
    pub offset_secs: f64,
    /// The round-trip time, excluding the processing time at the other end [s].
    pub round_trip_secs: f64,
}

/// Offers the service `probe_clock` of our node, through which others measure the offset of our clock.
pub fn serve_clock(bus: &dyn Bus, clock: ReadClock) -> Result<Subscription, BusError> {
    let answer = move |request: &[u8]| {
        let received = clock();
        let sent = Request::decode(request).ok()?.sent;
        Some(Response { sent, received, replied: clock() }.encode())
    };
    bus.serve(&format!("{}/probe_clock", bus.node()), PROBE_CLOCK, Arc::new(answer))
}

/// Probes the clocks of all other computers, in bursts, until the future is dropped; `on_exchange` is called with the
/// name of the computer and each result. Lost replies are ignored.
pub async fn probe_clocks(
    bus: &dyn Bus,
    clock: &Clock,
    mut on_exchange: impl FnMut(&str, Exchange),
) {
    let mut graph = bus.graph();
    let (sender, mut replies) = mpsc::channel(WAITING);
    let mut clients = Clients::new();
    loop {
        let seen = Arc::clone(&graph.borrow_and_update());
        meet(bus, clock, &seen, &mut clients, &sender);
        for number in 0..BURST {
            ask(clock, &clients, number);
            sleep(WITHIN_BURST).await;
            while let Ok((server, exchange)) = replies.try_recv() {
                on_exchange(&seen.computer(server), exchange);
            }
        }
        let unknown = |graph: &Arc<Graph>| services(graph).any(|name| !clients.contains_key(name));
        let newcomer = async { graph.wait_for(unknown).await.is_ok() };
        tokio::select! {
            () = sleep(BETWEEN_BURSTS) => {}
            true = newcomer => {}
        }
    }
}

/// The result of a probe, and the server that replied.
type Found = (Gid, Exchange);

/// The clients by service name; `None` for a client that could not be created.
type Clients = BTreeMap<String, Option<Box<dyn Client>>>;

/// The names of other participants' clock services.
fn services(graph: &Graph) -> impl Iterator<Item = &String> {
    let others = graph.services_of(PROBE_CLOCK).filter(|each| !each.own);
    others.map(|service| &service.name).take(MOST_ASKED)
}

/// Creates clients of new services, and drops those of services that are gone.
fn meet(
    bus: &dyn Bus,
    clock: &Clock,
    graph: &Graph,
    clients: &mut Clients,
    sender: &Sender<Found>,
) {
    let names: Vec<&String> = services(graph).collect();
    clients.retain(|name, _| names.contains(&name));
    for name in names {
        if clients.contains_key(name) {
            continue;
        }
        let (clock, sender) = (clock.clone(), sender.clone());
        let hear = move |reply: Reply| {
            let arrived = clock.now();
            if let Some(exchange) = exchange(&reply, arrived) {
                // If the queue is full, losing a reply makes no difference.
                sender.try_send((reply.server, exchange)).ok();
            }
        };
        let client = bus.client(name, PROBE_CLOCK, Arc::new(hear));
        let opened = client.map_err(|error| tracing::warn!("failed to {error}"));
        clients.insert(name.clone(), opened.ok());
    }
}

fn ask(clock: &Clock, clients: &Clients, number: u32) {
    for client in clients.values().flatten() {
        let request = Request { sent: clock.now() }.encode();
        if let Err(error) = client.ask(number.into(), &request) {
            tracing::debug!("failed to {error}");
        }
    }
}

/// Computes the result of a probe from its reply; `None` if the times are impossible.
fn exchange(reply: &Reply, arrived: Time) -> Option<Exchange> {
    let Response { sent, received, replied } = Response::decode(&reply.bytes).ok()?;
    let took = arrived.nanos_since(sent);
    let over_there = replied.nanos_since(received);
    let possible = (0..=LONGEST_NANOS).contains(&took) && (0..=took).contains(&over_there);
    let there = received.nanos_since(sent) as f64;
    let back = replied.nanos_since(arrived) as f64;
    possible.then(|| Exchange {
        offset_secs: (there + back) * 0.5e-9,
        round_trip_secs: (took - over_there) as f64 * 1e-9,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use proptest::prelude::*;

    use super::*;
    use crate::memory::MemoryBus;

    /// Probes for some time; returns the results.
    async fn probed(bus: &dyn Bus, clock: &Clock, secs: u64) -> Vec<(String, Exchange)> {
        let results = Mutex::default();
        let probing = probe_clocks(bus, clock, |computer, exchange| {
            let mut results: std::sync::MutexGuard<'_, Vec<_>> = results.lock().unwrap();
            results.push((computer.to_owned(), exchange));
        });
        tokio::time::timeout(Duration::from_secs(secs), probing).await.unwrap_err();
        results.into_inner().unwrap()
    }

    fn ahead(clock: &Clock, by: Duration) -> ReadClock {
        let clock = clock.clone();
        Arc::new(move || clock.now() + by)
    }

    #[tokio::test(start_paused = true)]
    async fn every_other_computer_gives_how_far_it_is_ahead_and_we_do_not_ask_ourselves() {
        let ours = MemoryBus::new("/teampulse");
        let (robot, namesake) = (ours.join("/teampulse_simulator"), ours.join("/teampulse"));
        let clock = Clock::host();
        let _services = [
            serve_clock(&*ours, ahead(&clock, Duration::from_secs(9))).unwrap(),
            serve_clock(&*robot, ahead(&clock, Duration::from_millis(1500))).unwrap(),
            serve_clock(&*namesake, ahead(&clock, Duration::ZERO)).unwrap(),
        ];
        let results = probed(&*ours, &clock, 3).await;
        assert_eq!(results.len(), 2 * BURST as usize);
        for (computer, exchange) in results {
            let expected = if computer.starts_with("/teampulse_simulator (") { 1.5 } else { 0.0 };
            let wrong_secs = (exchange.offset_secs - expected).abs();
            assert!(wrong_secs <= exchange.round_trip_secs, "{computer}: {exchange:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_computer_that_comes_later_is_asked_and_one_that_left_is_not() {
        let ours = MemoryBus::new("/teampulse");
        let robot = ours.join("/teampulse_simulator");
        let clock = Clock::host();
        assert_eq!(probed(&*ours, &clock, 5).await.len(), 0);
        let service = serve_clock(&*robot, ahead(&clock, Duration::ZERO)).unwrap();
        assert!(!probed(&*ours, &clock, 5).await.is_empty());
        drop(service);
        assert_eq!(probed(&*ours, &clock, 5).await.len(), 0);
    }

    proptest! {
        #[test]
        fn any_reply_is_read(bytes: Vec<u8>, at: i64) {
            let bytes = [&[0, 1, 0, 0], &bytes[..]].concat().into();
            let reply = Reply { number: 0, bytes, server: Gid::default() };
            if let Some(exchange) = exchange(&reply, Time::from_nanos(at)) {
                prop_assert!((0.0..=1.0).contains(&exchange.round_trip_secs));
            }
        }
    }
}
