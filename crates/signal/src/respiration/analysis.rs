//! Breaths and breathing patterns of a signal, causal and whole.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::ops::Range;

use super::causal::BreathDetector;
use super::grouping::Grouping;
use super::pulsation::Pulsation;
use super::spectral::Spectral;
use super::{Breath, Pattern, Variability, band, quality, variability, whole};
use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Whole, Windows,
};
use crate::error::SignalError;
use crate::spectrum::Transforms;

/// The smallest quality for which values are reported.
pub const LEAST_QUALITY: f64 = 0.3;
/// The longest breath that may extend into a window [s].
const KEPT_SECS: f64 = 30.0;

/// Settings of the breathing analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The unit of amplitudes; `1` if they are arbitrary.
    pub unit: String,
    /// The signal's direction during inhalation.
    pub inhalation: Inhalation,
}

/// The direction of the signal during inhalation.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Inhalation {
    /// The signal rises, as with belts and impedance.
    Rises,
    /// The signal falls, as with thermistors in the nose, which inhaled air cools.
    Falls,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { unit: "1".into(), inhalation: Inhalation::Rises }
    }
}

/// A causal analysis of the first channel at 5 to 2000 Hz.
///
/// Breaths are those of [`BreathDetector`], known some 2.5 s after their end; a window lacks breaths that are
/// not known yet.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Live {
        sign: settings.sign(),
        first_ns: 0,
        grouping: Grouping::new(rate_hz),
        detector: BreathDetector::new(rate_hz)?,
        known: Known::new(settings, rate_hz, CAUSAL),
        events: VecDeque::new(),
    }))
}

/// An analysis of the first channel of a whole recording at 5 to 2000 Hz, with the breaths of
/// [`find_breaths`](super::find_breaths).
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    band::band(recording.rate_hz)?;
    let grouping = Grouping::new(recording.rate_hz);
    let rate_hz = recording.rate_hz / grouping.length() as f64;
    let signal = recording.channels.first().map_or(&[][..], Vec::as_slice);
    let means: Vec<f64> =
        grouping.clone().all(signal).into_iter().map(|mean| settings.sign() * mean).collect();
    let mut known = Known::new(settings, recording.rate_hz, WHOLE);
    known.breaths = whole::of_means(&means, rate_hz, &grouping)?.into();
    let begin_ns = recording.time_ns(grouping.sample(0.0));
    known.means = Track::of(&Recording { rate_hz, begin_ns, channels: &[] }, means);
    let events = known.breaths.iter().map(|breath| known.event(breath)).collect();
    Ok(Whole { events, windows: Box::new(known) })
}

impl Settings {
    fn sign(&self) -> f64 {
        match self.inhalation {
            Inhalation::Rises => 1.0,
            Inhalation::Falls => -1.0,
        }
    }
}

/// The detection method, for the recipes of values.
const CAUSAL: &str = "turns of a quarter of the range of 30 s, causal 0.05-1 Hz";
const WHOLE: &str = "turns of a quarter of the range of 30 s, zero phase 0.05-1 Hz";

struct Live {
    sign: f64,
    /// When the first sample of the group was measured.
    first_ns: i64,
    grouping: Grouping,
    detector: BreathDetector,
    known: Known,
    events: VecDeque<Event>,
}

impl Causal for Live {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        if self.grouping.is_empty() {
            self.first_ns = at_ns;
        }
        let sample = channels.first().copied().unwrap_or(f64::NAN);
        let Some(mean) = self.grouping.push(self.sign * sample) else { return };
        self.known.means.push(self.first_ns.midpoint(at_ns), mean);
        if let Some(breath) = self.detector.push_mean(mean) {
            self.events.push_back(self.known.event(&breath));
            self.known.breaths.push_back(breath);
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        let before_ns = before_ns.saturating_sub((KEPT_SECS * 1e9) as i64);
        self.known.means.forget(before_ns);
        let held = self.known.means.held().start as f64;
        while self
            .known
            .breaths
            .front()
            .is_some_and(|breath| self.grouping.place(breath.end) < held)
        {
            self.known.breaths.pop_front();
        }
    }
}

