//! The values of a span of frames.

use super::spectra::{COUNT, STEP_HZ, Spectrum};
use super::store::Store;
use crate::analysis::{Measured, Reason, Span, Value};

/// The longest time that a frame accounts for [ns].
const STANDS_NANOS: i64 = 500_000_000;
/// Half the width of a line in a spectrum of 15 s [Hz].
const LINE_HZ: f64 = 0.14;
/// How close the line of a single spectrum must be to that of the mean spectrum to belong to the same pulse
/// [Hz].
const SAME_HZ: f64 = 0.15;
/// The ratios of the power in the lines to the power beside them over which quality rises from 0 to 1.
const POWER: (f64, f64) = (0.25, 1.0);
/// The shares of spectra that contain the common line over which quality rises from 0 to 1.
const AGREEMENT: (f64, f64) = (0.3, 0.9);
/// The largest amplitude of a rhythm in the whole view, relative to what the skin alone would cause.
const FLICKER: f64 = 3.0;
/// The lowest quality at which a pulse is reported.
const LEAST_QUALITY: f64 = 0.3;
/// The smallest uncertainty of a rate [1/min]: drifts of the rate within a spectrum.
const LEAST_ERROR: f64 = 0.6;

/// The values of windows.
pub(super) static VALUES: [Value; 5] = [
    Value::new(
        "RPPG_Rate",
        "1/min",
        "highest line from 0.7 to 3.5 Hz in the mean spectrum of 15 s each (Hann) of the colour of skin projected by POS (Wang 2017)",
    ),
    Value::new(
        "RPPG_Rate_Uncertainty",
        "1/min",
        "half of the 95 % interval of the rate: twice the standard error of the lines of single spectra, every fourth of which is independent, and 0.6/min",
    ),
    Value::new(
        "RPPG_SNR",
        "dB",
        "power within 0.14 Hz of the line and of twice its frequency, over the power beside them from 0.7 to 7.2 Hz",
    ),
    Value::new(
        "VIEW_Presence",
        "1",
        "share of frames with a person in view: skin-coloured, with movement within 20 s",
    ),
    Value::new("VIEW_Moving", "1", "mean share of the view that moves"),
];

/// The values of a span.
pub(super) fn measure(store: &Store, span: Span) -> Measured {
    let frames = store.frames(span);
    let coverage = covered(frames.clone().map(|frame| frame.at_ns), span);
    let presence = mean(frames.clone().map(|frame| frame.presence));
    let moving = mean(frames.clone().map(|frame| frame.moving));
    let spectra: Vec<&Spectrum> = store.spectra(span).collect();
    let pulse = Pulse::of(&spectra);
    let quality = pulse.as_ref().map_or(0.0, |pulse| pulse.quality);
    let of_pulse = |number: &dyn Fn(&Pulse) -> f64| match &pulse {
        None if frames.clone().all(|frame| frame.colour[1].is_nan()) => Err(Reason::Missing),
        None => Err(Reason::Short),
        Some(pulse) if pulse.quality < LEAST_QUALITY => Err(Reason::Quality),
        Some(pulse) => Ok(number(pulse)),
    };
    let values = vec![
        of_pulse(&|pulse| pulse.rate),
        of_pulse(&|pulse| pulse.uncertainty),
        pulse.as_ref().map(|pulse| 10.0 * pulse.ratio.log10()).ok_or(Reason::Short),
        presence.ok_or(Reason::Gap),
        moving.ok_or(Reason::Gap),
    ];
    Measured { coverage, quality, values }
}

