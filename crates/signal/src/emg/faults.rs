//! Faults of a channel, and its quality.

use std::f64::consts::TAU;

use super::band::RATES_HZ;
use crate::error::{SignalError, checked, checked_rate_hz};
use crate::gaps::is_usable;

/// A signal constant for longer is flat: an electrode or a cable is off [s].
const FLAT_SECS: f64 = 0.2;
/// The shortest run of equal samples at an end of the range that is clipping.
const CLIPPED_RUN: usize = 3;
/// The smallest range, in steps, that can have ends.
const LEAST_STEPS: f64 = 20.0;
/// The mains frequencies [Hz].
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// The averaging time of the mains amplitude [s]: 1 s separates it from muscle activity, which has a
/// hundredth of its power in that bandwidth.
const MAINS_SECS: f64 = 1.0;
/// The time constant of the baseline [s].
const LEVEL_SECS: f64 = 0.5;
/// A muscle has at most this share of the power of frames in one instant or frequency. Simulated ones have 0.16 in
/// their strongest frequency where the median is 120 Hz, and 0.49 where it is 25 Hz, at 200 to 2000 Hz.
const MOST_CONCENTRATED: f64 = 0.5;

/// The faults in a run of samples of one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// The number of usable samples.
    pub usable: f64,
    /// The number of flat samples: constant for more than 0.2 s.
    pub flat: f64,
    /// The number of clipped samples: the third and later equal ones in a row at an end of the range so far,
    /// if that spans at least twenty of its smallest steps.
    pub clipped: f64,
    /// Sum of squares of the mains hum at 50 or 60 Hz, whichever is louder [unit²].
    pub mains: f64,
    /// Sum of squares of the band-passed signal [unit²].
    pub band: f64,
    /// Sum of squares of the raw signal without its baseline (time constant 0.5 s) [unit²].
    pub all: f64,
    /// Sum of squares of frames [unit²].
    pub framed: f64,
    /// The part of `framed` that is concentrated: in the strongest frequency of each frame, with or without harmonics,
    /// or in one instant [unit²].
    pub concentrated: f64,
}

impl Faults {
    /// Counts a frame with this sum of squares, of which `share` is concentrated.
    pub(super) fn frame(&mut self, squares: f64, share: f64) {
        if squares.is_finite() && share.is_finite() {
            self.framed += squares;
            self.concentrated += share * squares;
        }
    }

    /// The sum of these and other faults.
    #[must_use]
    pub fn with(self, other: &Faults) -> Faults {
        Faults {
            usable: self.usable + other.usable,
            flat: self.flat + other.flat,
            clipped: self.clipped + other.clipped,
            mains: self.mains + other.mains,
            band: self.band + other.band,
            all: self.all + other.all,
            framed: self.framed + other.framed,
            concentrated: self.concentrated + other.concentrated,
        }
    }

    /// Scales all counts and sums by a share.
    #[must_use]
    pub(super) fn scaled(self, share: f64) -> Faults {
        Faults {
            usable: share * self.usable,
            flat: share * self.flat,
            clipped: share * self.clipped,
            mains: share * self.mains,
            band: share * self.band,
            all: share * self.all,
            framed: share * self.framed,
            concentrated: share * self.concentrated,
        }
    }

    /// The share of flat samples [0..1].
    pub fn flat_share(&self) -> f64 {
        share(self.flat, self.usable)
    }

    /// The share of clipped samples [0..1].
    pub fn clipped_share(&self) -> f64 {
        share(self.clipped, self.usable)
    }

    /// The share of mains hum in the band's power [0..1].
    pub fn mains_share(&self) -> f64 {
        share(self.mains, self.band)
    }

    /// How much of the power is that of tones or clicks [0..1]: 0 if frames have up to half of their power in one
    /// frequency and its harmonics, or in one instant, and 1 if they have all of it there. Causes are mains hum off its
    /// nominal frequency, its harmonics, a telephone's buzz, a motor, or single wrong samples.
    pub fn concentrated_share(&self) -> f64 {
        let part = share(self.concentrated, self.framed);
        ((part - MOST_CONCENTRATED) / (1.0 - MOST_CONCENTRATED)).max(0.0)
    }

