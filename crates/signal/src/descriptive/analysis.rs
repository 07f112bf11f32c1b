//! Descriptive statistics of windows of any signal.
//!
//! There are no events. Causal and whole analysis agree, as nothing is filtered.

use super::summary::{Summary, describe};
use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Whole, Windows,
};
use crate::coverage::coverage;
use crate::error::{SignalError, checked, checked_rate_hz};
use crate::gaps::is_usable;

/// The largest number of channels.
const MOST_CHANNELS: usize = 4096;

/// The values of each channel: name, unit (`u` is the signal's) and recipe.
const OF_CHANNEL: [(&str, &str, &str); 9] = [
    ("Mean", "u", "mean of all usable samples"),
    ("SD", "u", "standard deviation over n − 1"),
    ("Median", "u", "median"),
    ("MAD", "u", "median absolute deviation from the median, unscaled"),
    ("Min", "u", "smallest sample"),
    ("Max", "u", "largest sample"),
    ("Slope", "u/s", "rise of the least-squares line through all usable samples"),
    ("N", "1", "number of usable samples"),
    ("Missing", "%", "100 · (1 − usable samples / samples expected at the rate)"),
];

/// Settings of the analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The channels in order, 1 to 4096. Further channels of a sample are ignored.
    pub channels: Vec<Channel>,
}

/// A channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The name of the channel, as in `Mean/x`; empty for just `Mean`.
    pub name: String,
    /// The unit of the channel; `1` for none.
    pub unit: String,
}

impl Default for Channel {
    fn default() -> Channel {
        Channel { name: String::new(), unit: "1".into() }
    }
}

impl Default for Settings {
    /// One channel without a name or unit.
    fn default() -> Settings {
        Settings { channels: vec![Channel::default()] }
    }
}

/// A causal analysis at any rate; 0 for irregular samples, whose coverage is estimated from their [usual
/// interval](coverage).
///
/// No sample allocates in steady state. Returns an error for an invalid rate, or without channels.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Running::new(settings, rate_hz)?))
}

/// An analysis of a whole recording. Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    checked_rate_hz(recording.rate_hz)?;
    let mut running = Running::new(settings, recording.rate_hz)?;
    for (index, track) in running.tracks.iter_mut().enumerate() {
        let nothing = || vec![f64::NAN; recording.len()];
        let samples = recording.channels.get(index).cloned().unwrap_or_else(nothing);
        *track = Track::of(recording, samples);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(running) })
}

struct Running {
    rate_hz: f64,
    values: Vec<Value>,
    tracks: Vec<Track>,
}

impl Running {
    fn new(settings: &Settings, rate_hz: f64) -> Result<Running, SignalError> {
        let count = settings.channels.len();
        checked("number of channels", count as f64, (1.0, MOST_CHANNELS as f64))?;
        let rate_hz = if rate_hz == 0.0 { rate_hz } else { checked_rate_hz(rate_hz)? };
        let of_channel = |channel: &Channel| {
            OF_CHANNEL.map(|(name, unit, recipe)| {
                Value::of_channel(name, &channel.name, unit.replace('u', &channel.unit), recipe)
            })
        };
        let values = settings.channels.iter().flat_map(of_channel).collect();
        Ok(Running { rate_hz, values, tracks: vec![Track::new(rate_hz); count] })
    }

    fn coverage(&self, track: &Track, span: Span) -> f64 {
        if self.rate_hz > 0.0 {
            return track.coverage(span);
        }
        let samples = track.samples_in(span);
        let usable =
            samples.clone().zip(track.iter(samples)).filter(|(_, value)| is_usable(*value));
        let times_ns: Vec<i64> =
            usable.filter_map(|(sample, _)| track.time_ns(sample as f64)).collect();
        coverage(&times_ns, span.begin_ns, span.end_ns)
    }
}

fn of_channel(track: &Track, span: Span, covered: f64) -> [Result<f64, Reason>; 9] {
    let samples = track.samples_in(span);
    let since_secs = |at_ns: i64| at_ns.saturating_sub(span.begin_ns) as f64 / 1e9;
    let secs = |sample: usize| track.time_ns(sample as f64).map_or(f64::NAN, since_secs);
    let secs: Vec<f64> = samples.clone().map(secs).collect();
    let summary = describe(&secs, &track.values(samples));
    let mut values = [Err(Reason::Gap); 9];
    values[7] = Ok(summary.map_or(0.0, |summary| summary.n as f64));
    values[8] = Ok(100.0 * (1.0 - covered));
    if let Some(summary) = summary.filter(|_| covered >= LEAST_COVERAGE) {
        values[..7].copy_from_slice(&statistics(&summary));
    }
    values
}

fn statistics(summary: &Summary) -> [Result<f64, Reason>; 7] {
    let Summary { mean, sd, median, mad, least, greatest, slope_per_sec, .. } = *summary;
    [
        Reason::unless_finite(mean),
        sd.ok_or(Reason::Short),
        Reason::unless_finite(median),
        Reason::unless_finite(mad),
        Ok(least),
        Ok(greatest),
        slope_per_sec.ok_or(Reason::Short),
    ]
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        &self.values
    }

    /// Nothing is known about the signal, so its quality is 1. A missing channel reports its `N` and
    /// `Missing` as long as another is present.
    fn measure(&self, span: Span) -> Measured {
        let coverages: Vec<f64> =
            self.tracks.iter().map(|track| self.coverage(track, span)).collect();
        let coverage = coverages.iter().copied().fold(0.0, f64::max);
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, 1.0, self.values.len(), Reason::Gap);
        }
        let channels = self.tracks.iter().zip(coverages);
        let values = channels.flat_map(|(track, covered)| of_channel(track, span, covered));
        Measured { coverage, quality: 1.0, values: values.collect() }
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        for (index, track) in self.tracks.iter_mut().enumerate() {
            track.push(at_ns, channels.get(index).copied().unwrap_or(f64::NAN));
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.tracks.iter_mut().for_each(|track| track.forget(before_ns));
    }
}
