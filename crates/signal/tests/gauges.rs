//! Laws of temperature's windows, and of those of any numbers.

use proptest::prelude::*;
use teampulse_signal::analysis::{Causal, Measured, Reason, Recording, Span, Windows};
use teampulse_signal::temperature::Limits;
use teampulse_signal::{descriptive, temperature};

fn secs(begin: f64, end: f64) -> Span {
    Span { begin_ns: (begin * 1e9) as i64, end_ns: (end * 1e9) as i64 }
}

fn value(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    let index = windows.values().iter().position(|value| value.name == name);
    measured.values[index.unwrap_or_else(|| panic!("no value {name}"))]
}

fn feed(analysis: &mut dyn Causal, channels: &[Vec<f64>], rate_hz: f64) {
    let length = channels.first().map_or(0, Vec::len);
    for sample in 0..length {
        let row: Vec<f64> = channels.iter().map(|channel| channel[sample]).collect();
        analysis.push((sample as f64 / rate_hz * 1e9).round() as i64, &row);
    }
}

/// A wristband at 4 Hz, in steps of 0.02 °C.
fn skin(count: i32, per_min: f64) -> Vec<f64> {
    let reading = |k: i32| 33.0 + per_min * f64::from(k) / 240.0;
    (0..count).map(|k| (reading(k) * 50.0).round() / 50.0).collect()
}

fn worn(readings_c: Vec<f64>) -> Box<dyn Causal + Send> {
    let settings = temperature::analysis::Settings::default();
    let mut running = temperature::analysis::causal(&settings, 4.0).expect("a usual rate");
    feed(&mut *running, &[readings_c], 4.0);
    running
}

#[test]
fn coarse_steps_do_not_hide_a_slope() {
    for per_min in [-0.3, -0.05, 0.0, 0.1, 0.4] {
        let running = worn(skin(480, per_min));
        let measured = running.measure(secs(0.0, 120.0));
        let slope = value(&*running, &measured, "TEMP_Slope").unwrap();
        assert!((slope - per_min).abs() < 0.02, "{slope} {per_min}");
        assert_eq!((measured.coverage, measured.quality), (1.0, 1.0));
    }
}

#[test]
fn a_band_that_is_taken_off_gives_no_skin() {
    let mut readings_c = skin(480, 0.0);
    readings_c[240..].fill(18.0);
    let running = worn(readings_c);
    let get = |span: Span, name: &str| value(&*running, &running.measure(span), name);
    assert_eq!(get(secs(0.0, 60.0), "TEMP_OffBody"), Ok(0.0));
    assert_eq!(get(secs(60.0, 120.0), "TEMP_OffBody"), Ok(1.0));
    assert_eq!(get(secs(60.0, 120.0), "TEMP_Mean"), Err(Reason::Quality));
    // Of a span of both, only skin counts.
    assert_eq!(get(secs(40.0, 75.0), "TEMP_Min"), Ok(33.0));
    assert_eq!(get(secs(0.0, 5.0), "TEMP_Slope"), Err(Reason::Short));
}

#[test]
fn temperature_of_a_whole_recording_is_the_same() {
    let channels = [skin(480, 0.2)];
    let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
    let all = temperature::analysis::whole(&temperature::analysis::Settings::default(), &recording)
        .unwrap();
    let running = worn(skin(480, 0.2));
    let span = secs(13.0, 99.0);
    assert_eq!(all.windows.measure(span), running.measure(span));
}

#[test]
fn limits_and_rates_that_make_no_sense_are_refused() {
    let limits = Limits { least_c: f64::NAN, ..Limits::default() };
    let settings = temperature::analysis::Settings { limits };
    assert!(temperature::analysis::causal(&settings, 4.0).is_err());
    for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY] {
        assert!(
            temperature::analysis::causal(&temperature::analysis::Settings::default(), rate_hz)
                .is_err()
        );
        let recording = Recording { rate_hz, begin_ns: 0, channels: &[] };
        assert!(
            temperature::analysis::whole(&temperature::analysis::Settings::default(), &recording)
                .is_err()
        );
        let is_rate = [0.0, 1e-9, 1e9].contains(&rate_hz);
        let descriptive =
            descriptive::analysis::causal(&descriptive::analysis::Settings::default(), rate_hz);
        assert_eq!(descriptive.is_ok(), is_rate);
    }
    let settings = descriptive::analysis::Settings { channels: Vec::new() };
    assert!(descriptive::analysis::causal(&settings, 4.0).is_err());
}