impl Windows for Live {
    fn values(&self) -> &[Value] {
        self.known.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.known.measure(span)
    }
}

/// The store of breaths and samples, which can be queried for any span.
struct Known {
    values: Vec<Value>,
    rate_hz: f64,
    grouping: Grouping,
    means: Track,
    breaths: VecDeque<Breath>,
    transforms: Transforms,
}

impl Known {
    fn new(settings: &Settings, rate_hz: f64, how: &str) -> Known {
        let grouping = Grouping::new(rate_hz);
        let means = Track::new(rate_hz / grouping.length() as f64);
        Known {
            values: values(&settings.unit, how),
            rate_hz,
            grouping,
            means,
            breaths: VecDeque::new(),
            transforms: Transforms::default(),
        }
    }

    fn event(&self, breath: &Breath) -> Event {
        let secs = |samples: f64| samples / self.rate_hz;
        Event {
            kind: "breath",
            sample: breath.begin,
            at_ns: self.means.time_ns(self.grouping.place(breath.begin)).unwrap_or(i64::MIN),
            details: vec![
                ("duration_secs", secs(breath.duration())),
                ("inhalation_secs", secs(breath.inhalation())),
                ("exhalation_secs", secs(breath.exhalation())),
                ("amplitude", breath.amplitude),
            ],
        }
    }

    /// The breaths that overlap a range of samples.
    fn breaths_in(&self, samples: &Range<f64>) -> Vec<Breath> {
        let begin = self.breaths.partition_point(|breath| breath.end <= samples.start);
        let end = self.breaths.partition_point(|breath| breath.begin < samples.end);
        self.breaths.range(begin..end.max(begin)).copied().collect()
    }
}

impl Windows for Known {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        let coverage = self.means.coverage(span);
        let places = self.means.samples_in(span);
        let samples = self.grouping.edge(places.start)..self.grouping.edge(places.end);
        let breaths = self.breaths_in(&samples);
        let means = self.means.values(places.clone());
        let spectral = Spectral::of(&means, self.means.rate_hz(), &self.transforms);
        let placed: Vec<Breath> = breaths
            .iter()
            .map(|breath| self.grouping.placed(breath).later(-(places.start as f64)))
            .collect();
        let quality = quality::of_means(&means, self.means.rate_hz(), &placed, spectral.clone());
        let nothing = |reason| Measured::nothing(coverage, quality, self.values.len(), reason);
        if coverage < LEAST_COVERAGE {
            return nothing(Reason::Gap);
        }
        let Some(pattern) = Pattern::of(&breaths, self.rate_hz, samples.clone()) else {
            return nothing(Reason::Short);
        };
        if quality < LEAST_QUALITY {
            return nothing(if pattern.breaths < 2 { Reason::Short } else { Reason::Quality });
        }
        let whole: Vec<Breath> =
            breaths.into_iter().filter(|each| each.is_within(&samples)).collect();
        let pulsation = spectral.as_ref().map(|spectral| Pulsation::of(spectral, &pattern));
        let variability = variability(&whole, self.rate_hz);
        let has_phases = pulsation.is_none_or(Pulsation::leaves_phases);
        let has_variability = pulsation.zip(variability.as_ref()).is_none_or(|(p, v)| p.leaves(v));
        let values = pattern_values(&pattern, spectral)
            .into_iter()
            .zip(PATTERN)
            .map(|(value, (name, ..))| (value, has_phases || name.starts_with(RATE)))
            .chain(
                variability_values(variability)
                    .into_iter()
                    .zip(VARIABILITY)
                    .map(|(value, (name, ..))| (value, has_variability || CENTRES.contains(&name))),
            )
            .map(|(value, has)| match () {
                () if !value.is_finite() => Err(Reason::Short),
                () if !has => Err(Reason::Quality),
                () => Ok(value),
            });
        Measured { coverage, quality, values: values.collect() }
    }
}

