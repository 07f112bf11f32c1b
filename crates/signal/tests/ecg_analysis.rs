//! Laws of the analyses of ECGs, causal and of whole recordings.

#[path = "synthetic/ecg.rs"]
mod synthetic;

use proptest::prelude::*;
use synthetic::{beat_secs, ecg};
use teampulse_signal::analysis::{
    Causal, Event, Measured, Reason, Recording, Span, Whole, Windows,
};
use teampulse_signal::ecg::analysis::{Settings, causal, whole};

const RATE_HZ: f64 = 200.0;
const SEC: i64 = 1_000_000_000;

fn signal() -> Vec<f64> {
    ecg(&beat_secs(150), 122.0, RATE_HZ)
}

/// Noise that is the same each time, between −1 and 1.
fn noise(count: usize) -> Vec<f64> {
    (0..count as u32)
        .map(|k| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / 8_388_608.0 - 1.0)
        .collect()
}

fn recorded(signal: &[f64], rate_hz: f64) -> Whole {
    let recording = Recording { rate_hz, begin_ns: 0, channels: &[signal.to_vec()] };
    whole(&Settings::default(), &recording).expect("a usual rate")
}

fn live(signal: &[f64], rate_hz: f64) -> (Box<dyn Causal + Send>, Vec<Event>) {
    let mut analysis = causal(&Settings::default(), rate_hz).expect("a usual rate");
    for (k, &sample) in signal.iter().enumerate() {
        analysis.push((k as f64 / rate_hz * 1e9).round() as i64, &[sample]);
    }
    let events = std::iter::from_fn(|| analysis.next_event()).collect();
    (analysis, events)
}

fn secs(begin: i64, end: i64) -> Span {
    Span { begin_ns: begin * SEC, end_ns: end * SEC }
}

fn of(windows: &dyn Windows, span: Span, name: &str) -> Result<f64, Reason> {
    let place = windows.values().iter().position(|each| each.name == name).expect(name);
    windows.measure(span).values[place]
}

/// Both analyses of a signal.
fn both(signal: &[f64]) -> [Box<dyn Windows>; 2] {
    [live(signal, RATE_HZ).0, recorded(signal, RATE_HZ).windows]
}

#[test]
fn the_heart_rate_is_that_of_the_beats_in_the_span() {
    let inside: Vec<f64> =
        beat_secs(150).into_iter().filter(|secs| (30.0..90.0).contains(secs)).collect();
    let mean = 60.0 * (inside.len() - 1) as f64 / (inside[inside.len() - 1] - inside[0]);
    let rates: Vec<f64> = inside.windows(2).map(|pair| 60.0 / (pair[1] - pair[0])).collect();
    let highest = rates.iter().copied().fold(0.0, f64::max);
    for windows in both(&signal()) {
        let of = |name| of(&*windows, secs(30, 90), name).expect("the signal is clean");
        assert!((of("ECG_Rate_Mean") - mean).abs() < 0.05);
        assert!((of("ECG_Rate_Max") - highest).abs() < 0.3);
        assert!(of("ECG_Rate_Min") < mean && of("ECG_Rate_SD") < 5.0);
        assert!((of("HRV_MeanNN") - 60_000.0 / mean).abs() < 1.0);
    }
}

#[test]
fn each_beat_is_an_event_with_its_interval() {
    let signal = signal();
    for events in [live(&signal, RATE_HZ).1, recorded(&signal, RATE_HZ).events] {
        assert!((148..=150).contains(&events.len()), "{}", events.len());
        let detail = |event: &Event, name| {
            event.details.iter().find(|(each, _)| *each == name).expect(name).1
        };
        assert!(detail(&events[0], "rr_ms").is_nan());
        // What comes after the last one is cut off.
        for pair in events[..events.len() - 1].windows(2) {
            let interval_ms = (pair[1].at_ns - pair[0].at_ns) as f64 / 1e6;
            assert!((detail(&pair[1], "rr_ms") - interval_ms).abs() < 1e-6);
            let (quality, height) = (detail(&pair[1], "quality"), detail(&pair[1], "height"));
            assert!(quality > 0.95 && height > 0.7, "{quality} {height}");
        }
    }
}