fn two_channels() -> descriptive::analysis::Settings {
    let channel =
        |name: &str| descriptive::analysis::Channel { name: name.into(), unit: "V".into() };
    descriptive::analysis::Settings { channels: vec![channel("left"), channel("right")] }
}

#[test]
fn any_numbers_are_described() {
    let channels = [vec![1.0, 2.0, 3.0, 4.0], vec![5.0, f64::NAN, 5.0, 8.0]];
    let recording = Recording { rate_hz: 2.0, begin_ns: 0, channels: &channels };
    let all = descriptive::analysis::whole(&two_channels(), &recording).unwrap();
    let mut running = descriptive::analysis::causal(&two_channels(), 2.0).unwrap();
    feed(&mut *running, &channels, 2.0);
    let measured = running.measure(recording.span());
    assert_eq!(all.windows.measure(recording.span()), measured);
    let get = |name: &str| value(&*running, &measured, name).unwrap();
    assert_eq!((get("Mean/left"), get("Median/right"), get("MAD/right")), (2.5, 5.0, 0.0));
    assert_eq!((get("Min/left"), get("Max/right"), get("Slope/left")), (1.0, 8.0, 2.0));
    assert_eq!((get("N/right"), get("Missing/right"), get("Missing/left")), (3.0, 25.0, 0.0));
    let slope = running.values().iter().find(|value| value.name == "Slope/left").unwrap();
    assert_eq!(slope.unit, "V/s");
}

#[test]
fn a_channel_that_is_not_there_is_missing_alone() {
    let channels = [vec![1.0; 40]];
    let recording = Recording { rate_hz: 2.0, begin_ns: 0, channels: &channels };
    let all = descriptive::analysis::whole(&two_channels(), &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    let get = |name: &str| value(&*all.windows, &measured, name);
    assert_eq!((get("Mean/left"), get("Mean/right")), (Ok(1.0), Err(Reason::Gap)));
    assert_eq!((get("N/right"), get("Missing/right")), (Ok(0.0), Ok(100.0)));
    let later = all.windows.measure(secs(100.0, 200.0));
    assert!(later.values.iter().all(|value| *value == Err(Reason::Gap)));
}

#[test]
fn samples_that_come_when_they_like_are_described_too() {
    let mut running =
        descriptive::analysis::causal(&descriptive::analysis::Settings::default(), 0.0).unwrap();
    for (k, at_secs) in [0.0, 0.9, 2.1, 3.0, 4.0, 5.2, 6.0].into_iter().enumerate() {
        running.push((at_secs * 1e9) as i64, &[k as f64]);
    }
    let measured = running.measure(secs(0.0, 7.0));
    assert_eq!(value(&*running, &measured, "Median"), Ok(3.0));
    assert!(measured.coverage > 0.99 && running.measure(secs(0.0, 30.0)).coverage < 0.3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_input_gives_nonsense(
        signal in prop::collection::vec(prop_oneof![prop::num::f64::ANY, 20.0..42.0], 0..300),
        rate_hz in prop_oneof![0.001..1000.0, Just(0.0)],
        begin in -1.0..5.0,
        length in prop_oneof![-1.0..100.0, Just(f64::INFINITY)],
    ) {
        let mut all = vec![descriptive::analysis::causal(&descriptive::analysis::Settings::default(), rate_hz).unwrap()];
        all.extend(temperature::analysis::causal(&temperature::analysis::Settings::default(), rate_hz));
        for running in &mut all {
            feed(&mut **running, std::slice::from_ref(&signal), rate_hz.max(1.0));
            let measured = running.measure(secs(begin, begin + length));
            prop_assert!((0.0..=1.0).contains(&measured.coverage));
            prop_assert!((0.0..=1.0).contains(&measured.quality));
            prop_assert_eq!(measured.values.len(), running.values().len());
            prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
        }
    }
}
