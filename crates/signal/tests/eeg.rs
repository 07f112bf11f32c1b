//! Laws of the analysis of EEGs, on made-up ones, and golden values from SciPy.
#![expect(clippy::float_cmp, reason = "the arithmetic is the same, bit for bit")]

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/eeg.rs"]
mod golden;

use std::f64::consts::TAU;

use proptest::prelude::*;
use teampulse_signal::analysis::{Causal, Event, Measured, Reason, Recording, Span, Windows};
use teampulse_signal::eeg::analysis::{Blinks, Settings, causal, whole};
use teampulse_signal::eeg::{Band, Powers, alpha_frequency, clean, cleaning, slope, spectrum};
use teampulse_signal::filter::Cascade;

const RATE_HZ: f64 = 256.0;
const SECOND_NS: i64 = 1_000_000_000;
const MUSE: [&str; 4] = ["TP9", "AF7", "AF8", "TP10"];

/// The script's signal.
fn made_up(count: u32, rate_hz: f64) -> Vec<f64> {
    let value = |k: u32| {
        let noise = f64::from(k * 7919 % 1009) / 504.5 - 1.0;
        let wave = |hz: f64| (TAU * hz * f64::from(k) / rate_hz).sin();
        let waves = 25.0 * wave(9.6) + 40.0 * wave(2.2) + 60.0 * wave(50.0);
        4000.0 + 0.01 * f64::from(k) + 30.0 * noise + waves
    };
    (0..count).map(value).collect()
}

#[test]
fn bands_and_indices_are_those_of_scipy() {
    let golden = [
        (7000, 256.0, golden::AT_256_HZ),
        (3333, 125.0, golden::AT_125_HZ),
        (3333, 130.4, golden::AT_130_4_HZ),
    ];
    for (count, rate_hz, theirs) in golden {
        let spectrum = spectrum(&made_up(count, rate_hz), rate_hz).unwrap();
        let powers = Powers::of(&spectrum).unwrap();
        let alpha = alpha_frequency(&spectrum).unwrap();
        let mut ours: Vec<f64> = Band::ALL.map(|band| powers.uv2(band)).to_vec();
        ours.extend([alpha.peak_hz.unwrap(), alpha.centre_hz, slope(&spectrum).unwrap()]);
        for (ours, theirs) in ours.iter().zip(theirs) {
            // Transforms of other lengths round otherwise.
            assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs} at {rate_hz} Hz");
        }
    }
}

#[test]
fn cleaned_samples_are_those_of_scipy() {
    let signal = made_up(2000, RATE_HZ);
    let mut filter = Cascade::settled(&cleaning(RATE_HZ, 50.0).unwrap());
    let causal: Vec<f64> = signal.iter().map(|&sample| filter.push(sample)).collect();
    let whole = clean(&signal, RATE_HZ, 50.0).unwrap();
    for (ours, theirs) in [(causal, golden::CAUSAL), (whole, golden::WHOLE)] {
        for (ours, theirs) in ours.iter().step_by(200).zip(theirs) {
            // Relative to the range of the signal.
            assert!((ours - theirs).abs() < 1e-9 * 200.0, "{ours} {theirs}");
        }
    }
}

fn noise(k: usize, channel: usize) -> f64 {
    let bits = ((k * 8 + channel) as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / 8_388_608.0 - 1.0
}

/// Alpha and theta of a channel, noise that wanders, and a blink each five seconds in two channels.
fn channel(channel: usize, secs: usize) -> Vec<f64> {
    let mut wander = 0.0;
    let value = |k: usize| {
        let secs = k as f64 / RATE_HZ;
        wander = 0.95 * wander + 2.0 * noise(k, channel);
        let wave = |hz: f64| (TAU * hz * secs).sin();
        let blink = 160.0 * (-((secs % 5.0 - 2.5) / 0.05).powi(2) / 2.0).exp();
        let eyes = if channel == 1 || channel == 2 { blink } else { 0.0 };
        800.0 + wander + (10.0 + 4.0 * channel as f64) * wave(10.0) + 8.0 * wave(6.0) + eyes
    };
    (0..secs * RATE_HZ as usize).map(value).collect()
}

fn muse(secs: usize) -> Vec<Vec<f64>> {
    (0..4).map(|index| channel(index, secs)).collect()
}

fn settings(channels: &[&str]) -> Settings {
    let channels = channels.iter().map(ToString::to_string).collect();
    Settings { channels, ..Settings::default() }
}

fn recording(channels: &[Vec<f64>]) -> Recording<'_> {
    Recording { rate_hz: RATE_HZ, begin_ns: 0, channels }
}

