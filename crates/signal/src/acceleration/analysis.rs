//! The values of windows of acceleration.
//!
//! There are no events. Quality is the share of samples without a [fault](super::Fault).

use super::activity::{Counts, counts_of};
use super::faults::{Fault, Faults};
use super::magnitude::{enmo_g, magnitude, mean_amplitude_deviation_g};
use super::motion::Motion;
use super::tilt::tilt_deg;
use super::unit::{Unit, checked_rate};
use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Whole, Windows,
};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// The smallest share of fault-free samples for which motion is reported.
const LEAST_QUALITY: f64 = 0.5;
/// A window whose mean motion is less than this is at rest, where gravity is known to be 1 g [g].
const REST_G: f64 = 0.03;
/// The error of gain or offset at rest from which ENMO is not reported, as it would mostly be that error [g].
const MOST_OFF_G: f64 = 0.03;
/// The epoch of the mean amplitude deviation [s].
const EPOCH_SECS: f64 = 5.0;
/// The number of motion values; the shares of faults follow them.
const OF_MOTION: usize = 8;

const VM: &str = "mean of √(x² + y² + z²)";
const VM_SD: &str = "standard deviation over n − 1 of √(x² + y² + z²)";
const ENMO: &str = "mean of max(√(x² + y² + z²) − 1 g, 0) (van Hees 2013), unless at rest the norm is more than 0.03 g off";
const MAD: &str =
    "mean absolute deviation of √(x² + y² + z²) from its mean in epochs of 5 s (Vähä-Ypyä 2015)";
const TILT: &str = "angle between the z axis and the mean acceleration, if that is 0.8 to 1.2 g";
const SATURATED: &str = "share of samples with an axis at the end of its range, above 1.9 g, for three samples or more, or above 1.3 g for 0.1 s";
const FLAT: &str = "share of samples that had been the same for more than 10 s";
const IMPLAUSIBLE: &str = "share of samples at rest without 0.8 to 1.2 g of gravity, in motion without 0.3 g of it, or of more than 20 g";

/// Settings of the analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The unit of the three channels x, y and z.
    pub unit: Unit,
    /// The level of [motion](Motion) within a second above which co-located signals are marked as artefacts
    /// [g].
    pub artefact_g: f64,
}

impl Default for Settings {
    /// Unit g and a motion limit of 0.1 g, a convention: typing stays below it, gestures and steps exceed it.
    fn default() -> Settings {
        Settings { unit: Unit::G, artefact_g: 0.1 }
    }
}

/// A causal analysis of three axes at 8 Hz to 10 kHz.
///
/// Activity is delayed by about a quarter of a second and motion covers the preceding second; windows
/// compensate for neither. No sample allocates in steady state. Returns an error for another rate or invalid
/// settings.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Running::new(settings, rate_hz, "causal", "in the second before")?))
}

/// An analysis of a whole recording: activity without delay, motion over the second centred on each sample.
/// Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut running =
        Running::new(settings, recording.rate_hz, "zero phase", "in the second around")?;
    let nothing = vec![f64::NAN; recording.len()];
    let axis = |index: usize| recording.channels.get(index).unwrap_or(&nothing);
    let axes = [0, 1, 2].map(|index| &axis(index)[..recording.len()]);
    for sample in 0..recording.len() {
        running.push(recording.time_ns(sample as f64), &axes.map(|axis| axis[sample]));
    }
    let counts = counts_of(axes, recording.rate_hz).unwrap_or(nothing);
    let one_g = settings.unit.one_g();
    let counts_g = counts.into_iter().map(|count| count / one_g).collect();
    running.counts = Track::of(recording, counts_g);
    let half = Motion::length(recording.rate_hz) / 2;
    let levels = running.levels.values(running.levels.held());
    let last = levels.last().copied().unwrap_or(f64::NAN);
    let later = levels.iter().copied().skip(half).chain(std::iter::repeat_n(last, half));
    running.levels = Track::of(recording, later.take(levels.len()).collect());
    Ok(Whole { events: Vec::new(), windows: Box::new(running) })
}

struct Running {
    settings: Settings,
    values: Vec<Value>,
    motion: Motion,
    counter: Counts,
    judge: Faults,
    /// The axes [g]; NaN unless all three are present.
    axes: [Track; 3],
    counts: Track,
    levels: Track,
    /// 0 for no fault, otherwise the fault's index counted from 1.
    faults: Track,
}

impl Running {
    fn new(
        settings: &Settings,
        rate_hz: f64,
        filter: &str,
        second: &str,
    ) -> Result<Running, SignalError> {
        let rate_hz = checked_rate(rate_hz)?;
        settings.unit.checked()?;
        let track = || Track::new(rate_hz);
        Ok(Running {
            settings: *settings,
            values: values(settings, filter, second),
            motion: Motion::new(rate_hz, settings.artefact_g)?,
            counter: Counts::new(rate_hz)?,
            judge: Faults::new(rate_hz)?,
            axes: [track(), track(), track()],
            counts: track(),
            levels: track(),
            faults: track(),
        })
    }

