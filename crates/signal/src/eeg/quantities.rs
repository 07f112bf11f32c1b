//! The values of an EEG in order, with their recipes.

use super::band::{Band, Powers};
use super::indices::{alpha_frequency, asymmetry, slope, workload};
use super::pieces::Reading;
use super::site::{FRONTAL_PAIRS, channel_at};
use crate::analysis::{Reason, Value};
use crate::spectrum::Spectrum;

/// A value of one spectrum.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Power(Band),
    Relative(Band),
    Engagement,
    ThetaAlpha,
    AlphaPeak,
    AlphaCentre,
    Slope,
}

/// The source of a value.
#[derive(Clone, Copy, Debug)]
pub(super) enum Quantity {
    /// The average spectrum of all channels.
    Average(Shape),
    /// The spectrum of one channel.
    Channel(usize, Shape),
    /// The quality of one channel.
    Quality(usize),
    /// The workload from Fz and Pz.
    Workload(Option<(usize, usize)>),
    /// The asymmetry of a left and a right channel.
    Asymmetry(Option<(usize, usize)>),
    BlinkRate,
    BlinkAmplitude,
    BlinkDuration,
}

impl Shape {
    const ALL: [Shape; 15] = [
        Shape::Power(Band::Delta),
        Shape::Power(Band::Theta),
        Shape::Power(Band::Alpha),
        Shape::Power(Band::Beta),
        Shape::Power(Band::Gamma),
        Shape::Relative(Band::Delta),
        Shape::Relative(Band::Theta),
        Shape::Relative(Band::Alpha),
        Shape::Relative(Band::Beta),
        Shape::Relative(Band::Gamma),
        Shape::Engagement,
        Shape::ThetaAlpha,
        Shape::AlphaPeak,
        Shape::AlphaCentre,
        Shape::Slope,
    ];

    /// The value for a spectrum.
    pub(super) fn of(self, spectrum: &Spectrum) -> Result<f64, Reason> {
        let powers = || Powers::of(spectrum);
        let value = match self {
            Shape::Power(band) => powers().map(|powers| powers.uv2(band)),
            Shape::Relative(band) => powers().and_then(|powers| powers.relative(band)),
            Shape::Engagement => powers().and_then(|powers| powers.engagement()),
            Shape::ThetaAlpha => powers().and_then(|powers| powers.theta_over_alpha()),
            Shape::AlphaPeak => alpha_frequency(spectrum).and_then(|alpha| alpha.peak_hz),
            Shape::AlphaCentre => alpha_frequency(spectrum).map(|alpha| alpha.centre_hz),
            Shape::Slope => slope(spectrum),
        };
        Reason::unless_finite(value.unwrap_or(f64::NAN))
    }

    fn value(self, channel: Option<&str>, welch: &str) -> Value {
        let (name, unit, formula) = match self {
            Shape::Power(band) => (format!("{band:?}"), "µV²", trapezoid(band)),
            Shape::Relative(band) => (
                format!("{band:?}Rel"),
                "1",
                format!("{} over the sum of all bands", trapezoid(band)),
            ),
            Shape::Engagement => ("Engagement".into(), "1", "beta / (alpha + theta)".into()),
            Shape::ThetaAlpha => ("ThetaAlpha".into(), "1", "theta / alpha".into()),
            Shape::AlphaPeak => ("AlphaPeak".into(), "Hz", "highest bin, 7–13 Hz".into()),
            Shape::AlphaCentre => {
                ("AlphaCentre".into(), "Hz", "centre of gravity of the power, 7–13 Hz".into())
            }
            Shape::Slope => {
                let formula =
                    "least squares of log power over log frequency, 2–40 Hz without 7–14 Hz";
                ("Slope".into(), "1", formula.into())
            }
        };
        let of = if channel.is_some() { "" } else { "; mean spectrum of all channels" };
        let method = format!("{formula}; {welch}{of}");
        Value::of_channel(&format!("EEG_{name}"), channel.unwrap_or_default(), unit, method)
    }
}

