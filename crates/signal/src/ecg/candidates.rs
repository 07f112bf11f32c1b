//! Candidate beats: the maxima of the QRS envelope.

use std::collections::VecDeque;

use super::flutter::SlowWaves;
use super::history::History;
use super::intake::Intake;
use super::kernel::{Kernel, energy, sigma_secs};
use super::moving_sum::MovingSum;
use super::peak::{Deflection, PeakFinder};
use super::shape::Shape;
use crate::error::{SignalError, checked, checked_rate_hz};

/// The rates that resolve QRS complexes without needless cost [Hz].
const RATES_HZ: (f64, f64) = (80.0, 4000.0);
/// Where QRS complexes stand out most from P and T waves, motion and muscles [Hz].
const QRS_HZ: f64 = 17.0;
/// The half-width of the envelope's kernels [standard deviations of the Gaussian].
const REACH_SIGMAS: f64 = 2.5;
/// The duration of a broad QRS complex, over which the envelope is smoothed [s].
const QRS_SECS: f64 = 0.12;
/// The time before a beat that must be partly quiet [s], and the share of it that must be.
pub(super) const QUIET_SECS: f64 = 0.9;
const QUIET_SHARE: f64 = 0.25;
/// The stride of the envelope values used to estimate the quiet level.
const QUIET_STEP: usize = 4;

/// A candidate beat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Time of the maximum of the envelope [s].
    pub(super) secs: f64,
    /// Height of the envelope.
    pub(super) strength: f64,
    /// The lower quartile of the envelope in the time before it, as a share of its strength.
    pub(super) restlessness: f64,
    pub(super) deflection: Deflection,
    /// The waveform around the deflection.
    pub(super) shape: Shape,
    /// The candidate's energy at the [frequency of flutter](super::flutter), as a multiple of its strength squared.
    pub(super) breadth: f64,
    /// The lower quartile of the envelope at that frequency in the time before it, as a share of its strength.
    pub(super) swell: f64,
    /// Whether a higher candidate is so near that the causal detector does not consider this one.
    pub(super) hidden: bool,
    /// Whether a long gap separates the candidate from the previous one.
    pub(super) after_gap: bool,
}

