//! Measures how fast messages are matched into sets, and which sets. This is the counterpart of `message_filters.cpp`,
//! with the same arguments and output.

use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;

use rustix::time::{ClockId, clock_gettime};
use teampulse_timefilter::matching::{
    ApproximateSettings, ApproximateTime, ExactTime, Listener, Message, Set,
};

const RUNS: u32 = 3;

/// The message behind a handle, as large as `sensor_msgs/Temperature`.
struct Temperature {
    stamp: i64,
    _frame: String,
    _values: [f64; 2],
}

#[derive(Clone)]
struct Arrival {
    topic: usize,
    message: Arc<Temperature>,
}

/// The digest of all sets, computed as by the peer.
struct Digest {
    hash: u64,
    sets: u64,
}

impl Listener<Arc<Temperature>> for Digest {
    fn set(&mut self, set: Set<'_, Arc<Temperature>>) {
        self.sets += 1;
        for message in set {
            self.hash = (self.hash ^ message.payload.stamp as u64).wrapping_mul(1_099_511_628_211);
        }
    }
}

/// Measures what the arguments request: `FILE POLICY TOPICS QUEUE_SIZE AGE_PENALTY MAX_INTERVAL [LOWER_BOUND...]`.
pub fn measure(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    let [file, policy, topics, queue_size, age_penalty, max_interval, lower_bounds @ ..] =
        arguments
    else {
        return Err("expected the arguments of message_filters.cpp".into());
    };
    let arrivals = read(file)?;
    let (topics, queue_size) = (topics.parse()?, queue_size.parse()?);
    let mut settings = ApproximateSettings::new(topics, queue_size);
    settings.age_penalty = age_penalty.parse()?;
    settings.max_interval_nanos = match max_interval.parse()? {
        0 => i64::MAX,
        nanos => nanos,
    };
    for (topic, lower_bound) in settings.topics.iter_mut().zip(lower_bounds) {
        topic.lower_bound_nanos = lower_bound.parse()?;
    }
    let run = || {
        if policy == "exact" {
            let mut matching = ExactTime::new(topics, queue_size);
            timed(&arrivals, |topic, message, digest| matching.push(topic, message, digest))
        } else {
            let mut matching = ApproximateTime::new(&settings);
            timed(&arrivals, |topic, message, digest| matching.push(topic, message, digest))
        }
    };
    let best = (0..RUNS).map(|_| run()).min_by(|a, b| a.0.total_cmp(&b.0));
    let (nanos, Digest { hash, sets }) = best.expect("there are runs");
    println!("{hash:x} {sets} {}", nanos / arrivals.len() as f64);
    Ok(())
}

/// Returns the processor time of all messages [ns], each handed over with its handle as to a receiver, and the digest
/// of the sets.
fn timed(
    arrivals: &[Arrival],
    mut push: impl FnMut(usize, Message<Arc<Temperature>>, &mut Digest),
) -> (f64, Digest) {
    let mut digest = Digest { hash: 14_695_981_039_346_656_037, sets: 0 };
    let handles = arrivals.to_vec();
    let mut handles = handles.into_iter();
    let begun = cpu_nanos();
    for Arrival { topic, message } in handles.by_ref() {
        push(topic, Message { stamp: message.stamp, payload: message }, &mut digest);
    }
    (cpu_nanos() - begun, black_box(digest))
}

fn read(path: &str) -> Result<Vec<Arrival>, Box<dyn Error>> {
    let arrival = |line: &str| {
        let (topic, stamp) = line.split_once(' ').ok_or_else(|| format!("{path}: {line}"))?;
        let stamp = stamp.parse()?;
        let message = Temperature { stamp, _frame: String::new(), _values: [0.0; 2] };
        Ok(Arrival { topic: topic.parse()?, message: Arc::new(message) })
    };
    std::fs::read_to_string(path)?.lines().map(arrival).collect()
}

fn cpu_nanos() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 * 1e9 + used.tv_nsec as f64
}
