//! Converts incoming samples into a gap-free signal near 250 Hz.

use std::collections::VecDeque;

use crate::gaps::is_usable;

/// Rates above twice this are averaged down towards it [Hz].
const WORKING_RATE_HZ: f64 = 250.0;
/// After a gap longer than this the signal may have moved to another level [s].
const SHORT_GAP_SECS: f64 = 0.02;

/// At a gap the signal fades within this time [s] to its mean over a period of the mains [s]: a hum that breaks off
/// looks like a beat.
const FADING_SECS: f64 = 0.04;
const PERIOD_SECS: f64 = 0.02;

/// Bridges gaps with the signal before them, mirrored and fading; removes the jump after long gaps, which would look
/// like a beat; and averages groups of samples.
#[derive(Clone, Debug)]
pub(super) struct Intake {
    group: usize,
    short_gap: u64,
    /// The newest samples, as many as fading takes.
    newest: VecDeque<f64>,
    fading: usize,
    period: usize,
    held: Option<f64>,
    missing: u64,
    offset: f64,
    sum: f64,
    in_group: usize,
}

/// The result of a sample.
pub(super) struct Taken {
    /// The sample without gaps.
    pub(super) sample: f64,
    /// The mean of the group that the sample completes, if any.
    pub(super) mean: Option<f64>,
    /// Whether the sample is the first one after a long gap.
    pub(super) resumed: bool,
}

impl Intake {
    pub(super) fn new(rate_hz: f64) -> Intake {
        let group = (rate_hz / WORKING_RATE_HZ).floor().max(1.0) as usize;
        let short_gap = (rate_hz * SHORT_GAP_SECS) as u64;
        let places = |secs: f64| ((secs * rate_hz).round() as usize).max(1);
        let (fading, period) = (places(FADING_SECS), places(PERIOD_SECS));
        Intake {
            group,
            short_gap,
            newest: VecDeque::with_capacity(fading + 1),
            fading,
            period,
            held: None,
            missing: 0,
            offset: 0.0,
            sum: 0.0,
            in_group: 0,
        }
    }

    /// The number of samples averaged into one at the working rate.
    pub(super) fn group(&self) -> usize {
        self.group
    }

    pub(super) fn push(&mut self, sample: f64) -> Taken {
        let resumed = is_usable(sample) && self.held.is_some() && self.missing > self.short_gap;
        if resumed {
            self.offset = self.held.unwrap_or(sample) - sample;
        }
        if is_usable(sample) {
            self.keep(sample + self.offset);
            self.missing = 0;
        } else {
            self.missing = self.missing.saturating_add(1);
            self.fade();
        }
        let sample = self.held.unwrap_or(0.0);
        Taken { sample, mean: self.mean_with(sample), resumed }
    }

    fn keep(&mut self, sample: f64) {
        if self.newest.len() == self.fading {
            self.newest.pop_front();
        }
        self.newest.push_back(sample);
        self.held = Some(sample);
    }

    /// Continues with a missing sample.
    fn fade(&mut self) {
        let missing = usize::try_from(self.missing).unwrap_or(usize::MAX);
        if self.newest.is_empty() || missing > self.fading {
            return;
        }
        let period = self.newest.iter().rev().take(self.period);
        let level = period.clone().sum::<f64>() / period.count() as f64;
        let mirrored = self.newest.iter().rev().nth(missing - 1).copied().unwrap_or(level);
        let left = 1.0 - missing as f64 / self.fading as f64;
        self.held = Some(level + (mirrored - level) * left);
    }

    fn mean_with(&mut self, sample: f64) -> Option<f64> {
        self.sum += sample;
        self.in_group += 1;
        if self.in_group < self.group {
            return None;
        }
        let mean = self.sum / self.group as f64;
        (self.sum, self.in_group) = (0.0, 0);
        Some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_begins_as_it_was_and_fades() {
        let mut intake = Intake::new(250.0);
        let hum = |k: usize| (k as f64 * std::f64::consts::TAU / 5.0).sin();
        let samples = (0..100).map(hum).chain([f64::NAN; 30]);
        let taken: Vec<f64> = samples.map(|sample| intake.push(sample).sample).collect();
        assert!(
            (taken[100] - 0.9 * hum(99)).abs() < 1e-9 && (taken[104] - 0.5 * hum(95)).abs() < 1e-9
        );
        assert!(taken[110..].iter().all(|sample| sample.abs() < 1e-9));
    }

    #[test]
    fn what_begins_with_a_gap_is_zero() {
        let mut intake = Intake::new(250.0);
        assert_eq!(intake.push(f64::NAN).sample, 0.0);
        assert_eq!(intake.push(3.0).sample, 3.0);
        assert_eq!(intake.push(f64::NAN).sample, 3.0);
    }
}
