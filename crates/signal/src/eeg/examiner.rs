//! Power spectrum and quality of each segment.

use super::band::Band;
use super::quality::Quality;
use super::{checked_rate_hz, welch};
use crate::error::SignalError;
use crate::gaps::{bridge, is_usable};
use crate::spectrum::Transform;

/// The longest gap that is interpolated linearly [s]: a lost packet.
const SHORT_GAP_SECS: f64 = 0.1;
/// The largest share of missing samples in a segment.
const MOST_MISSING: f64 = 0.1;
/// The longest time a signal may stay constant before it is flat [s].
const FLAT_SECS: f64 = 0.2;
/// The shortest run of samples at the end of the range that is saturation.
const SATURATED_RUN: usize = 3;
/// The mains frequencies, and the half-width of their bands [Hz].
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
const MAINS_WIDTH_HZ: f64 = 1.0;

/// Examines segments of 4 s; nothing is allocated after [`new`](Examiner::new).
pub(super) struct Examiner {
    rate_hz: f64,
    transform: Transform,
    segment: Vec<f64>,
    power: Vec<f64>,
    /// The number of bins up to the highest band.
    bins: usize,
}

impl Examiner {
    pub(super) fn new(rate_hz: f64) -> Result<Examiner, SignalError> {
        let rate_hz = checked_rate_hz(rate_hz)?;
        let welch = welch(rate_hz)?;
        let length = welch.segment;
        let bins = (Band::Gamma.edges_hz().1 / rate_hz * length as f64).floor() as usize + 2;
        Ok(Examiner {
            rate_hz,
            transform: welch.transform()?,
            segment: vec![0.0; length],
            power: vec![f64::NAN; length / 2 + 1],
            bins: bins.min(length / 2 + 1),
        })
    }

    /// The number of samples of a segment.
    pub(super) fn length(&self) -> usize {
        self.segment.len()
    }

    /// The hop between segments [samples].
    pub(super) fn step(&self) -> usize {
        self.length() - self.length() / 2
    }

    /// The number of bins of [`power`](Self::power): from 0 Hz to one above 45 Hz.
    pub(super) fn bins(&self) -> usize {
        self.bins
    }

    /// The frequency of a bin [Hz].
    pub(super) fn frequency_hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate_hz / self.length() as f64
    }

    /// The power density of the last segment [µV² / Hz]; NaN if too much of the segment was missing.
    pub(super) fn power(&self) -> &[f64] {
        &self.power[..self.bins]
    }

    /// Takes in the next segment, of [`length`](Self::length) samples.
    pub(super) fn examine(&mut self, segment: &[f64]) -> Quality {
        let (flat_share, saturated_share, missing_share) = self.idle_shares(segment);
        self.segment.copy_from_slice(segment);
        let is_whole = missing_share <= MOST_MISSING && self.gaps_are_short(segment);
        if is_whole && bridge(&mut self.segment).is_ok() {
            let power = self.transform.power(&self.segment);
            self.power.iter_mut().zip(power).for_each(|(kept, power)| *kept = power);
        } else {
            self.power.fill(f64::NAN);
        }
        let power_uv2 = self.sum_uv2(1.0, Band::Gamma.edges_hz().1);
        let mains = MAINS_HZ.map(|hz| self.sum_uv2(hz - MAINS_WIDTH_HZ, hz + MAINS_WIDTH_HZ));
        let (low_hz, high_hz) = Band::Gamma.edges_hz();
        Quality {
            rms_uv: power_uv2.sqrt(),
            mains_ratio: mains.iter().sum::<f64>() / power_uv2,
            muscle_share: self.sum_uv2(low_hz, high_hz) / power_uv2,
            flat_share,
            saturated_share,
            missing_share,
        }
    }

    /// The power between two frequencies [µV²].
    fn sum_uv2(&self, low_hz: f64, high_hz: f64) -> f64 {
        let step_hz = self.frequency_hz(1);
        let count = self.power.len();
        let begin = ((low_hz / step_hz).ceil() as usize).min(count);
        let end = ((high_hz / step_hz).floor() as usize + 1).clamp(begin, count);
        self.power[begin..end].iter().sum::<f64>() * step_hz
    }

    fn gaps_are_short(&self, segment: &[f64]) -> bool {
        let most = (SHORT_GAP_SECS * self.rate_hz) as usize;
        let runs = segment.chunk_by(|a, b| is_usable(*a) == is_usable(*b));
        runs.filter(|run| !is_usable(run[0])).all(|run| run.len() <= most)
    }

    /// The shares of samples that are flat, saturated and missing.
    fn idle_shares(&self, segment: &[f64]) -> (f64, f64, f64) {
        let usable = segment.iter().copied().filter(|&value| is_usable(value));
        let (least, greatest) = usable
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let flat = (FLAT_SECS * self.rate_hz) as usize;
        let (mut flats, mut saturated, mut missing) = (0, 0, 0);
        let is_same =
            |a: &f64, b: &f64| a.total_cmp(b).is_eq() || !(is_usable(*a) || is_usable(*b));
        for run in segment.chunk_by(is_same) {
            match run.len() {
                length if !is_usable(run[0]) => missing += length,
                length if length > flat => flats += length,
                length if length >= SATURATED_RUN && !(least < run[0] && run[0] < greatest) => {
                    saturated += length;
                }
                _ => {}
            }
        }
        let share = |count: usize| count as f64 / segment.len() as f64;
        (share(flats), share(saturated), share(missing))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eeg::spectrum;

    fn noise(count: u32) -> Vec<f64> {
        (0..count).map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 1e5).collect()
    }

    #[test]
    fn one_segment_has_the_power_that_welch_gives_it() {
        let signal = noise(1024);
        let mut examiner = Examiner::new(256.0).unwrap();
        examiner.examine(&signal);
        let theirs = spectrum(&signal, 256.0).unwrap();
        assert_eq!(examiner.power(), &theirs.power[..examiner.bins()]);
        assert_eq!(examiner.frequency_hz(examiner.bins() - 1), 45.25);
    }

    #[test]
    fn a_lost_packet_is_bridged_and_more_is_not() {
        let mut examiner = Examiner::new(256.0).unwrap();
        for (lost, has_power) in [(12, true), (25, true), (26, false)] {
            let mut signal = noise(1024);
            signal[500..500 + lost].fill(f64::NAN);
            assert!((examiner.examine(&signal).missing_share - lost as f64 / 1024.0).abs() < 1e-12);
            assert_eq!(examiner.power()[40].is_finite(), has_power);
        }
    }
}