fn trapezoid(band: Band) -> String {
    let (low_hz, high_hz) = band.edges_hz();
    format!("trapezoids over the bins from {low_hz} to {high_hz} Hz")
}

/// All values of these channels, with their sources; `welch` and `blinks` describe the methods. Channels
/// without a name contribute to averages only.
pub(super) fn quantities(names: &[String], welch: &str, blinks: &str) -> Vec<(Quantity, Value)> {
    let mut all: Vec<(Quantity, Value)> = Shape::ALL
        .into_iter()
        .map(|shape| (Quantity::Average(shape), shape.value(None, welch)))
        .collect();
    all.push(workload_value(names, welch));
    all.extend(asymmetry_values(names, welch));
    all.extend(blink_values(blinks));
    for (index, name) in names.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
        let own = Shape::ALL.into_iter().take_while(|shape| !matches!(shape, Shape::Slope));
        all.extend(
            own.map(|shape| (Quantity::Channel(index, shape), shape.value(Some(name), welch))),
        );
        let method = "product of the scores for amplitude, mains and muscle (30–45 Hz) and the share of samples \
                      that are neither flat, saturated nor missing, averaged over segments of 4 s; times a \
                      score for the absence of narrow lines in their mean spectrum";
        all.push((Quantity::Quality(index), Value::of_channel("EEG_Quality", name, "1", method)));
    }
    all
}

fn workload_value(names: &[String], welch: &str) -> (Quantity, Value) {
    let channels = channel_at(names, "FZ").zip(channel_at(names, "PZ"));
    let method = format!("theta at Fz / alpha at Pz; {welch}");
    (Quantity::Workload(channels), Value::of_channel("EEG_Workload", "", "1", method))
}

/// An asymmetry for each available pair of sites; one that is always missing if there is none.
fn asymmetry_values(names: &[String], welch: &str) -> Vec<(Quantity, Value)> {
    let value = |pair: &str| {
        let method = format!("ln alpha on the right − ln alpha on the left; {welch}");
        Value::of_channel("EEG_Asymmetry", pair, "1", method)
    };
    let pairs = FRONTAL_PAIRS.into_iter().filter_map(|(left, right)| {
        let channels = channel_at(names, left).zip(channel_at(names, right))?;
        Some((Quantity::Asymmetry(Some(channels)), value(&format!("{right}-{left}"))))
    });
    let pairs: Vec<(Quantity, Value)> = pairs.collect();
    if pairs.is_empty() {
        return vec![(Quantity::Asymmetry(None), value(""))];
    }
    pairs
}

fn blink_values(blinks: &str) -> [(Quantity, Value); 3] {
    let value = |name: &str, unit: &'static str, formula: &str| {
        Value::of_channel(name, "", unit, format!("{formula}; {blinks}"))
    };
    [
        (Quantity::BlinkRate, value("EEG_BlinkRate", "1/min", "blinks over the time with data")),
        (Quantity::BlinkAmplitude, value("EEG_BlinkAmplitude", "µV", "mean height")),
        (Quantity::BlinkDuration, value("EEG_BlinkDuration", "s", "mean width at half height")),
    ]
}

/// The index computed from two channels.
pub(super) fn of_pair(quantity: Quantity, readings: &[Reading]) -> Result<f64, Reason> {
    let (Quantity::Workload(channels) | Quantity::Asymmetry(channels)) = quantity else {
        return Err(Reason::Undefined);
    };
    let (one, other) = channels.ok_or(Reason::Missing)?;
    let powers = |channel: usize| {
        let spectrum = readings[channel].spectrum.as_ref().map_err(|&reason| reason)?;
        Powers::of(spectrum).ok_or(Reason::Undefined)
    };
    let (one, other) = (powers(one)?, powers(other)?);
    let value = match quantity {
        Quantity::Workload(_) => workload(&one, &other),
        _ => asymmetry(&one, &other),
    };
    value.ok_or(Reason::Undefined)
}