    fn of_motion(&self, span: Span) -> [Result<f64, Reason>; OF_MOTION] {
        let [x, y, z] = &self.axes;
        let samples = x.samples_in(span);
        let axes = x.iter(samples.clone()).zip(y.iter(samples.clone())).zip(z.iter(samples));
        let magnitudes: Vec<f64> = axes.map(|((x, y), z)| magnitude([x, y, z])).collect();
        let known = || magnitudes.iter().copied().filter(|&each| is_usable(each));
        let mean = mean(known());
        let count = known().count() as f64;
        let deviations = mean.map(|mean| known().map(|each| (each - mean).powi(2)).sum::<f64>());
        let sd = deviations.map(|sum| (sum / (count - 1.0)).sqrt());
        let of_axis = |track: &Track| self::mean(usable(track, span)).unwrap_or(f64::NAN);
        let counts = self::mean(usable(&self.counts, span)).map(|mean| 60.0 * mean);
        let limit_g = self.settings.artefact_g;
        let moved = |level_g: f64| f64::from(u8::from(level_g > limit_g));
        let level_g = self::mean(usable(&self.levels, span));
        let is_at_rest = level_g.is_some_and(|level_g| level_g < REST_G);
        let is_off = is_at_rest && mean.is_some_and(|mean| (mean - 1.0).abs() > MOST_OFF_G);
        [
            reported(mean),
            sd.filter(|_| count > 1.0).ok_or(Reason::Short).and_then(Reason::unless_finite),
            if is_off { Err(Reason::Quality) } else { reported(enmo_g(&magnitudes)) },
            reported(self.mad_g(&magnitudes)),
            reported(counts),
            tilt_deg([of_axis(x), of_axis(y), of_axis(z)]).ok_or(Reason::Undefined),
            reported(level_g),
            reported(self::mean(usable(&self.levels, span).map(moved))),
        ]
    }

    /// The mean of the mean amplitude deviation over epochs, weighted by their numbers of samples.
    fn mad_g(&self, magnitudes: &[f64]) -> Option<f64> {
        let epoch = ((EPOCH_SECS * self.counts.rate_hz()).round() as usize).max(1);
        let (mut sum, mut count) = (0.0, 0.0);
        for epoch in magnitudes.chunks(epoch) {
            if let Some(deviation) = mean_amplitude_deviation_g(epoch) {
                let weight = epoch.len() as f64;
                (sum, count) = (sum + weight * deviation, count + weight);
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    fn shares_of_faults(&self, span: Span) -> [f64; 3] {
        let (mut shares, mut count) = ([0.0; 3], 0.0f64);
        for fault in usable(&self.faults, span) {
            count += 1.0;
            if let Some(share) = (fault as usize).checked_sub(1).and_then(|k| shares.get_mut(k)) {
                *share += 1.0;
            }
        }
        shares.map(|share| share / count.max(1.0))
    }
}

fn values(settings: &Settings, filter: &str, second: &str) -> Vec<Value> {
    let value = |name, unit, recipe: &str| Value::of_channel(name, "", unit, recipe.to_owned());
    let counts = format!(
        "60 s · mean of √(x² + y² + z²) after 0.25–2.5 Hz (Butterworth 2, {filter}) of each axis"
    );
    let motion = format!("mean of √(σx² + σy² + σz²) {second} each sample");
    let artefact = format!(
        "share of samples with √(σx² + σy² + σz²) above {} g {second} them",
        settings.artefact_g
    );
    vec![
        value("ACC_VM_Mean", "g", VM),
        value("ACC_VM_SD", "g", VM_SD),
        value("ACC_ENMO", "g", ENMO),
        value("ACC_MAD", "g", MAD),
        value("ACC_Counts", "g·s/min", &counts),
        value("ACC_Tilt", "°", TILT),
        value("ACC_Motion", "g", &motion),
        value("ACC_Artefact", "1", &artefact),
        value("ACC_Saturated", "1", SATURATED),
        value("ACC_Flat", "1", FLAT),
        value("ACC_Implausible", "1", IMPLAUSIBLE),
    ]
}

fn usable(track: &Track, span: Span) -> impl Iterator<Item = f64> + '_ {
    track.iter(track.samples_in(span)).filter(|&value| is_usable(value))
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

fn reported(value: Option<f64>) -> Result<f64, Reason> {
    value.ok_or(Reason::Short).and_then(Reason::unless_finite)
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        let coverage = self.axes[0].coverage(span);
        let shares = self.shares_of_faults(span);
        let is_there = usable(&self.faults, span).next().is_some();
        let good = (1.0 - shares.iter().sum::<f64>()).clamp(0.0, 1.0);
        let quality = if is_there { good } else { 0.0 };
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, quality, self.values.len(), Reason::Gap);
        }
        let poor = [Err(Reason::Quality); OF_MOTION];
        let of_motion = if quality < LEAST_QUALITY { poor } else { self.of_motion(span) };
        let values = of_motion.into_iter().chain(shares.map(Ok)).collect();
        Measured { coverage, quality, values }
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let axis = |index: usize| channels.get(index).copied().unwrap_or(f64::NAN);
        let axes_g = self.settings.unit.in_g([axis(0), axis(1), axis(2)]);
        let is_whole = !magnitude(axes_g).is_nan();
        let axes_g = if is_whole { axes_g } else { [f64::NAN; 3] };
        let moved = self.motion.push(axes_g);
        let fault = match self.judge.push(axes_g, moved) {
            None => 0.0,
            Some(Fault::Saturated) => 1.0,
            Some(Fault::Flat) => 2.0,
            Some(Fault::Implausible) => 3.0,
        };
        self.axes.iter_mut().zip(axes_g).for_each(|(track, axis)| track.push(at_ns, axis));
        self.counts.push(at_ns, self.counter.push(axes_g));
        self.levels.push(at_ns, if is_whole { moved.level_g } else { f64::NAN });
        self.faults.push(at_ns, if is_whole { fault } else { f64::NAN });
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        let others = [&mut self.counts, &mut self.levels, &mut self.faults];
        self.axes.iter_mut().chain(others).for_each(|track| track.forget(before_ns));
    }
}
