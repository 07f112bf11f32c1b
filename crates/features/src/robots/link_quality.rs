//! The quality of a robot's radio link.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Origin, Shape, Signal, Stream, StreamId, Window};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::robust::{mad, median_estimate};

use crate::context::FeatureContext;
use crate::value::{Value, defined, window_of};
use crate::windows::{View, Windows};

/// Signal levels that a radio can report; other values are a driver's code for "none" [dBm].
const PLAUSIBLE_DBM: std::ops::RangeInclusive<f64> = -150.0..=30.0;

/// The level at which the quality of a link is 0, and how far above it the quality is 1: Linux'
/// net/wireless/wext-compat.c maps −110 … −40 dBm to 0 … 70.
const NO_QUALITY_DBM: f64 = -110.0;
const FULL_QUALITY_DB: f64 = 70.0;

/// The quality of a robot's radio link: its level, how that varies, and how often it is weak.
///
/// - Measures: the received signal level (RSSI) of a stream whose first channel is in dBm; for others, only the share
///   of full quality that the driver reports.
/// - Formula: median, median absolute deviation and minimum of the level; the share of readings
///   below `weak_dbm`; quality = (median + 110 dBm) / 70 dB, clamped to 0 … 1.
/// - Unit: dBm, dB, dBm, 1, 1.
/// - Window: `windows_secs`, once a second.
/// - Reference: the scale of quality is that of Linux' cfg80211 (`wext-compat.c`).
/// - Limits: levels of different radios can't be compared closely. Uncertainties assume independent
///   readings; a slowly fading level is more uncertain. In a stream with more than 600 readings per window, short dips
///   are missed.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LinkQuality {
    /// The lengths of the windows [s]; by default the study's.
    pub windows_secs: Option<Vec<f64>>,
    /// The level below which a link is weak, a negative one [dBm].
    pub weak_dbm: f64,
}

impl Default for LinkQuality {
    fn default() -> LinkQuality {
        LinkQuality { windows_secs: None, weak_dbm: -75.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for LinkQuality {
    const EXAMPLE: &'static str = "weak_dbm = -75";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        if !self.weak_dbm.is_finite() {
            let message = format!("`weak_dbm` is {}, not a level", self.weak_dbm);
            return Err(SettingsError::new(message)
                .with_hint("give a level like -75")
                .at("weak_dbm"));
        }
        if self.weak_dbm >= 0.0 {
            let message = format!("`weak_dbm` of {} dBm: expected less than 0", self.weak_dbm);
            let meant_dbm = if self.weak_dbm > 0.0 { -self.weak_dbm } else { -75.0 };
            let hint = format!("the levels of a radio link are negative: write {meant_dbm}");
            return Err(SettingsError::new(message).with_hint(hint).at("weak_dbm"));
        }
        let windows_secs = context.windows_or(self.windows_secs)?;
        Ok(Box::new(Links { windows_secs, weak_dbm: self.weak_dbm }))
    }
}

struct Links {
    windows_secs: Vec<f64>,
    weak_dbm: f64,
}

impl Feature for Links {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.signal == Signal::Link && stream.origin == Origin::Raw && Scale::of(stream).is_some()
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Link {
            weak_dbm: self.weak_dbm,
            lengths_secs: self.windows_secs.clone(),
            windows: Windows::new(&self.windows_secs),
            readout: None,
            scale: None,
            outputs: Vec::new(),
        })
    }
}

/// How a link reports its quality, and on which channel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// A level [dBm].
    Level { channel: usize },
    /// A share of full quality, times `full`.
    Share { channel: usize, full: f64 },
}

struct Link {
    weak_dbm: f64,
    lengths_secs: Vec<f64>,
    windows: Windows<f64>,
    readout: Option<Readout>,
    scale: Option<Scale>,
    outputs: Vec<OutputId>,
}