#[test]
fn a_clean_signal_has_a_quality_near_one_and_noise_a_low_one() {
    let noisy = |height: f64| -> Vec<f64> {
        signal().iter().zip(noise(30_000)).map(|(value, noise)| value + height * noise).collect()
    };
    let qualities = [0.0, 0.1, 0.3, 1.0, 3.0]
        .map(|height| both(&noisy(height)).map(|windows| windows.measure(secs(60, 120)).quality));
    assert!(qualities[0].iter().all(|&quality| quality > 0.95), "{qualities:?}");
    assert!(qualities[4].iter().all(|&quality| quality < 0.3), "{qualities:?}");
    assert!(qualities.is_sorted_by(|a, b| a[0] > b[0] && a[1] > b[1]), "{qualities:?}");
}

#[test]
fn of_a_poor_signal_no_rate_is_reported() {
    for windows in both(&noise(24_000)) {
        assert!(windows.measure(secs(60, 120)).quality < 0.4);
        assert_eq!(of(&*windows, secs(60, 120), "ECG_Rate_Mean"), Err(Reason::Quality));
        assert_eq!(of(&*windows, secs(60, 120), "HRV_RMSSD"), Err(Reason::Quality));
        assert!(of(&*windows, secs(60, 120), "ECG_Quality").is_ok());
    }
}

#[test]
fn flat_and_saturated_parts_are_reported() {
    let mut flat = signal();
    flat[14_000..16_000].fill(0.123);
    for windows in both(&flat) {
        let of = |name| of(&*windows, secs(60, 90), name).expect("it always is");
        assert!((0.3..0.37).contains(&of("ECG_Flat")), "{}", of("ECG_Flat"));
        assert!((of("ECG_LeadOff") - 0.33).abs() < 0.05);
        assert!(of("ECG_Saturated") <= 0.0);
        // A line without noise is no pause of the heart: the rate is that of the other two thirds.
        let quality = windows.measure(secs(60, 90)).quality;
        assert!((0.9..0.95).contains(&quality), "{quality}");
    }
    let mut saturated = signal();
    saturated[14_000..16_000].fill(5.0);
    for windows in both(&saturated) {
        let of = |name| of(&*windows, secs(60, 90), name).expect("it always is");
        assert!((0.3..0.37).contains(&of("ECG_Saturated")), "{}", of("ECG_Saturated"));
        assert!(of("ECG_Flat") <= 0.0);
    }
}

#[test]
fn a_loose_electrode_is_reported() {
    let mut signal = signal();
    for (sample, noise) in signal[14_000..18_000].iter_mut().zip(noise(4_000)) {
        *sample = 0.01 * noise;
    }
    for windows in both(&signal) {
        let off = of(&*windows, secs(65, 95), "ECG_LeadOff").expect("it always is");
        assert!((0.6..0.75).contains(&off), "{off}");
    }
}

#[test]
fn motion_is_reported() {
    let mut moved = signal();
    for (k, sample) in moved[14_000..15_000].iter_mut().enumerate() {
        *sample += 4.0 * (k as f64 / 1000.0 * 20.0).sin();
    }
    for windows in both(&moved) {
        let of = |span| of(&*windows, span, "ECG_Motion").expect("it always is");
        assert!(of(secs(20, 60)) <= 0.0);
        assert!(of(secs(66, 78)) > 0.5);
    }
}

#[test]
fn missing_data_lower_the_coverage_and_hide_values() {
    let mut signal = signal();
    signal[6_000..14_000].fill(f64::NAN);
    for windows in both(&signal) {
        let most = windows.measure(secs(0, 60));
        assert!((most.coverage - 0.5).abs() < 1e-3);
        let Measured { coverage, values, .. } = windows.measure(secs(25, 65));
        assert!(coverage < 0.2 && values.iter().all(|value| *value == Err(Reason::Gap)));
        // No interval lies across the gap.
        let lowest = of(&*windows, secs(10, 90), "ECG_Rate_Min").expect("more than half is there");
        assert!(lowest > 60.0, "{lowest}");
    }
}

#[test]
fn short_spans_give_what_they_can() {
    for windows in both(&signal()) {
        assert_eq!(of(&*windows, secs(60, 61), "ECG_kSQI"), Err(Reason::Short));
        assert_eq!(of(&*windows, secs(60, 61), "ECG_Rate_SD"), Err(Reason::Short));
        assert_eq!(of(&*windows, secs(60, 60), "ECG_Rate_Mean"), Err(Reason::Gap));
        assert_eq!(of(&*windows, secs(70, 60), "ECG_Rate_Mean"), Err(Reason::Gap));
    }
}