/// The share of a span that is covered by frames [0..1].
fn covered(times: impl Iterator<Item = i64>, span: Span) -> f64 {
    let (mut until, mut sum) = (span.begin_ns, 0);
    for at_ns in times {
        let from = until.max(at_ns - STANDS_NANOS);
        sum += at_ns - from;
        until = at_ns;
    }
    sum += (span.end_ns - until).min(STANDS_NANOS);
    (sum as f64 / 1e9 / span.secs().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let known = numbers.filter(|number| number.is_finite());
    let (count, sum) = known.fold((0_u32, 0.0), |(count, sum), number| (count + 1, sum + number));
    (count > 0).then(|| sum / f64::from(count))
}

/// A pulse in spectra.
struct Pulse {
    /// The pulse rate, and half of its 95 % interval [1/min].
    rate: f64,
    uncertainty: f64,
    /// The power in the pulse's lines over that beside them.
    ratio: f64,
    quality: f64,
}

impl Pulse {
    fn of(spectra: &[&Spectrum]) -> Option<Pulse> {
        let mut power = vec![0.0; COUNT];
        for spectrum in spectra {
            // Each spectrum has the same weight, regardless of head movement.
            let whole: f64 = spectrum.pulse.iter().sum();
            if whole > 0.0 {
                power.iter_mut().zip(&spectrum.pulse).for_each(|(sum, part)| *sum += part / whole);
            }
        }
        let place = line(&power)?;
        let hz = Spectrum::hz(place);
        let ratio = ratio(&power, hz);
        let lines = spectra.iter().filter_map(|spectrum| line(&spectrum.pulse)).map(Spectrum::hz);
        let same: Vec<f64> = lines.filter(|line| (line - hz).abs() <= SAME_HZ).collect();
        let agreement = same.len() as f64 / spectra.len() as f64;
        let count = same.len().max(1) as f64;
        let square: f64 = same.iter().map(|line| (line - hz).powi(2)).sum();
        // One spectrum overlaps with its neighbours.
        let error = 60.0 * (square / count).sqrt() / (count / 4.0).max(1.0).sqrt();
        let is_of_view = is_of_view(spectra, place);
        let quality = rise(ratio, POWER) * rise(agreement, AGREEMENT);
        Some(Pulse {
            rate: 60.0 * hz,
            uncertainty: 2.0 * error.hypot(LEAST_ERROR / 2.0),
            ratio,
            quality: if is_of_view { 0.0 } else { quality },
        })
    }
}

/// The index of the highest pulse line between two frequencies; `None` without power.
fn line(power: &[f64]) -> Option<f64> {
    let places = Spectrum::of_pulses();
    let place = places.clone().max_by(|one, other| power[*one].total_cmp(&power[*other]))?;
    if power[place] <= 0.0 || !power[place].is_finite() {
        return None;
    }
    let is_inside = place > places.start && place + 1 < places.end;
    // A maximum at an edge is the slope of another component.
    is_inside.then(|| {
        let [before, here, after] = [place - 1, place, place + 1].map(|place| power[place].ln());
        let bend = before - 2.0 * here + after;
        let offset = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
        place as f64 + offset.clamp(-0.5, 0.5)
    })
}

/// The power in a line and its second harmonic, over the power beside them.
fn ratio(power: &[f64], hz: f64) -> f64 {
    let (mut within, mut beside) = (0.0, f64::MIN_POSITIVE);
    for (place, power) in power.iter().enumerate() {
        let at = Spectrum::hz(place as f64);
        let is_near = (at - hz).abs() <= LINE_HZ || (at - 2.0 * hz).abs() <= LINE_HZ;
        *(if is_near { &mut within } else { &mut beside }) += power;
    }
    within / beside
}

/// Whether the whole view has a rhythm at this index, far beyond what the skin in it causes; if so, the light flickers.
fn is_of_view(spectra: &[&Spectrum], place: f64) -> bool {
    let at = (place.round() as usize).min(Spectrum::of_pulses().end - 1);
    let around = at.saturating_sub((LINE_HZ / STEP_HZ) as usize * 2)..at;
    let flickers = |spectrum: &&&Spectrum| {
        let beside = spectrum.view[around.clone()].iter().copied().fold(0.0, f64::max);
        let is_line = spectrum.view[at] > 2.0 * beside;
        is_line && spectrum.view[at] > FLICKER * spectrum.skin * spectrum.green[at]
    };
    2 * spectra.iter().filter(flickers).count() > spectra.len()
}

/// Rises linearly from 0 to 1 between two numbers.
fn rise(number: f64, (from, to): (f64, f64)) -> f64 {
    ((number - from) / (to - from)).clamp(0.0, 1.0)
}