    /// The share of power outside the EMG band [0..1]: movement of electrodes and cables, bad contact.
    pub fn outside_share(&self) -> f64 {
        if self.all > 0.0 { (1.0 - self.band / self.all).clamp(0.0, 1.0) } else { 0.0 }
    }
}

fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { (part / whole).clamp(0.0, 1.0) } else { 0.0 }
}

/// Signal quality from 0 (useless) to 1: the share of samples that are neither flat nor clipped, times √((1 −
/// share of mains, or of tones and clicks, whichever is larger) · (1 − share outside the band)).
///
/// Sinderby et al. (1995), doi:10.1152/jappl.1995.79.5.1803, use the same power ratios. It is independent of
/// the level of activity, and blind to crosstalk. 0 without a usable sample.
pub fn quality(faults: &Faults) -> f64 {
    if faults.usable <= 0.0 {
        return 0.0;
    }
    let living = (1.0 - faults.flat_share() - faults.clipped_share()).max(0.0);
    let hum = faults.mains_share().max(faults.concentrated_share());
    living * ((1.0 - hum) * (1.0 - faults.outside_share())).sqrt()
}

/// Detects the faults of one channel.
#[derive(Clone, Debug)]
pub(super) struct FaultDetector {
    flat_run: usize,
    decay: f64,
    level: Option<f64>,
    last: f64,
    run: usize,
    least: f64,
    greatest: f64,
    step: f64,
    line_decay: f64,
    lines: [[f64; 2]; 2],
}

impl FaultDetector {
    pub(super) fn new(rate_hz: f64) -> Result<FaultDetector, SignalError> {
        let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        Ok(FaultDetector {
            flat_run: (FLAT_SECS * rate_hz) as usize,
            decay: 1.0 / (LEVEL_SECS * rate_hz),
            level: None,
            last: f64::NAN,
            run: 0,
            least: f64::INFINITY,
            greatest: f64::NEG_INFINITY,
            step: f64::INFINITY,
            line_decay: 1.0 / (MAINS_SECS * rate_hz),
            lines: [[0.0; 2]; 2],
        })
    }

    /// Adds a sample, raw and band-passed, at a [phase of the mains](Phases).
    pub(super) fn push(&mut self, raw: f64, band: f64, phases: &Phases, faults: &mut Faults) {
        let line = self.line(band, phases);
        if !is_usable(raw) {
            self.run = 0;
            return;
        }
        faults.usable += 1.0;
        faults.band += band * band;
        faults.mains += line;
        let level = self.level.get_or_insert(raw);
        *level += self.decay * (raw - *level);
        faults.all += (raw - *level).powi(2);
        self.see_run(raw);
        if self.run > self.flat_run {
            faults.flat += 1.0;
        } else if self.run >= CLIPPED_RUN && self.is_at_an_end(raw) {
            faults.clipped += 1.0;
        }
    }

    fn see_run(&mut self, raw: f64) {
        let step = (raw - self.last).abs();
        self.run = if step > 0.0 || step.is_nan() { 1 } else { self.run + 1 };
        if step > 0.0 {
            self.step = self.step.min(step);
        }
        self.last = raw;
        self.least = self.least.min(raw);
        self.greatest = self.greatest.max(raw);
    }

    fn is_at_an_end(&self, raw: f64) -> bool {
        let has_ends = self.greatest - self.least >= LEAST_STEPS * self.step;
        has_ends && (raw <= self.least || raw >= self.greatest)
    }

    /// The power of the louder line.
    fn line(&mut self, band: f64, phases: &Phases) -> f64 {
        let mut loudest = 0.0f64;
        for (line, phase) in self.lines.iter_mut().zip(&phases.now) {
            for (part, phase) in line.iter_mut().zip(phase) {
                *part += self.line_decay * (band * phase - *part);
            }
            loudest = loudest.max(2.0 * (line[0] * line[0] + line[1] * line[1]));
        }
        loudest
    }
}

/// The phases of the mains frequencies, shared by all channels.
#[derive(Clone, Debug)]
pub(super) struct Phases {
    /// The current cosine and sine of each frequency, and its rotation per sample.
    now: [[f64; 2]; 2],
    steps: [[f64; 2]; 2],
    /// The number of samples until the phasors are renormalised.
    until_sound: u32,
}

