//! Glitches of electrode contact.

use std::collections::VecDeque;

use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, median_in_place};

/// Samples are averaged down to this rate [Hz], or slightly above.
const WORKING_HZ: f64 = 32.0;
/// A glitch of half a second is compared with this time before and after it [s].
const REACH_SECS: f64 = 0.625;
/// The longest edge of a glitch [s].
const EDGE_SECS: f64 = 0.15;
/// The smallest share of the change that lies in either edge. Around a smooth peak it is three quarters where
/// an edge is half of the reach, as at 4 Hz, and less elsewhere.
const SUDDEN: f64 = 0.8;
/// The smallest share of the total variation since 0.6 s before the glitch that lies in the edge: a trough between a
/// fall and a rise is not a glitch.
const LEAST_OF_ALL: f64 = 0.5;
/// The amplitude of the smallest glitch: below this no response results [µS], and within this many standard deviations
/// of noise none is detected.
const LEAST_US: f64 = 0.04;
const LEAST_DEVIATIONS: f64 = 5.0;

/// The length of signal from which noise is estimated [s].
const NOISE_SECS: f64 = 10.0;

/// Whether each sample of a skin conductance [µS] belongs to a contact glitch of up to half a second: it lies off the
/// line from 0.6 s before to 0.6 s after it, with a jump away from the line and one back.
///
/// No sweat gland does that: a rise within a second takes seconds to recover. Below 4 Hz, and in the first
/// and last 0.6 s, none is detected.
pub(super) fn glitches(signal: &[f64], rate_hz: f64) -> Vec<bool> {
    let size = (rate_hz / WORKING_HZ).floor().max(1.0) as usize;
    let means: Vec<f64> = signal.chunks(size).map(mean).collect();
    let Some(stretch) = Stretch::at(rate_hz / size as f64) else {
        return vec![false; signal.len()];
    };
    let mut differences: Vec<f64> = differences(means.iter().copied()).collect();
    let least_us = least_us(&mut differences);
    let mut found = vec![false; means.len()];
    for (begin, around) in means.windows(stretch.length()).enumerate() {
        if stretch.is_glitch(around, |off_us| off_us > least_us) {
            // An edge within a group is hidden by its mean.
            let margin = usize::from(size > 1);
            let place = begin + stretch.reach;
            found[place - margin..=place + margin].fill(true);
        }
    }
    let groups = signal.chunks(size).zip(found);
    groups.flat_map(|(group, found)| std::iter::repeat_n(found, group.len())).collect()
}

/// Removes contact glitches causally, with a delay of 0.6 s.
#[derive(Clone, Debug)]
pub(super) struct SteadyContact {
    stretch: Option<Stretch>,
    times_ns: VecDeque<i64>,
    /// The newest values, oldest first: enough to estimate noise.
    newest: Vec<f64>,
    kept: usize,
    scratch: Vec<f64>,
    /// The value last returned.
    last: f64,
}

impl SteadyContact {
    /// Creates the filter for a rate of 1 to 65 Hz.
    pub(super) fn new(rate_hz: f64) -> SteadyContact {
        let stretch = Stretch::at(rate_hz);
        let length = stretch.map_or(1, Stretch::length);
        let kept = ((NOISE_SECS * rate_hz) as usize).max(length);
        let times_ns = VecDeque::with_capacity(length);
        let (newest, scratch) = (Vec::with_capacity(2 * kept), Vec::with_capacity(2 * kept));
        SteadyContact { stretch, times_ns, newest, kept, scratch, last: f64::NAN }
    }

    /// Takes in the next value [µS], and returns an earlier one with its time, interpolated within a glitch.
    /// `None` during the first 0.6 s.
    pub(super) fn push(&mut self, at_ns: i64, value: f64) -> Option<(i64, f64)> {
        let Some(stretch) = self.stretch else { return Some((at_ns, value)) };
        if self.newest.len() == 2 * self.kept {
            self.newest.copy_within(self.kept.., 0);
            self.newest.truncate(self.kept);
        }
        self.newest.push(value);
        self.times_ns.push_back(at_ns);
        if self.times_ns.len() <= stretch.reach {
            return None;
        }
        let at_ns = self.times_ns.pop_front()?;
        let value = self.newest[self.newest.len() - 1 - stretch.reach];
        self.last = self.steady(stretch).unwrap_or(value);
        Some((at_ns, self.last))
    }

    /// The replacement for a glitch: on the line from the last value to those after it.
    fn steady(&mut self, stretch: Stretch) -> Option<f64> {
        let begin = self.newest.len().checked_sub(stretch.length())?;
        let (newest, scratch) = (&self.newest, &mut self.scratch);
        let around = &newest[begin..];
        let is_glitch = stretch.is_glitch(around, |off_us| {
            scratch.clear();
            scratch.extend(differences(newest.iter().copied()));
            off_us > least_us(scratch)
        });
        is_glitch.then(|| {
            let after = stretch.end(around);
            self.last + (around[stretch.reach + after] - self.last) / (after + 1) as f64
        })
    }
}

