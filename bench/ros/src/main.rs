//! Measures what receiving costs on the bus alone: `bench-ros TOPICS` subscribes to `/bench0`, `/bench1`, … and counts
//! until its standard input closes.
//!
//! Prints one JSON object per line: first that it has subscribed; then the number of messages received, the number lost
//! in transit by the publishers' sequence numbers, and the latencies since the messages were written.
#![expect(clippy::print_stdout, reason = "the counts are its output")]

use std::error::Error;
use std::io::Read;
use std::sync::{Arc, Mutex, PoisonError};

use rustix::time::{ClockId, clock_gettime};
use teampulse_ros::bus::{Arrival, Asked, Subscription};
use teampulse_ros::buses::Buses;
use teampulse_ros::environment::Environment;
use teampulse_ros::losses::Losses;

/// The QoS that sources request.
const ASKED: Asked = Asked::Adaptive { depth: 2000 };
/// The offset of the time of writing, by the monotonic clock, in the peers' messages: after the CDR header, three
/// lengths and the number of the message.
const WRITTEN_AT: usize = 16 + 8;

fn main() -> Result<(), Box<dyn Error>> {
    let topics: u32 = std::env::args().nth(1).ok_or("usage: bench-ros TOPICS")?.parse()?;
    let buses = Buses::new(Environment::read(), "bench_ros");
    let bus = buses.get(buses.default_id()?)?;
    let counts: Vec<Arc<Mutex<Count>>> = (0..topics).map(|_| Arc::default()).collect();
    let subscribe = |(k, count): (usize, &Arc<Mutex<Count>>)| {
        let count = Arc::clone(count);
        let deliver = move |arrival| lock(&count).add(&arrival);
        let name = "std_msgs/msg/UInt8MultiArray";
        bus.subscribe(&format!("/bench{k}"), name, ASKED, Arc::new(deliver))
    };
    let _subscribed: Vec<Subscription> =
        counts.iter().enumerate().map(subscribe).collect::<Result<_, _>>()?;
    println!("{{\"subscribed\": {topics}}}");

    std::io::stdin().read_to_end(&mut Vec::new())?;
    report(&counts);
    Ok(())
}

/// What was received on a topic.
#[derive(Default)]
struct Count {
    received: u64,
    lost: u64,
    /// The number of places where messages are missing.
    gaps: u64,
    losses: Losses,
    latencies_ns: Vec<i64>,
}

impl Count {
    fn add(&mut self, arrival: &Arrival) {
        self.received += 1;
        if let Some(sequence) = arrival.sequence {
            let lost = self.losses.observe(arrival.publisher, sequence);
            self.lost += lost;
            self.gaps += u64::from(lost > 0);
        }
        let written = arrival.bytes.get(WRITTEN_AT..WRITTEN_AT + 8);
        let written = written.and_then(|bytes| bytes.try_into().ok()).map(i64::from_le_bytes);
        self.latencies_ns.extend(written.map(|written_ns| monotonic_ns() - written_ns));
    }
}

fn report(counts: &[Arc<Mutex<Count>>]) {
    let received: u64 = counts.iter().map(|count| lock(count).received).sum();
    let lost: u64 = counts.iter().map(|count| lock(count).lost).sum();
    let gaps: u64 = counts.iter().map(|count| lock(count).gaps).sum();
    let mut latencies_ns: Vec<i64> =
        counts.iter().flat_map(|count| std::mem::take(&mut lock(count).latencies_ns)).collect();
    latencies_ns.sort_unstable();
    let percentile_ms = |share: f64| {
        let place = (latencies_ns.len() as f64 * share) as usize;
        latencies_ns.get(place).map_or(f64::NAN, |latency_ns| *latency_ns as f64 / 1e6)
    };
    let (p50_ms, p99_ms) = (percentile_ms(0.5), percentile_ms(0.99));
    println!(
        "{{\"messages\": {received}, \"lost\": {lost}, \"gaps\": {gaps}, \"p50_ms\": {p50_ms:.3}, \
         \"p99_ms\": {p99_ms:.3}}}"
    );
}

fn lock(count: &Mutex<Count>) -> std::sync::MutexGuard<'_, Count> {
    count.lock().unwrap_or_else(PoisonError::into_inner)
}

fn monotonic_ns() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