fn pattern_values(pattern: &Pattern, spectral: Option<Spectral>) -> Vec<f64> {
    vec![
        pattern.rate_mean_per_min,
        pattern.rate_sd_per_min,
        spectral.map_or(f64::NAN, |spectral| spectral.rate_per_min),
        pattern.amplitude_mean,
        pattern.amplitude_sd,
        pattern.inhalation_secs,
        pattern.exhalation_secs,
        pattern.inhalation_to_exhalation,
        pattern.volume_per_time,
    ]
}

fn variability_values(found: Option<Variability>) -> [f64; VARIABILITY.len()] {
    let Some(found) = found else { return [f64::NAN; VARIABILITY.len()] };
    [
        found.rmssd_ms,
        found.mean_bb_ms,
        found.sdbb_ms,
        found.sdsd_ms,
        found.cvbb,
        found.cvsd,
        found.median_bb_ms,
        found.mad_bb_ms,
        found.mcvbb,
        found.sd1_ms,
        found.sd2_ms,
        found.sd2_sd1,
    ]
}

/// The values that the heartbeat in the signal does not change: rates, and centres of durations.
const RATE: &str = "RSP_Rate";
const CENTRES: [&str; 2] = ["RRV_MeanBB", "RRV_MedianBB"];
/// The value that needs no breaths.
const SPECTRAL: &str = "RSP_Rate_Spectral";
/// Name, unit (`*` for that of the signal) and method of the values of the pattern.
const PATTERN: [(&str, &str, &str); 9] = [
    ("RSP_Rate_Mean", "1/min", "fractional breaths over the time that they cover"),
    ("RSP_Rate_SD", "1/min", "SD of 60 / duration of whole breaths, n-1"),
    (SPECTRAL, "1/min", "peak of frequency x Welch's spectrum 0.05-1 Hz, 30 s Hann"),
    ("RSP_Amplitude_Mean", "*", "mean height of peak above trough before it"),
    ("RSP_Amplitude_SD", "*", "SD of these heights, n-1"),
    ("RSP_Phase_Duration_Inspiration", "s", "mean time from trough to peak"),
    (
        "RSP_Phase_Duration_Expiration",
        "s",
        "mean time from peak to next trough, including the pause",
    ),
    ("RSP_Phase_Duration_Ratio", "1", "mean time of inspiration / of expiration"),
    ("RSP_RVT", "*/s", "mean of amplitude / duration (Birn 2006)"),
];
/// Name, unit and method of the values of the variability.
const VARIABILITY: [(&str, &str, &str); 12] = [
    ("RRV_RMSSD", "ms", "root mean square of differences of successive durations"),
    ("RRV_MeanBB", "ms", "mean duration"),
    ("RRV_SDBB", "ms", "SD of durations, n-1"),
    ("RRV_SDSD", "ms", "SD of differences of successive durations, n-1"),
    ("RRV_CVBB", "1", "SDBB / MeanBB"),
    ("RRV_CVSD", "1", "RMSSD / MeanBB"),
    ("RRV_MedianBB", "ms", "median duration"),
    ("RRV_MadBB", "ms", "1.4826 median absolute deviation of durations"),
    ("RRV_MCVBB", "1", "MadBB / MedianBB"),
    ("RRV_SD1", "ms", "SDSD / sqrt 2"),
    ("RRV_SD2", "ms", "sqrt(2 SDBB^2 - SDSD^2 / 2)"),
    ("RRV_SD2SD1", "1", "SD2 / SD1"),
];

fn values(unit: &str, how: &str) -> Vec<Value> {
    let value = |(name, of, method): &(&'static str, &'static str, &str)| {
        let unit = match *of {
            "*" => Cow::Owned(unit.to_owned()),
            "*/s" => Cow::Owned(format!("{unit}/s")),
            fixed => Cow::Borrowed(fixed),
        };
        let is_of_breaths = *name != SPECTRAL;
        let breaths = if is_of_breaths { format!("; breaths: {how}") } else { String::new() };
        let method = Cow::Owned(format!("{method}{breaths}"));
        Value { name: Cow::Borrowed(name), unit, method }
    };
    PATTERN.iter().chain(&VARIABILITY).map(value).collect()
}