/// The stretch examined to judge the value at its centre.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    reach: usize,
    edge: usize,
}

impl Stretch {
    /// `None` at a rate [Hz] too low to resolve a glitch.
    fn at(rate_hz: f64) -> Option<Stretch> {
        let reach = (REACH_SECS * rate_hz) as usize;
        let edge = ((EDGE_SECS * rate_hz) as usize).max(1);
        (reach > edge).then_some(Stretch { reach, edge })
    }

    fn length(self) -> usize {
        2 * self.reach + 1
    }

    /// The midpoint of the line from the first to the last value.
    fn line_us(self, around: &[f64]) -> f64 {
        around[0].midpoint(around[2 * self.reach])
    }

    /// The number of values after the centre until the end of the glitch.
    fn end(self, around: &[f64]) -> usize {
        let Stretch { reach, edge } = self;
        let off_us = around[reach] - self.line_us(around);
        jump(&around[reach..], edge, -off_us).map_or(reach, |end| (end + edge).min(reach))
    }

    fn is_glitch(self, around: &[f64], is_beyond_noise: impl FnOnce(f64) -> bool) -> bool {
        let Stretch { reach, edge } = self;
        let off_us = around[reach] - self.line_us(around);
        off_us.abs() > LEAST_US
            && jump(&around[..=reach], edge, off_us).is_some()
            && jump(&around[reach..], edge, -off_us).is_some()
            && is_beyond_noise(off_us.abs())
    }
}

/// The index after a jump that contains most of `change_us`, provided the total variation does not exceed it.
fn jump(values: &[f64], edge: usize, change_us: f64) -> Option<usize> {
    let all = (values[values.len() - 1] - values[0]) / change_us;
    let least = SUDDEN.max(LEAST_OF_ALL * all.abs());
    let is_sudden = |(from, to): (&f64, &f64)| (to - from) / change_us >= least;
    Some(values.iter().zip(&values[edge..]).position(is_sudden)? + edge)
}

fn mean(values: &[f64]) -> f64 {
    let usable = values.iter().filter(|value| is_usable(**value));
    let (count, sum) = usable.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    sum / count as f64
}

fn differences(values: impl Iterator<Item = f64> + Clone) -> impl Iterator<Item = f64> {
    let pairs = values.clone().zip(values.skip(1));
    pairs.map(|(from, to)| (to - from).abs()).filter(|each| is_usable(*each))
}

/// The smallest amplitude above noise; the standard deviation is estimated from differences of white noise.
fn least_us(differences: &mut [f64]) -> f64 {
    let deviation = |middle: f64| SIGMA_FROM_MAD * middle / std::f64::consts::SQRT_2;
    LEAST_DEVIATIONS * median_in_place(differences).map_or(0.0, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a minute with two responses of 1 µS, as steep as they come.
    fn skin(rate_hz: f64) -> Vec<f64> {
        let form = |secs: f64| {
            if secs > 0.0 { ((-secs / 1.5).exp() - (-secs / 0.5).exp()) / 0.385 } else { 0.0 }
        };
        let sample = |k: u32| f64::from(k) / rate_hz;
        let secs = (0..(30.0 * rate_hz) as u32).map(sample);
        secs.map(|secs| 3.0 + form(secs - 5.0) + form(secs - 7.0)).collect()
    }

    #[test]
    fn half_a_second_of_other_contact_is_found_and_responses_are_not() {
        for rate_hz in [4.0, 15.0, 32.0, 128.0, 1000.0] {
            let mut signal = skin(rate_hz);
            assert!(!glitches(&signal, rate_hz).contains(&true), "{rate_hz}");
            let (begin, end) = ((20.0 * rate_hz) as usize, (20.5 * rate_hz) as usize);
            for change in [-0.2, 0.2, 4.0] {
                signal[begin..end].iter_mut().for_each(|value| *value += change);
                let found = glitches(&signal, rate_hz);
                let count = found.iter().filter(|each| **each).count();
                assert!(found[begin..end].iter().all(|each| *each), "{rate_hz} {change}");
                assert!(count <= end - begin + 100, "{rate_hz} {change}: {count}");
                signal[begin..end].iter_mut().for_each(|value| *value -= change);
            }
        }
    }

    #[test]
    fn noise_and_gaps_are_no_contact() {
        let noisy = |k: u32| 2.0 + 0.03 * f64::from(k * 7919 % 1009) / 1009.0;
        let mut signal: Vec<f64> = (0..400).map(noisy).collect();
        signal[100] = f64::NAN;
        assert!(!glitches(&signal, 4.0).contains(&true));
        assert!(glitches(&[], 4.0).is_empty() && !glitches(&[1.0; 9], 1.0).contains(&true));
    }
}
