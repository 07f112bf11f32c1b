//! Belts that nobody wears: random walks.

use std::error::Error;

use teampulse_signal::analysis::{Recording, Span};
use teampulse_signal::respiration::analysis::{Settings, whole};

use super::Seeds;
use super::random::Random;

/// The quality that random walks must not exceed.
const MOST_QUALITY: f64 = 0.4;
const RATE_HZ: f64 = 50.0;
const SECS: f64 = 60.0;

/// Analyses random walks of a minute each; returns whether none looks like breathing.
pub fn walks(seeds: Seeds, count: u64) -> Result<bool, Box<dyn Error>> {
    let mut qualities = Vec::new();
    for number in 0..count {
        let mut random = Random::new(seeds.first() + 500_000 + number);
        let mut level = 0.0;
        let mut step = || {
            level += random.normal();
            level
        };
        let signal: Vec<f64> = (0..(SECS * RATE_HZ) as usize).map(|_| step()).collect();
        let channels = [signal];
        let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &channels };
        let span = Span { begin_ns: 0, end_ns: (SECS * 1e9) as i64 };
        qualities.push(whole(&Settings::default(), &recording)?.windows.measure(span).quality);
    }
    qualities.sort_unstable_by(f64::total_cmp);
    let [median, most] =
        [0.5, 1.0].map(|share| qualities[((qualities.len() - 1) as f64 * share) as usize]);
    let met = most < MOST_QUALITY;
    println!(
        "{}  unkind, breathing: quality of {count} random walks: median {median:.2}, at most {most:.2} (bar {MOST_QUALITY})",
        if met { "pass" } else { "FAIL" }
    );
    Ok(met)
}