/// After this many rotations the length is off by 1e-13 at most.
const SOUND_FOR: u32 = 256;

impl Phases {
    pub(super) fn new(rate_hz: f64) -> Phases {
        // A frequency above Nyquist cannot be measured: its phasor does not rotate.
        let step = |at_hz: f64| {
            let (sine, cosine) = (TAU * at_hz / rate_hz).sin_cos();
            if at_hz < 0.45 * rate_hz { [cosine, sine] } else { [0.0; 2] }
        };
        let steps = MAINS_HZ.map(step);
        Phases {
            now: steps.map(|step| [step[0].hypot(step[1]), 0.0]),
            steps,
            until_sound: SOUND_FOR,
        }
    }

    /// Advances by a sample.
    pub(super) fn advance(&mut self) {
        self.until_sound -= 1;
        let is_due = self.until_sound == 0;
        for (now, step) in self.now.iter_mut().zip(self.steps) {
            let [cosine, sine] = *now;
            *now = [cosine * step[0] - sine * step[1], cosine * step[1] + sine * step[0]];
            let length = if is_due { now[0].hypot(now[1]) } else { 0.0 };
            if length > 0.0 {
                *now = now.map(|part| part / length);
            }
        }
        if is_due {
            self.until_sound = SOUND_FOR;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 500.0;

    fn watched(signal: impl Iterator<Item = (f64, f64)>) -> Faults {
        let (mut watch, mut phases) = (FaultDetector::new(RATE_HZ).unwrap(), Phases::new(RATE_HZ));
        let mut faults = Faults::default();
        for (raw, band) in signal {
            phases.advance();
            watch.push(raw, band, &phases, &mut faults);
        }
        faults
    }

    fn noise(k: u32) -> f64 {
        f64::from((k * k % 977) * 31 % 1009) / 1009.0 - 0.5
    }

    fn twice(value: f64) -> (f64, f64) {
        (value, value)
    }

    #[test]
    fn a_muscle_is_good() {
        let faults = watched((0..5000).map(|k| twice(noise(k))));
        assert!(quality(&faults) > 0.9, "{faults:?}");
    }

    #[test]
    fn a_flat_line_is_worth_nothing() {
        assert!(quality(&watched((0..5000).map(|_| twice(3.0)))) < 0.03);
        assert_eq!(quality(&watched((0..5000).map(|_| twice(f64::NAN)))), 0.0);
        assert_eq!(quality(&Faults::default()), 0.0);
    }

    #[test]
    fn the_share_of_the_power_line_is_reported() {
        for at_hz in MAINS_HZ {
            let line = |k: u32| (TAU * at_hz * f64::from(k) / RATE_HZ).sin();
            // The power of uniform noise between −½ and ½.
            let both = |k: u32| twice(noise(k) + line(k) / 6f64.sqrt());
            let share = watched((0..20_000).map(both)).mains_share();
            assert!((share - 0.5).abs() < 0.05, "{share}");
            assert!(watched((0..20_000).map(|k| twice(line(k)))).mains_share() > 0.9);
        }
    }

    #[test]
    fn what_is_cut_off_is_reported() {
        let clipped =
            |k: u32| twice((20.0 * (f64::from(k) / 20.0).sin()).round().clamp(-15.0, 15.0));
        let share = watched((0..5000).map(clipped)).clipped_share();
        assert!((0.3..0.5).contains(&share), "{share}");
        let whole = |k: u32| twice((20.0 * (f64::from(k) * 0.7).sin()).round());
        assert_eq!(watched((0..5000).map(whole)).clipped_share(), 0.0);
        let coarse = |k: u32| twice((1.4 * noise(k)).round());
        assert_eq!(watched((0..5000).map(coarse)).clipped_share(), 0.0);
    }

    #[test]
    fn motion_lowers_quality() {
        let moved = |k: u32| (noise(k) + 3.0 * (f64::from(k) / 50.0).sin(), noise(k));
        let faults = watched((0..5000).map(moved));
        assert!(faults.outside_share() > 0.9 && quality(&faults) < 0.3, "{faults:?}");
    }
}
