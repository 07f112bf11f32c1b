//! The cost of a message in a clock model, with few devices and with many.

use std::hint::black_box;

use rustix::time::{ClockId, clock_gettime};
use teampulse_timefilter::clock::{ClockModel, Latency, OneWay, OneWaySettings, Stamps};

/// The number of messages of each device: enough to fill its envelope.
const MESSAGES: u64 = 100_000;
const RATE_HZ: i64 = 100;
const RUNS: u32 = 3;
/// The largest ratio of the cost with 64 devices to the cost with two.
const BAR: f64 = 3.0;

/// Measures the cost with 2 and with 64 devices; returns whether the bar is met.
pub fn measure() -> bool {
    let (few, many) = (best(2), best(64));
    let ratio = many / few;
    let mark = if ratio <= BAR { "pass" } else { "FAIL" };
    println!(
        "{mark}  a message costs a clock model {few:.0} ns with 2 devices, {many:.0} ns with 64: \
         {ratio:.2} times (bar {BAR} times)"
    );
    ratio <= BAR
}

fn best(devices: usize) -> f64 {
    (0..RUNS).map(|_| nanos_per_message(devices)).fold(f64::INFINITY, f64::min)
}

fn nanos_per_message(devices: usize) -> f64 {
    let settings = OneWaySettings::new(Latency::BLUETOOTH);
    let mut clocks: Vec<OneWay> = (0..devices).map(|_| OneWay::new(settings)).collect();
    let before = cpu_nanos();
    for index in 0..MESSAGES {
        let device = index as i64 * (1_000_000_000 / RATE_HZ);
        for (number, clock) in clocks.iter_mut().enumerate() {
            let delay = (index + number as u64).wrapping_mul(2_654_435_761) % 40_000_000;
            let stamps = Stamps { device: Some(device), ..Stamps::arrived(device + delay as i64) };
            black_box(clock.correct(black_box(&stamps)));
        }
    }
    (cpu_nanos() - before) / (MESSAGES * devices as u64) as f64
}

fn cpu_nanos() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 * 1e9 + used.tv_nsec as f64
}