/// By golden/ecg.py: the transforms differ in their rounding only.
#[test]
fn the_parts_of_quality_are_those_of_scipy() {
    let signal = ecg(&beat_secs(24), 20.0, RATE_HZ);
    let windows = recorded(&signal, RATE_HZ).windows;
    let golden = [
        ("ECG_kSQI", 14.697_019_825_975_413),
        ("ECG_pSQI", 0.669_554_947_698_835_4),
        ("ECG_basSQI", 0.360_922_475_979_019_33),
    ];
    for (name, golden) in golden {
        let value = of(&*windows, secs(0, 20), name).expect("the signal is clean");
        assert!((value / golden - 1.0).abs() < 1e-9, "{name}: {value}");
    }
}

#[test]
fn values_and_their_names_are_as_many() {
    for windows in both(&signal()) {
        assert_eq!(windows.measure(secs(0, 60)).values.len(), windows.values().len());
        assert_eq!(windows.measure(secs(900, 960)).values.len(), windows.values().len());
    }
}

#[test]
fn absurd_rates_and_no_channels_are_survived() {
    for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY, -5.0] {
        assert!(causal(&Settings::default(), rate_hz).is_err());
        let recording = Recording { rate_hz, begin_ns: 0, channels: &[vec![0.0; 50]] };
        assert!(whole(&Settings::default(), &recording).is_err());
    }
    for mains_hz in [0.0, -1.0, f64::NAN, 1e9].map(Some) {
        assert!(causal(&Settings { mains_hz, ..Settings::default() }, RATE_HZ).is_err());
    }
    for channels in [&[][..], &[vec![]], &[vec![1.0]]] {
        let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels };
        let whole = whole(&Settings::default(), &recording).expect("a usual rate");
        assert!(whole.events.is_empty());
        assert!(whole.windows.measure(secs(0, 60)).values.iter().all(Result::is_err));
    }
    let mut analysis = causal(&Settings::default(), RATE_HZ).expect("a usual rate");
    analysis.push(0, &[]);
    assert!(analysis.measure(secs(0, 60)).values.iter().all(Result::is_err));
}

fn bits(measured: &Measured) -> Vec<Result<u64, Reason>> {
    let values = measured.values.iter().map(|value| value.map(f64::to_bits));
    values.chain([Ok(measured.coverage.to_bits()), Ok(measured.quality.to_bits())]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn chunks_of_any_length_give_the_same_bits(chunk in 1..4097usize) {
        let mut signal: Vec<f64> =
            signal().iter().zip(noise(30_000)).map(|(value, noise)| value + 0.2 * noise).collect();
        signal[5_000..5_300].fill(f64::NAN);
        let (all, events) = live(&signal, RATE_HZ);
        let mut analysis = causal(&Settings::default(), RATE_HZ).expect("a usual rate");
        let mut chunked = Vec::new();
        for (begin, chunk) in signal.chunks(chunk).enumerate().map(|(k, part)| (k * chunk, part)) {
            for (k, &sample) in (begin..).zip(chunk) {
                analysis.push((k as f64 / RATE_HZ * 1e9).round() as i64, &[sample]);
            }
            chunked.extend(std::iter::from_fn(|| analysis.next_event()));
            analysis.forget(((begin + chunk.len()) as f64 / RATE_HZ * 1e9) as i64 - 60 * SEC);
        }
        prop_assert_eq!(format!("{chunked:?}"), format!("{events:?}"));
        let span = secs(62, 122);
        prop_assert_eq!(bits(&all.measure(span)), bits(&analysis.measure(span)));
    }

    #[test]
    fn any_input_is_survived(
        signal in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0], 0..3000),
        rate_hz in 80.0..4000.0,
        begin_ns in any::<i64>(),
        end_ns in any::<i64>(),
    ) {
        let windows = [live(&signal, rate_hz).0 as Box<dyn Windows>, recorded(&signal, rate_hz).windows];
        for windows in windows {
            for span in [Span { begin_ns, end_ns }, secs(0, 1), secs(0, 10)] {
                let measured = windows.measure(span);
                prop_assert!((0.0..=1.0).contains(&measured.quality));
                prop_assert!((0.0..=1.0).contains(&measured.coverage));
                prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
            }
        }
    }
}
