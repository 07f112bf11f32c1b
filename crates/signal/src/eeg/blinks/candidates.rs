//! Candidate blinks: peaks above the signal both before and after.

use std::collections::VecDeque;

/// The distance of the reference points before and after a blink [s].
const REACH_SECS: f64 = 0.4;
/// The shortest time between the peaks of two blinks [s].
const APART_SECS: f64 = 0.1;
/// The smallest ratio of the lower to the higher side; below it the peak is a filtered step.
const LEAST_BALANCE: f64 = 0.25;
/// The plausible width at half height [s]: longer ones are sleep or eye movements.
const LEAST_SECS: f64 = 0.05;
const MOST_SECS: f64 = 0.5;

/// A candidate blink.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// The peak [samples at the working rate].
    pub(super) place: f64,
    /// The height of the peak, negative for a downward deflection [µV].
    pub(super) height_uv: f64,
    pub(super) duration_secs: f64,
}

/// Detects candidates in a low-passed signal, each as soon as the signal after it is known.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    rate_hz: f64,
    reach: usize,
    apart: usize,
    window: VecDeque<f64>,
    count: usize,
}

impl Candidates {
    pub(super) fn new(rate_hz: f64) -> Candidates {
        let reach = (REACH_SECS * rate_hz).round() as usize;
        let apart = (APART_SECS * rate_hz).round() as usize;
        let window = VecDeque::with_capacity(2 * reach + 2);
        Candidates { rate_hz, reach, apart, window, count: 0 }
    }

    /// The delay of a candidate after its peak [samples].
    pub(super) fn reach(&self) -> usize {
        self.reach
    }

    /// Takes in the next sample at the working rate.
    pub(super) fn push(&mut self, value: f64) -> Option<Candidate> {
        self.window.push_back(value);
        self.count += 1;
        if self.window.len() <= 2 * self.reach {
            return None;
        }
        let candidate = self.middle(1.0).or_else(|| self.middle(-1.0));
        self.window.pop_front();
        candidate
    }

    /// The candidate at the centre of the window, if any; `sign` selects the direction.
    fn middle(&self, sign: f64) -> Option<Candidate> {
        let middle = self.reach;
        let at = |index: usize| sign * self.window[index];
        let peak = at(middle);
        let (earlier, later) = (middle - self.apart..middle, middle + 1..=middle + self.apart);
        let is_peak = earlier.rev().all(|index| at(index) < peak);
        if !is_peak || later.rev().any(|index| at(index) > peak) {
            return None;
        }
        let least = |range: std::ops::RangeInclusive<usize>| range.map(at).fold(peak, f64::min);
        let (before, after) = (peak - least(0..=middle), peak - least(middle..=2 * middle));
        let height_uv = before.min(after);
        let level = peak - height_uv / 2.0;
        let begin = (0..middle).rev().find(|&index| at(index) <= level)?;
        let end = (middle + 1..=2 * middle).find(|&index| at(index) <= level)?;
        let begin = end_of_step(begin as f64, at(begin), at(begin + 1), level);
        let end = end as f64 - (end_of_step(0.0, at(end), at(end - 1), level));
        let duration_secs = (end - begin) / self.rate_hz;
        let is_balanced = height_uv >= LEAST_BALANCE * before.max(after);
        let is_lid =
            is_balanced && height_uv > 0.0 && (LEAST_SECS..=MOST_SECS).contains(&duration_secs);
        let offset = vertex(at(middle - 1), peak, at(middle + 1));
        let place = (self.count - 1 - self.reach) as f64 + offset;
        is_lid.then_some(Candidate { place, height_uv: sign * height_uv, duration_secs })
    }
}

/// The fractional position at which a step from a sample crosses a level.
fn end_of_step(place: f64, from: f64, to: f64, level: f64) -> f64 {
    let part = (level - from) / (to - from);
    place + if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 }
}

/// The vertex of the parabola through three samples, relative to the central one.
fn vertex(before: f64, peak: f64, after: f64) -> f64 {
    let offset = 0.5 * (before - after) / (before - 2.0 * peak + after);
    if offset.is_finite() { offset.clamp(-0.5, 0.5) } else { 0.0 }
}