impl Extractor for Link {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.readout = Readout::of(stream);
        self.scale = Scale::of(stream);
        let declare = |secs: &f64| out.declare(output(stream, *secs, self.weak_dbm));
        self.outputs = self.lengths_secs.iter().map(declare).collect();
    }

    fn push(&mut self, sample: &Sample, _: &mut Outputs) {
        let numbers = self.readout.as_mut().and_then(|readout| readout.read(&sample.data));
        if let (Some(numbers), Some(scale)) = (numbers, self.scale) {
            self.windows.insert(sample.measured, scale.reading(numbers));
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let (Some(end), Some(scale)) = (self.windows.due(now), self.scale) else { return };
        for (view, output) in self.windows.views(end).zip(&self.outputs) {
            out.emit(*output, end, summary(&view, scale, self.weak_dbm));
        }
    }
}

impl Scale {
    fn of(stream: &Stream) -> Option<Scale> {
        let mut units = stream.channels.iter().map(|channel| channel.unit.as_str()).enumerate();
        if stream.channels.first()?.unit == "dBm" {
            return Some(Scale::Level { channel: 0 });
        }
        units.find_map(|(channel, unit)| match unit {
            "1" => Some(Scale::Share { channel, full: 1.0 }),
            "%" => Some(Scale::Share { channel, full: 100.0 }),
            _ => None,
        })
    }

    /// The level [dBm] or the share of full quality; NaN where it is not plausible.
    fn reading(self, numbers: &[f64]) -> f64 {
        let (reading, plausible) = match self {
            Scale::Level { channel } => (numbers.get(channel).copied(), PLAUSIBLE_DBM),
            Scale::Share { channel, full } => {
                (numbers.get(channel).map(|share| share / full), 0.0..=1.0)
            }
        };
        reading.filter(|reading| plausible.contains(reading)).unwrap_or(f64::NAN)
    }
}

fn summary(view: &View<'_, f64>, scale: Scale, weak_dbm: f64) -> Data {
    let quality = view.share(|reading| reading.is_finite());
    let mut readings = view.numbers(|reading| *reading);
    readings.retain(|reading| reading.is_finite());
    let lack = view.lack.or(readings.is_empty().then_some(Reason::Quality));
    let values = match (lack, scale) {
        (Some(reason), _) => [Err(reason); 5],
        (None, Scale::Level { .. }) => level_values(&readings, weak_dbm),
        (None, Scale::Share { .. }) => {
            let missing = Err(Reason::Missing);
            [missing, missing, missing, missing, defined(median_estimate(&readings))]
        }
    };
    window_of(view.secs, view.coverage, quality, &values)
}

/// Median, deviation, minimum, weak share and quality of levels [dBm].
fn level_values(levels_dbm: &[f64], weak_dbm: f64) -> [Value; 5] {
    let level = defined(median_estimate(levels_dbm));
    let deviation = mad(levels_dbm).map(Estimate::unstated);
    let least = levels_dbm.iter().copied().min_by(f64::total_cmp).map(Estimate::unstated);
    let weak = levels_dbm.iter().filter(|level| **level < weak_dbm).count();
    let quality = level.map(|level| Estimate {
        value: ((level.value - NO_QUALITY_DBM) / FULL_QUALITY_DB).clamp(0.0, 1.0),
        sigma: level.sigma / FULL_QUALITY_DB,
    });
    [level, defined(deviation), defined(least), Ok(share(weak, levels_dbm.len())), quality]
}

/// A share of independent readings, with its binomial uncertainty; by the rule of succession, so
/// that "never" and "always" are not certain.
fn share(count: usize, of: usize) -> Estimate {
    let (count, of) = (count as f64, of as f64);
    let expected = (count + 1.0) / (of + 2.0);
    Estimate { value: count / of, sigma: (expected * (1.0 - expected) / of).sqrt() }
}