fn span(begin_secs: i64, end_secs: i64) -> Span {
    Span { begin_ns: begin_secs * SECOND_NS, end_ns: end_secs * SECOND_NS }
}

fn push_all(analysis: &mut dyn Causal, channels: &[Vec<f64>]) -> Vec<Event> {
    let recording = recording(channels);
    let mut events = Vec::new();
    for k in 0..recording.len() {
        let sample: Vec<f64> = channels.iter().map(|channel| channel[k]).collect();
        analysis.push(recording.time_ns(k as f64), &sample);
        events.extend(std::iter::from_fn(|| analysis.next_event()));
    }
    events
}

fn named(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    let index = windows.values().iter().position(|value| value.name == name);
    measured.values[index.unwrap_or_else(|| panic!("there is no {name}"))]
}

#[test]
fn live_and_afterwards_all_but_blinks_is_the_same_bit_for_bit() {
    let channels = muse(60);
    let mut live = causal(&settings(&MUSE), RATE_HZ).unwrap();
    push_all(&mut *live, &channels);
    let after = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    for span in [span(0, 60), span(10, 40), span(7, 20)] {
        let (live_values, after_values) = (live.measure(span), after.windows.measure(span));
        assert_eq!(live_values.quality, after_values.quality);
        assert_eq!(live_values.coverage, after_values.coverage);
        let names = live.values().iter().zip(after.windows.values());
        for (index, (one, other)) in names.enumerate() {
            assert_eq!(one.name, other.name);
            if !one.name.starts_with("EEG_Blink") {
                assert_eq!(live_values.values[index], after_values.values[index], "{}", one.name);
            }
        }
    }
}

#[test]
fn a_window_is_welch_over_its_whole_segments() {
    let channels = muse(40);
    let after = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    let measured = after.windows.measure(span(8, 30));
    let inside = &channels[3][8 * 256..30 * 256];
    let powers = Powers::of(&spectrum(inside, RATE_HZ).unwrap()).unwrap();
    let alpha = named(&*after.windows, &measured, "EEG_Alpha/TP10").unwrap();
    assert_eq!(alpha, powers.uv2(Band::Alpha));
    assert_eq!(measured.coverage, 1.0);
}

#[test]
fn asking_and_forgetting_change_nothing() {
    let channels = muse(45);
    let mut one = causal(&settings(&MUSE), RATE_HZ).unwrap();
    let mut other = causal(&settings(&MUSE), RATE_HZ).unwrap();
    let mut events = push_all(&mut *one, &channels);
    for k in 0..45 * 256 {
        let sample: Vec<f64> = channels.iter().map(|channel| channel[k]).collect();
        other.push(recording(&channels).time_ns(k as f64), &sample);
        if k % 256 == 0 && k > 20 * 256 {
            let end = (k / 256) as i64;
            other.forget((end - 20) * SECOND_NS);
            other.measure(span(end - 20, end));
        }
        if let Some(event) = other.next_event() {
            assert_eq!(event, events.remove(0));
        }
    }
    assert_eq!(events, []);
    assert_eq!(one.measure(span(25, 45)), other.measure(span(25, 45)));
}

#[test]
fn blinks_are_events_and_counted_live_and_afterwards() {
    let channels = muse(60);
    let mut live = causal(&settings(&MUSE), RATE_HZ).unwrap();
    let live_events = push_all(&mut *live, &channels);
    let after = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    for (events, windows) in
        [(&live_events, &*live as &dyn Windows), (&after.events, &*after.windows)]
    {
        assert_eq!(events.len(), 12);
        for (event, at_secs) in events.iter().zip((0..).map(|k| 2.5 + 5.0 * f64::from(k))) {
            assert_eq!(event.kind, "blink");
            assert!((event.at_ns as f64 / 1e9 - at_secs).abs() < 0.02, "{event:?}");
            assert!((event.sample / RATE_HZ - at_secs).abs() < 0.02, "{event:?}");
        }
        let measured = windows.measure(span(0, 60));
        let rate = named(windows, &measured, "EEG_BlinkRate").unwrap();
        assert!((rate - 12.0).abs() < 1e-9);
        let height = named(windows, &measured, "EEG_BlinkAmplitude").unwrap();
        assert!((130.0..190.0).contains(&height), "{height}");
        let secs = named(windows, &measured, "EEG_BlinkDuration").unwrap();
        assert!((0.1..0.15).contains(&secs), "{secs}");
    }
}

