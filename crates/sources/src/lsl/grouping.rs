//! Groups regular samples into runs: each run is a wave.

use teampulse_devices::lsl::{Sample, Values};

/// The longest duration of a run [s], and the largest number of values in one.
const LONGEST_SECS: f64 = 1.0;
const MOST_NUMBERS: usize = 65_536;
/// A jump of stamps smaller than this is jitter of the sender [s].
const JITTER_SECS: f64 = 0.05;

/// Samples one period apart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    /// The stamp of the first sample [s].
    pub stamp_secs: f64,
    pub samples: usize,
    /// The values, sample by sample.
    pub values: Vec<f64>,
    /// The number of samples missing before the run, by the stamps.
    pub missing: u64,
}

/// Groups samples into runs: each stamp is within half a period of the sample's place in the run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grouping {
    period_secs: f64,
    /// When the next sample is due, by the stamps [s].
    due_secs: Option<f64>,
}

impl Grouping {
    pub fn new(rate_hz: f64) -> Grouping {
        Grouping { period_secs: 1.0 / rate_hz, due_secs: None }
    }

    /// Forgets when the next sample is due, as the sender's clock has changed.
    pub fn forget(&mut self) {
        self.due_secs = None;
    }

    pub fn group(&mut self, samples: &[Sample]) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for sample in samples {
            let Values::Numbers(values) = &sample.values else { continue };
            match runs.last_mut().filter(|run| self.goes_on(run, sample.stamp_secs, values.len())) {
                Some(run) => {
                    run.samples += 1;
                    run.values.extend(values);
                }
                None => runs.push(Run {
                    stamp_secs: sample.stamp_secs,
                    samples: 1,
                    values: values.clone(),
                    missing: self.missing(sample.stamp_secs),
                }),
            }
            self.due_secs = Some(sample.stamp_secs + self.period_secs);
        }
        runs
    }

    fn goes_on(&self, run: &Run, stamp_secs: f64, width: usize) -> bool {
        let due_secs = run.stamp_secs + run.samples as f64 * self.period_secs;
        let is_in_place = (stamp_secs - due_secs).abs() < self.period_secs / 2.0;
        is_in_place
            && run.samples as f64 * self.period_secs < LONGEST_SECS
            && run.values.len() + width <= MOST_NUMBERS
    }

    fn missing(&self, stamp_secs: f64) -> u64 {
        let Some(due_secs) = self.due_secs else { return 0 };
        let late_secs = stamp_secs - due_secs;
        if late_secs > JITTER_SECS.max(self.period_secs / 2.0) {
            (late_secs / self.period_secs).round() as u64
        } else {
            0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(stamps: impl IntoIterator<Item = f64>) -> Vec<Sample> {
        let sample =
            |stamp_secs| Sample { stamp_secs, values: Values::Numbers(vec![stamp_secs, 0.0]) };
        stamps.into_iter().map(sample).collect()
    }

    #[test]
    fn a_gap_ends_a_run_and_is_counted() {
        let mut grouping = Grouping::new(100.0);
        let stamps = (0..50).map(|k| 5.0 + f64::from(k) * 0.01);
        let gap = (0..10).map(|k| 6.0 + f64::from(k) * 0.01);
        let runs = grouping.group(&samples(stamps.chain(gap)));
        let found: Vec<(f64, usize, u64)> =
            runs.iter().map(|run| (run.stamp_secs, run.samples, run.missing)).collect();
        assert_eq!(found, [(5.0, 50, 0), (6.0, 10, 50)]);
        let later = grouping.group(&samples([7.0]));
        assert_eq!(later[0].missing, 90, "over pieces, too");
    }

    #[test]
    fn stamps_that_jitter_are_kept_and_nothing_is_missing() {
        let mut grouping = Grouping::new(500.0);
        let stamps =
            (0..500).map(|k| 5.0 + f64::from(k) * 0.002 + f64::from(k * 7919 % 11) * 0.0004);
        let stamps: Vec<f64> = stamps.collect();
        let runs = grouping.group(&samples(stamps.clone()));
        assert_eq!(runs.iter().map(|run| run.samples).sum::<usize>(), 500);
        assert!(runs.iter().all(|run| run.missing == 0));
        let mut at = stamps.iter();
        for run in &runs {
            for k in 0..run.samples {
                let place = run.stamp_secs + k as f64 * 0.002;
                assert!((at.next().expect("as many") - place).abs() <= 0.001);
            }
        }
    }
}
