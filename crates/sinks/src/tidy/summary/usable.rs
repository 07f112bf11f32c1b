//! The usable share of a window.

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::stream::{Signal, Stream};

/// From this share of values rejected for poor data on, a window is unusable.
const MOST_POOR: f64 = 0.5;
/// ECG values that state the share of existing data without a signal.
const DEAD: [&str; 2] = ["ECG_Flat", "ECG_Saturated"];

/// The share of a window in which data is good enough for values [0..1].
///
/// Missing data counts once, as coverage. For the existing data, the quality is either the share that is sound (skin
/// conductance, temperature, movement, robots), or a grade for all of it (hearts, breathing); then the data is usable
/// unless values are rejected. The coverage of EEG already excludes artefacts.
pub(super) fn usable_share(stream: &Stream, values: &FeatureValues) -> f64 {
    let (coverage, quality) = (f64::from(values.coverage), f64::from(values.quality));
    let poor = poor_share(values);
    coverage
        * match stream.signal {
            Signal::Eeg => 1.0,
            Signal::Emg => 1.0 - poor,
            Signal::Ecg | Signal::Ppg | Signal::Interval | Signal::Respiration => {
                if poor < MOST_POOR { 1.0 - dead_share(stream, values) } else { 0.0 }
            }
            _ => quality,
        }
}

/// The share of values rejected for poor data, among those not missing for another reason.
fn poor_share(values: &FeatureValues) -> f64 {
    let count = |reason: Reason| values.reasons.iter().filter(|each| **each == reason).count();
    let (poor, fine) = (count(Reason::Quality), count(Reason::Ok));
    if poor > 0 { poor as f64 / (poor + fine) as f64 } else { 0.0 }
}

fn dead_share(stream: &Stream, values: &FeatureValues) -> f64 {
    let names = stream.channels.iter().map(|channel| &channel.name).zip(&values.values);
    let dead = names.filter(|(name, share)| DEAD.contains(&name.as_str()) && share.is_finite());
    dead.map(|(_, share)| *share).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};
    use teampulse_signal::analysis::{Measured, Span};
    use teampulse_signal::{analysis, ecg};

    use super::*;

    const RATE_HZ: f64 = 130.0;

    fn measured(stream: Signal, channels: &[&str], window: &FeatureValues) -> f64 {
        let channels: Vec<_> = channels.iter().map(|name| (*name, "1")).collect();
        let of = Stream::raw("/x", Subject::session(), Shape::Feature).with_channels(&channels);
        usable_share(&Stream { signal: stream, ..of }, window)
    }

    fn window(coverage: f32, quality: f32, reasons: Vec<Reason>) -> FeatureValues {
        let values =
            reasons.iter().map(|reason| f64::from(u8::from(*reason == Reason::Ok))).collect();
        FeatureValues { window_secs: 60.0, coverage, quality, values, sigmas: Vec::new(), reasons }
    }

    /// The usable share of a minute of clean ECG in which some seconds are altered.
    fn usable_of_a_minute(alter: impl Fn(f64, f64) -> f64) -> f64 {
        let bump = |secs: f64, at: f64, width: f64| {
            let from = (secs - at + 0.4).rem_euclid(0.8) - 0.4;
            (-(from / width).powi(2) / 2.0).exp()
        };
        let mut heart =
            ecg::analysis::causal(&ecg::analysis::Settings::default(), RATE_HZ).unwrap();
        for k in 0..(62.0 * RATE_HZ) as i64 {
            let secs = k as f64 / RATE_HZ;
            let noise = 0.04 * (secs * 131.0).sin() + 0.04 * (secs * 57.0).cos();
            let volts = bump(secs, 0.3, 0.012) + 0.25 * bump(secs, 0.55, 0.05) + noise;
            heart.push((secs * 1e9).round() as i64, &[alter(secs, volts)]);
        }
        let Measured { coverage, quality, values } =
            heart.measure(Span { begin_ns: 0, end_ns: 60_000_000_000 });
        let reason = |value: &Result<f64, analysis::Reason>| match value {
            Ok(_) => Reason::Ok,
            Err(analysis::Reason::Quality) => Reason::Quality,
            Err(_) => Reason::Short,
        };
        let names: Vec<&str> = heart.values().iter().map(|value| value.name.as_ref()).collect();
        let values = FeatureValues {
            window_secs: 60.0,
            coverage: coverage as f32,
            quality: quality as f32,
            reasons: values.iter().map(reason).collect(),
            values: values.iter().map(|value| value.unwrap_or(f64::NAN)).collect(),
            sigmas: Vec::new(),
        };
        measured(Signal::Ecg, &names, &values)
    }

    #[test]
    fn a_clean_electrocardiogram_is_usable() {
        let share = usable_of_a_minute(|_, volts| volts);
        assert!(share > 0.99, "{share}");
    }

    #[test]
    fn a_drop_out_of_20_s_in_a_minute_leaves_two_thirds() {
        let is_out = |secs: f64| (20.0..40.0).contains(&secs);
        let lost = usable_of_a_minute(|secs, volts| if is_out(secs) { f64::NAN } else { volts });
        assert!((lost - 2.0 / 3.0).abs() < 0.01, "{lost}");
        let flat = usable_of_a_minute(|secs, volts| if is_out(secs) { 0.5 } else { volts });
        assert!((flat - 2.0 / 3.0).abs() < 0.06, "{flat}");
    }

    #[test]
    fn noise_is_not_usable() {
        let noise = |secs: f64, _: f64| (secs * secs * 977.0).sin() + (secs * 313.0).cos();
        assert!(usable_of_a_minute(noise) < 0.1);
    }

    #[test]
    fn what_is_off_the_body_is_not_usable() {
        let worn = window(0.9, 0.5, vec![Reason::Ok]);
        assert!((measured(Signal::Temperature, &["TEMP_Mean"], &worn) - 0.45).abs() < 1e-6);
        let of_two = window(1.0, 0.5, vec![Reason::Ok, Reason::Quality]);
        assert!((measured(Signal::Emg, &["a", "b"], &of_two) - 0.5).abs() < 1e-6);
        assert!((measured(Signal::Eeg, &["a", "b"], &of_two) - 1.0).abs() < 1e-6);
    }
}