#[test]
fn more_than_a_hundred_blinks_a_minute_are_none() {
    let flutter = |k: usize| {
        let secs = k as f64 / RATE_HZ;
        let moved = if secs % 8.0 < 4.0 { 60.0 } else { 0.0 };
        3.0 * noise(k, 0) + moved * (TAU * 5.5 * secs).sin()
    };
    let channels = [(0..60 * RATE_HZ as usize).map(flutter).collect::<Vec<f64>>()];
    let after = whole(&settings(&["Fp1"]), &recording(&channels)).unwrap();
    assert!(after.events.len() > 100, "{}", after.events.len());
    let measured = after.windows.measure(span(0, 60));
    assert_eq!(named(&*after.windows, &measured, "EEG_BlinkRate"), Err(Reason::Quality));
}

#[test]
fn tones_lower_the_quality_and_do_not_raise_it() {
    let quality = |tone: f64, hz: f64| {
        let mut wander = 0.0;
        let value = |k: usize| {
            wander = 0.95 * wander + 2.0 * noise(k, 0);
            wander + tone * (TAU * hz * k as f64 / RATE_HZ).sin()
        };
        let channels = [(0..60 * RATE_HZ as usize).map(value).collect::<Vec<f64>>()];
        whole(&settings(&["Pz"]), &recording(&channels))
            .unwrap()
            .windows
            .measure(span(0, 60))
            .quality
    };
    let clean = quality(0.0, 1.0);
    assert!(clean > 0.5, "{clean}");
    for hz in [1.8, 16.7, 25.0] {
        assert!(quality(25.0, hz) < 0.5 * clean, "{hz}: {}", quality(25.0, hz));
    }
}

#[test]
fn segments_with_blinks_can_be_left_out() {
    let channels = muse(60);
    let kept = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    let left_out = Settings { blinks: Blinks::LeftOut, ..settings(&MUSE) };
    let left_out = whole(&left_out, &recording(&channels)).unwrap();
    // With a blink each five seconds, a segment of four seconds in five has one.
    let measured = left_out.windows.measure(span(0, 60));
    assert!((0.05..0.45).contains(&measured.coverage), "{}", measured.coverage);
    assert_eq!(named(&*left_out.windows, &measured, "EEG_Theta/AF7"), Err(Reason::Quality));
    assert_eq!(kept.windows.measure(span(0, 60)).coverage, 1.0);
    assert!(left_out.windows.values()[0].method.contains("with a blink"));
}

#[test]
fn indices_are_of_the_channels_that_their_names_give() {
    let channels = muse(20);
    let after = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    let measured = after.windows.measure(span(0, 20));
    let reported = |name: &str| named(&*after.windows, &measured, name);
    let (left, right) = (reported("EEG_Alpha/AF7").unwrap(), reported("EEG_Alpha/AF8").unwrap());
    assert_eq!(reported("EEG_Asymmetry/AF8-AF7"), Ok((right / left).ln()));
    assert!(right > left);
    assert_eq!(reported("EEG_Workload"), Err(Reason::Missing));
    let mean =
        MUSE.map(|name| reported(&format!("EEG_Alpha/{name}")).unwrap()).iter().sum::<f64>() / 4.0;
    assert!((reported("EEG_Alpha").unwrap() / mean - 1.0).abs() < 1e-12);
    assert_eq!(reported("EEG_AlphaPeak"), Ok(10.0));

    let names = ["Fz", "Pz", "O1", "O2"];
    let after = whole(&settings(&names), &recording(&channels)).unwrap();
    let measured = after.windows.measure(span(0, 20));
    let reported = |name: &str| named(&*after.windows, &measured, name);
    let ratio = reported("EEG_Theta/Fz").unwrap() / reported("EEG_Alpha/Pz").unwrap();
    assert_eq!(reported("EEG_Workload"), Ok(ratio));
    assert_eq!(reported("EEG_Asymmetry"), Err(Reason::Missing));

    let after = whole(&settings(&["O1", "O2"]), &recording(&channels[..2])).unwrap();
    let measured = after.windows.measure(span(0, 20));
    assert_eq!(named(&*after.windows, &measured, "EEG_BlinkRate"), Err(Reason::Missing));
}