fn output(input: &Stream, secs: f64, weak_dbm: f64) -> Stream {
    let channels = [
        ("rssi_median", "dBm"),
        ("rssi_mad", "dB"),
        ("rssi_min", "dBm"),
        ("weak_share", "1"),
        ("quality", "1"),
    ];
    Stream {
        signal: Signal::Link,
        device: input.device.clone(),
        rate_hz: 1.0,
        method: format!(
            "median, MAD and minimum over {secs} s; share below {weak_dbm} dBm; \
             quality (median + 110) / 70"
        ),
        doc: format!("The quality of the link of {} in the last {secs} s.", input.name),
        ..Stream::derived(input, "quality", Shape::Feature)
            .over(Window::of_secs(secs))
            .with_channels(&channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::{Drive, built, plain};

    fn drive(channels: &[(&str, &str)]) -> Drive {
        let stream = plain("/r1/wifi", Signal::Link, channels);
        Drive::new(built::<LinkQuality>("").as_ref(), &stream)
    }

    #[test]
    fn a_level_is_summed_up_over_the_window() {
        let mut drive = drive(&[("signal_level", "dBm"), ("link_quality", "1")]);
        for k in 0..300 {
            drive.at(f64::from(k) * 0.1, &[[-60.0, -62.0, -80.0][k as usize % 3], 0.9]);
        }
        drive.until(30.0);
        let window = drive.last("/r1/wifi/quality/w30");
        let share = window.values[3];
        assert_eq!(window.values[..3], [-62.0, 2.0, -80.0]);
        assert!((share - 1.0 / 3.0).abs() < 0.01, "{share}");
        assert_eq!(window.values[4], 48.0 / 70.0);
        assert!(window.reasons.iter().all(|reason| *reason == Reason::Ok));
    }

    #[test]
    fn a_very_strong_link_has_full_quality_and_uncertainty_in_its_unit() {
        let mut drive = drive(&[("signal_level", "dBm")]);
        (0..=40).for_each(|secs| drive.at(f64::from(secs), &[f64::from(secs % 7) - 30.0]));
        let window = drive.last("/r1/wifi/quality/w30");
        assert_eq!(window.values[4], 1.0);
        assert_eq!(window.sigmas[4], window.sigmas[0] / 70.0);
    }

    #[test]
    fn without_a_level_only_the_quality_is_known() {
        let mut drive = drive(&[("link_quality", "%")]);
        (0..=40).for_each(|secs| drive.at(f64::from(secs), &[70.0]));
        let window = drive.last("/r1/wifi/quality/w30");
        assert_eq!(window.values[4], 0.7);
        assert_eq!(window.reasons[..4], [Reason::Missing; 4]);
    }

    #[test]
    fn levels_that_no_radio_has_are_left_out() {
        let mut drive = drive(&[("signal_level", "dBm")]);
        let absurd = [f64::NAN, -256.0, f64::INFINITY, 1e12, -55.0];
        (0..40).for_each(|k| drive.at(f64::from(k) + 0.5, &[absurd[k as usize % 5]]));
        drive.until(40.0);
        let window = drive.last("/r1/wifi/quality/w30");
        assert_eq!(window.values, [-55.0, 0.0, -55.0, 0.0, 55.0 / 70.0]);
        assert_eq!(window.quality, 0.2);
    }

    #[test]
    fn a_silent_link_has_a_gap_and_a_new_one_is_short() {
        let mut drive = drive(&[("signal_level", "dBm")]);
        (0..=40).for_each(|secs| drive.at(f64::from(secs), &[-55.0]));
        drive.until(200.0);
        let windows = drive.features("/r1/wifi/quality/w30");
        assert_eq!(windows.first().unwrap().1.reasons, [Reason::Short; 5]);
        assert_eq!(windows.last().unwrap().1.reasons, [Reason::Gap; 5]);
    }

    #[test]
    fn a_late_reading_counts_at_its_place() {
        let mut drive = drive(&[("signal_level", "dBm")]);
        (0..=40).for_each(|secs| drive.at(f64::from(secs), &[-55.0]));
        drive.late(35.5, &[-90.0]);
        drive.until(41.0);
        assert_eq!(drive.last("/r1/wifi/quality/w30").values[2], -90.0);
    }
}
