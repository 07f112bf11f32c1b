//! The usual rate of a stream.

use std::collections::BTreeMap;

/// Rates that differ by less than this share count as the same.
const ALIKE: f64 = 0.02;

/// The rates of a stream, second by second, in groups of similar rates.
#[derive(Debug, Default)]
pub(super) struct Rates(BTreeMap<i64, Similar>);

/// A group of similar rates.
#[derive(Debug, Default)]
struct Similar {
    secs: u32,
    /// The sum of the rates [Hz].
    sum_hz: f64,
}

impl Rates {
    /// Takes the rate in one second [Hz], above 0.
    pub(super) fn take(&mut self, rate_hz: f64) {
        let similar = self.0.entry((rate_hz.ln() / ALIKE) as i64).or_default();
        similar.secs += 1;
        similar.sum_hz += rate_hz;
    }

    /// The median rate [Hz], to within the share that counts as the same. Samples that arrive at once after a
    /// standstill do not affect it.
    pub(super) fn usual_hz(&self) -> Option<f64> {
        let half = self.0.values().map(|similar| similar.secs).sum::<u32>() / 2;
        let mut before = 0;
        let usual = self.0.values().find(|similar| {
            before += similar.secs;
            before > half
        })?;
        Some(usual.sum_hz / f64::from(usual.secs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backlog_changes_no_rate() {
        let mut rates = Rates::default();
        assert!(rates.usual_hz().is_none());
        (0..60).for_each(|_| rates.take(32.0));
        (0..10).for_each(|_| rates.take(2758.0));
        assert!((rates.usual_hz().expect("seconds with samples") - 32.0).abs() < 1e-9);
    }
}