#[cfg(test)]
impl Candidate {
    /// A candidate without a shape, in a silent signal.
    pub(super) fn at(secs: f64, strength: f64) -> Candidate {
        let deflection = Deflection { sample: secs, upright: true };
        Candidate {
            secs,
            strength,
            restlessness: 0.0,
            deflection,
            shape: Shape::NONE,
            breadth: 0.0,
            swell: 0.0,
            hidden: false,
            after_gap: false,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Candidates {
    rate_hz: f64,
    /// How long a maximum must remain the highest [samples at the working rate]; all counts below are in the
    /// same unit.
    spacing: i64,
    /// How long after its maximum a candidate is described.
    wait: i64,
    intake: Intake,
    raw: History,
    working: History,
    sum: MovingSum,
    /// The squared envelope times `smooth`: the same order as the envelope, at a lower cost.
    energy: History,
    even: Kernel,
    odd: Kernel,
    /// The delay of the envelope [samples at the working rate].
    lag: i64,
    smooth: usize,
    quiet: i64,
    quiet_values: Vec<f64>,
    slow_waves: SlowWaves,
    top: Option<(i64, f64)>,
    /// The maxima that wait to be described.
    waiting: VecDeque<(i64, f64)>,
    before: f64,
    peaks: PeakFinder,
    resumed: Option<i64>,
}

impl Candidates {
    /// A maximum becomes a candidate if it remains the highest until `latency_secs` after it, the delay of the envelope
    /// included.
    ///
    /// Returns an error when the rate is not between 80 and 4000 Hz.
    pub(super) fn new(rate_hz: f64, latency_secs: f64) -> Result<Candidates, SignalError> {
        Candidates::with_spacing(rate_hz, latency_secs, f64::INFINITY)
    }

    /// Like [`new`](Self::new), but a maximum must remain the highest only for `spacing_secs`, if that is shorter.
    pub(super) fn with_spacing(
        rate_hz: f64,
        latency_secs: f64,
        spacing_secs: f64,
    ) -> Result<Candidates, SignalError> {
        let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        let intake = Intake::new(rate_hz);
        let working_hz = rate_hz / intake.group() as f64;
        let places = |secs: f64| (secs * working_hz).round() as usize;
        let half = (REACH_SIGMAS * sigma_secs(3, QRS_HZ) * working_hz).ceil() as usize;
        let smooth = 2 * places(QRS_SECS / 2.0) + 1;
        let quiet = places(QUIET_SECS);
        let lag = half + smooth / 2;
        let wait = ((latency_secs * working_hz) as usize).saturating_sub(lag);
        // Refining a peak needs less than a second of signal.
        let second = places(1.0);
        let spacing = (spacing_secs * working_hz).min(wait as f64) as i64;
        Ok(Candidates {
            rate_hz,
            spacing,
            wait: wait as i64,
            raw: History::new(second * intake.group()),
            working: History::new(second),
            sum: MovingSum::new(smooth),
            energy: History::new(quiet + wait + 1),
            even: Kernel::even(QRS_HZ, half, working_hz),
            odd: Kernel::odd(QRS_HZ, half, working_hz),
            lag: lag as i64,
            smooth,
            quiet: quiet as i64,
            quiet_values: Vec::with_capacity((quiet + wait) / QUIET_STEP + 1),
            slow_waves: SlowWaves::new(working_hz, QUIET_SECS),
            top: None,
            waiting: VecDeque::with_capacity(wait + 1),
            before: 0.0,
            peaks: PeakFinder::new(working_hz, intake.group()),
            resumed: None,
            intake,
        })
    }

    /// The largest delay of a candidate after its maximum [samples].
    pub(super) fn latency(&self) -> usize {
        (self.lag + self.wait + 1) as usize * self.intake.group()
    }

    pub(super) fn push(&mut self, sample: f64) -> Option<Candidate> {
        let taken = self.intake.push(sample);
        self.raw.push(taken.sample);
        if taken.resumed {
            self.resumed = Some(self.working.count);
        }
        let place = self.energy.count;
        let energy = self.energy_with(taken.mean?);
        if energy > self.before && self.top.is_none_or(|(_, top)| energy > top) {
            self.top = Some((place, energy));
        }
        self.before = energy;
        let highest = self.top.take_if(|(top, _)| place - *top >= self.spacing);
        self.waiting.extend(highest);
        let due = self.waiting.front().filter(|(top, _)| place - top >= self.wait);
        let (top, energy) = due.copied()?;
        self.waiting.pop_front();
        Some(self.candidate(top, self.height(energy)))
    }

    fn energy_with(&mut self, sample: f64) -> f64 {
        self.working.push(sample);
        self.slow_waves.push(&self.working);
        let samples = self.working.newest(self.even.length());
        let energy = self.sum.push(energy(&self.even, &self.odd, samples));
        self.energy.push(energy);
        energy
    }

    /// The height of the envelope.
    fn height(&self, energy: f64) -> f64 {
        (energy / self.smooth as f64).sqrt()
    }

    fn candidate(&mut self, top: i64, strength: f64) -> Candidate {
        let place = (top - self.lag).max(0);
        let secs = self.peaks.raw_place(place) / self.rate_hz;
        let restlessness = self.quiet_height(top) / strength;
        let deflection = self.peaks.find(place, strength, &self.working, &self.raw);
        let after_gap = self.resumed.take_if(|resumed| *resumed <= place).is_some();
        let group = self.intake.group() as f64;
        let middle = (deflection.sample - (group - 1.0) / 2.0) / group;
        let shape = Shape::around(middle, &self.working, self.rate_hz / group);
        let breadth = self.slow_waves.energy_around(place, &self.working) / (strength * strength);
        let swell = self.slow_waves.quiet_height() / strength;
        Candidate {
            secs,
            strength,
            restlessness,
            deflection,
            shape,
            breadth,
            swell,
            hidden: false,
            after_gap,
        }
    }

    /// The lower quartile of the envelope around a maximum.
    fn quiet_height(&mut self, top: i64) -> f64 {
        let around = self.energy.at(top - self.quiet..top + self.wait + 1);
        self.quiet_values.clear();
        self.quiet_values.extend(around.iter().step_by(QUIET_STEP));
        let index = (self.quiet_values.len() as f64 * QUIET_SHARE) as usize;
        let energy = *self.quiet_values.select_nth_unstable_by(index, f64::total_cmp).1;
        self.height(energy)
    }
}