#[test]
fn what_is_short_missing_or_poor_has_its_reason() {
    let mut channels = muse(60);
    channels[0].fill(f64::NAN);
    channels[3].iter_mut().for_each(|value| *value *= 100.0);
    channels[2][20 * 256..].fill(f64::NAN);
    let after = whole(&settings(&MUSE), &recording(&channels)).unwrap();
    let reported =
        |span: Span, name: &str| named(&*after.windows, &after.windows.measure(span), name);
    assert_eq!(reported(span(0, 30), "EEG_Alpha/TP9"), Err(Reason::Gap));
    assert_eq!(reported(span(0, 30), "EEG_Alpha/TP10"), Err(Reason::Quality));
    assert!(reported(span(0, 30), "EEG_Quality/TP10").unwrap() < 0.1);
    assert!(reported(span(0, 30), "EEG_Alpha/AF8").is_ok());
    assert_eq!(reported(span(15, 45), "EEG_Alpha/AF8"), Err(Reason::Gap));
    assert!(reported(span(15, 45), "EEG_Alpha").is_ok());
    assert_eq!(reported(span(0, 3), "EEG_Alpha/AF7"), Err(Reason::Short));
    assert_eq!(reported(span(70, 100), "EEG_Alpha/AF7"), Err(Reason::Gap));
    assert_eq!(after.windows.measure(span(70, 100)).coverage, 0.0);
}

#[test]
fn settings_and_rates_that_do_not_fit_are_refused() {
    for rate_hz in [0.0, 1e-9, 99.0, 1e9, f64::NAN, f64::INFINITY] {
        assert!(causal(&settings(&MUSE), rate_hz).is_err());
        assert!(
            whole(&settings(&MUSE), &Recording { rate_hz, begin_ns: 0, channels: &[] }).is_err()
        );
    }
    assert!(causal(&settings(&[]), RATE_HZ).is_err());
    assert!(causal(&settings(&["F3"; 257]), RATE_HZ).is_err());
    let limit = Settings { most_rms_uv: f64::NAN, ..settings(&MUSE) };
    assert!(causal(&limit, RATE_HZ).is_err());
    // Fewer channels than named are missing, more are left alone.
    let few = whole(&settings(&MUSE), &recording(&muse(20)[..1])).unwrap();
    let measured = few.windows.measure(span(0, 20));
    assert!(named(&*few.windows, &measured, "EEG_Alpha/TP9").is_ok());
    assert_eq!(named(&*few.windows, &measured, "EEG_Alpha/AF7"), Err(Reason::Gap));
    assert!(whole(&settings(&["F3"]), &recording(&muse(20))).is_ok());
}

fn assert_sane(measured: &Measured, windows: &dyn Windows) {
    assert_eq!(measured.values.len(), windows.values().len());
    assert!((0.0..=1.0).contains(&measured.coverage) && (0.0..=1.0).contains(&measured.quality));
    assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_samples_times_and_spans_are_survived(
        samples in prop::collection::vec(prop::num::f64::ANY, 1..1500),
        times in prop::collection::vec(any::<i64>(), 1..10),
        spans in prop::collection::vec(any::<(i64, i64)>(), 1..10),
        rate_hz in 100.0..300.0f64,
    ) {
        let settings = settings(&["Fp1", "Pz"]);
        let mut live = causal(&settings, rate_hz).unwrap();
        let mut times = times;
        times.sort_unstable();
        for (k, &sample) in samples.iter().enumerate() {
            live.push(times[k * times.len() / samples.len()], &[sample]);
        }
        let channels = [samples.clone(), samples];
        let recording = Recording { rate_hz, begin_ns: times[0], channels: &channels };
        let after = whole(&settings, &recording).unwrap();
        for (begin_ns, end_ns) in spans {
            let span = Span { begin_ns, end_ns };
            assert_sane(&live.measure(span), &*live);
            assert_sane(&after.windows.measure(span), &*after.windows);
            live.forget(begin_ns);
        }
        assert_sane(&after.windows.measure(recording.span()), &*after.windows);
    }
}
