//! Values of spans with heart beats, and what they must not depend on.

use proptest::prelude::*;
use teampulse_signal::analysis::{Measured, Reason, Recording, Span, Windows};
use teampulse_signal::hrv::analysis;
use teampulse_signal::hrv::{
    Domain, HeartWindows, Recipe, Treatment, frequency_domain, time_domain,
};
use teampulse_signal::intervals::Edit;

const SEC: i64 = 1_000_000_000;

fn secs(begin: i64, end: i64) -> Span {
    Span { begin_ns: begin * SEC, end_ns: end * SEC }
}

/// Beats without artefacts [ns]: two waves and none of the noise that looks like one now and then.
fn beats(count: u32) -> Vec<i64> {
    let mut at_ns = 0;
    let beat = |k: u32| {
        let waves = 40.0 * (0.55 * f64::from(k)).sin() + 25.0 * (0.09 * f64::from(k)).sin();
        at_ns += ((850.0 + waves) * 1e6) as i64;
        at_ns
    };
    std::iter::once(0).chain((0..count).map(beat)).collect()
}

fn causal(beats: &[i64]) -> HeartWindows {
    let mut heart = HeartWindows::causal();
    for &beat in beats {
        heart.push(beat);
    }
    heart
}

fn whole(beats: &[i64]) -> HeartWindows {
    HeartWindows::whole(0, beats, &[], &[])
}

fn value(heart: &HeartWindows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    measured.values[heart.values().iter().position(|each| each.name == name).expect(name)]
}

fn of(heart: &HeartWindows, span: Span, name: &str) -> Result<f64, Reason> {
    value(heart, &heart.measure(span), name)
}

/// As text, by which NaN is itself.
fn text(measured: &Measured) -> String {
    format!("{measured:?}")
}

#[test]
fn a_window_gives_what_its_intervals_give() {
    let beats = beats(800);
    let span = secs(100, 400);
    let inside: Vec<i64> = beats.iter().copied().filter(|&beat| span.holds(beat)).collect();
    let nn: Vec<f64> = inside.windows(2).map(|pair| (pair[1] - pair[0]) as f64 / 1e6).collect();
    let ends_secs: Vec<f64> = inside[1..].iter().map(|&beat| beat as f64 / 1e9).collect();
    let time = time_domain(&nn).unwrap();
    let frequency = frequency_domain(&ends_secs, &nn, &Recipe::default()).unwrap();
    for heart in [causal(&beats), whole(&beats)] {
        let measured = heart.measure(span);
        let expected = [
            ("HRV_N", nn.len() as f64),
            ("HRV_MeanNN", time.mean_nn_ms),
            ("HRV_RMSSD", time.rmssd_ms),
            ("HRV_LF", frequency.lf_ms2),
            ("HRV_LFHF", frequency.lf_hf()),
            ("HRV_Corrected", 0.0),
        ];
        for (name, expected) in expected {
            let value = value(&heart, &measured, name).unwrap();
            assert!(
                (value - expected).abs() <= 1e-9 * expected.abs(),
                "{name}: {value} {expected}"
            );
        }
        let lacking =
            heart.values().iter().zip(&measured.values).filter(|(_, value)| value.is_err());
        let lacking: Vec<&str> = lacking.map(|(value, _)| value.name.as_ref()).collect();
        assert_eq!(lacking, ["HRV_SDANN5", "HRV_SDNNI5"]);
        assert!(measured.coverage > 0.999 && measured.quality >= 1.0, "{measured:?}");
    }
}

#[test]
fn what_is_too_short_for_a_value_has_a_reason() {
    let heart = causal(&beats(900));
    let short = |secs_long: i64, name: &str| of(&heart, secs(200, 200 + secs_long), name);
    for (least, name) in
        [(300, "HRV_VLF"), (300, "HRV_TP"), (120, "HRV_LF"), (120, "HRV_LFHF"), (60, "HRV_HF")]
    {
        assert_eq!(short(least - 1, name), Err(Reason::Short), "{name}");
        assert!(short(least, name).is_ok(), "{name}");
    }
    assert!(short(8, "HRV_MeanNN").is_ok());
    for name in ["HRV_RMSSD", "HRV_SDNN", "HRV_SampEn", "HRV_DFA_alpha1", "HRV_HTI", "HRV_PIP"] {
        assert_eq!(short(8, name), Err(Reason::Short), "{name}");
        assert!(short(300, name).is_ok(), "{name}");
    }
    assert_eq!(short(200, "HRV_DFA_alpha2"), Err(Reason::Short));
    assert_eq!(short(80, "HRV_SDANN1"), Err(Reason::Short));
    assert!(short(120, "HRV_SDANN1").is_ok() && short(600, "HRV_SDNNI5").is_ok());
    assert_eq!(short(300, "HRV_SDNNI5"), Err(Reason::Short));
}

#[test]
fn uncorrected_values_stand_beside_corrected_ones() {
    let mut missed = beats(200);
    missed.remove(100);
    let span = secs(40, 140);
    let inside: Vec<i64> = missed.iter().copied().filter(|&beat| span.holds(beat)).collect();
    let rr: Vec<f64> = inside.windows(2).map(|pair| (pair[1] - pair[0]) as f64 / 1e6).collect();
    let detected = time_domain(&rr).unwrap();
    for heart in [causal(&missed), whole(&missed), whole(&missed).treated(Treatment::AsTheyAre)] {
        let measured = heart.measure(span);
        for (name, expected) in [
            ("HRV_Uncorrected_MeanNN", detected.mean_nn_ms),
            ("HRV_Uncorrected_SDNN", detected.sdnn_ms),
            ("HRV_Uncorrected_RMSSD", detected.rmssd_ms),
        ] {
            let value = value(&heart, &measured, name).unwrap();
            assert!((value / expected - 1.0).abs() < 1e-9, "{name}: {value} {expected}");
        }
    }
    let corrected = of(&whole(&missed), span, "HRV_RMSSD").unwrap();
    assert!(corrected < 0.5 * detected.rmssd_ms, "{corrected} {}", detected.rmssd_ms);
}

#[test]
fn what_is_said_of_segments_is_true_for_short_windows() {
    let heart = causal(&beats(200));
    let measured = heart.measure(secs(60, 120));
    let place = heart.values().iter().position(|value| value.name == "HRV_HF").unwrap();
    assert!(measured.values[place].is_ok());
    assert!(heart.values()[place].method.contains("a single one of shorter recordings"));
}

#[test]
fn a_missed_beat_is_put_back_and_counted() {
    let clean = beats(200);
    let mut missed = clean.clone();
    missed.remove(100);
    let span = secs(40, 140);
    for (heart, clean) in [(causal(&missed), causal(&clean)), (whole(&missed), whole(&clean))] {
        let measured = heart.measure(span);
        assert_eq!(value(&heart, &measured, "HRV_Missed"), Ok(1.0));
        assert_eq!(value(&heart, &measured, "HRV_N"), of(&clean, span, "HRV_N"));
        let percent = value(&heart, &measured, "HRV_Corrected").unwrap();
        assert!(percent > 0.8 && percent < 1.0, "{percent}");
        assert!((measured.quality - 1.0 / (1.0 + percent / 5.0)).abs() < 1e-12);
    }
    // A span that does not contain it has no results about it.
    assert_eq!(of(&causal(&missed), secs(90, 140), "HRV_Missed"), Ok(0.0));
}

#[test]
fn nothing_is_computed_across_a_hole() {
    let all = beats(400);
    let hole = (100 * SEC, 110 * SEC);
    let seen: Vec<i64> =
        all.iter().copied().filter(|beat| !(hole.0..hole.1).contains(beat)).collect();
    let mut marked = causal(&seen);
    marked.mark_gap(hole.0, hole.1);
    let holed = HeartWindows::whole(0, &seen, &[hole], &[]);
    // Ten seconds without a beat are a hole even if nobody says so.
    for heart in [marked, holed, causal(&seen)] {
        let measured = heart.measure(secs(60, 180));
        assert_eq!(value(&heart, &measured, "HRV_Corrected"), Ok(0.0));
        assert!((measured.coverage - 110.0 / 120.0).abs() < 0.01, "{}", measured.coverage);
        assert!(value(&heart, &measured, "HRV_MaxNN").unwrap() < 1000.0);
        assert_eq!(value(&heart, &measured, "HRV_LF"), Err(Reason::Gap));
        assert!(value(&heart, &measured, "HRV_LF_Lomb").is_ok());
        let half = heart.measure(secs(99, 109));
        assert!(half.values.iter().all(|each| *each == Err(Reason::Gap)), "{half:?}");
    }
}

#[test]
fn a_short_hole_has_no_interval_across_it() {
    let all = beats(100);
    let mut heart = causal(&all);
    let span = secs(10, 70);
    let before = of(&heart, span, "HRV_N").unwrap();
    heart.mark_gap(all[40] + 300_000_000, all[40] + 500_000_000);
    assert_eq!(of(&heart, span, "HRV_N"), Ok(before - 1.0));
}

#[test]
fn what_was_forgotten_and_when_a_beat_became_known_does_not_matter() {
    let mut all = beats(900);
    all.remove(500);
    all[600] += 200_000_000;
    let remembers = causal(&all);
    let mut forgets = HeartWindows::causal();
    let mut order = all.clone();
    // Each tenth beat becomes known after the next one.
    (10..order.len()).step_by(10).for_each(|place| order.swap(place, place - 1));
    let mut next = 300;
    for beat in order {
        forgets.push(beat);
        if beat > (next + 2) * SEC {
            let span = secs(next - 300, next);
            forgets.forget(span.begin_ns);
            for begin in [span.begin_ns, span.end_ns - 30 * SEC] {
                let span = Span { begin_ns: begin, ..span };
                assert_eq!(text(&forgets.measure(span)), text(&remembers.measure(span)));
            }
            next += 20;
        }
    }
}

#[test]
fn a_persons_edits_lie_over_the_beats_of_a_whole_recording() {
    let clean = beats(200);
    let mut disturbed = clean.clone();
    disturbed[100] += 250_000_000;
    let at_secs = disturbed[100] as f64 / 1e9;
    let edits = [Edit::Move { from_secs: at_secs, to_secs: clean[100] as f64 / 1e9 }];
    let span = secs(0, 170);
    let edited = HeartWindows::whole(0, &disturbed, &[], &edits);
    assert_eq!(of(&edited, span, "HRV_Corrected"), Ok(0.0));
    let rmssd = |heart: &HeartWindows| of(heart, span, "HRV_RMSSD").unwrap();
    assert!((rmssd(&edited) - rmssd(&whole(&clean))).abs() < 1e-5);
    assert!(of(&whole(&disturbed), span, "HRV_Corrected").unwrap() > 0.0);
}

#[test]
fn a_domain_alone_gives_the_same() {
    let heart = causal(&beats(500));
    let span = secs(60, 360);
    let all = heart.measure(span);
    for domain in Domain::ALL {
        let alone = heart.measure_domain(span, domain);
        assert_eq!(alone.values, all.values[heart.places(domain)]);
        let only = heart.clone().only(&[domain]);
        assert_eq!(text(&only.measure(span)), text(&alone));
        assert_eq!(only.values(), &heart.values()[heart.places(domain)]);
        assert_eq!(only.places(domain), 0..alone.values.len());
    }
}

#[test]
fn only_nonlinear_values_are_held() {
    let heart = causal(&beats(600));
    let (before, now) = (secs(60, 360), secs(65, 365));
    let (last, whole) = (heart.measure(before), heart.measure(now));
    let held = heart.measure_again(now, &last);
    let nonlinear = heart.places(Domain::Nonlinear);
    assert_eq!(held.values[nonlinear.clone()], last.values[nonlinear.clone()]);
    assert_ne!(held.values[nonlinear.clone()], whole.values[nonlinear.clone()]);
    assert_eq!(held.values[..nonlinear.start], whole.values[..nonlinear.start]);
    assert_eq!((held.coverage, held.quality), (whole.coverage, whole.quality));
}

#[test]
fn what_is_held_covers_no_gap_and_no_lack_of_beats() {
    let heart = causal(&beats(200));
    let last = heart.measure(secs(60, 160));
    for (begin, end) in [(140, 240), (120, 200), (300, 400)] {
        let now = secs(begin, end);
        let (whole, held) = (heart.measure(now), heart.measure_again(now, &last));
        let reasons = |measured: &Measured| {
            measured.values.iter().map(|value| value.err()).collect::<Vec<_>>()
        };
        assert!(reasons(&whole).iter().any(Option::is_some));
        assert_eq!(reasons(&whole), reasons(&held));
    }
}

#[test]
fn a_reason_that_is_over_is_not_held() {
    let heart = causal(&beats(600));
    let now = secs(60, 360);
    for poor in [secs(-280, 20), secs(600, 900)] {
        let last = heart.measure(poor);
        assert_eq!(heart.measure_again(now, &last), heart.measure(now));
    }
}

proptest! {
    #[test]
    fn nothing_panics(
        beats in prop::collection::vec(prop_oneof![any::<i64>(), 0..100 * SEC], 0..80),
        holes in prop::collection::vec((any::<i64>(), any::<i64>()), 0..4),
        small in prop::collection::vec((0..100 * SEC, 0..100 * SEC), 0..4),
        spans in prop::collection::vec((any::<i64>(), any::<i64>()), 1..4),
        forgotten in any::<i64>(),
    ) {
        let mut heart = causal(&beats);
        let holes = [holes, small].concat();
        for &(from, to) in &holes {
            heart.mark_gap(from, to);
        }
        let whole = HeartWindows::whole(beats.first().copied().unwrap_or(0), &beats, &holes, &[]);
        let spans = spans.iter().map(|&(begin_ns, end_ns)| Span { begin_ns, end_ns });
        for span in spans.chain([secs(0, 100), Span { begin_ns: i64::MIN, end_ns: i64::MAX }]) {
            for measured in [heart.measure(span), whole.measure(span)] {
                prop_assert!((0.0..=1.0).contains(&measured.coverage));
                prop_assert!((0.0..=1.0).contains(&measured.quality));
                prop_assert_eq!(measured.values.len(), heart.values().len());
                prop_assert!(measured.values.iter().flatten().all(|each| each.is_finite()));
            }
        }
        heart.forget(forgotten);
        heart.measure(secs(0, 100));
    }
}

#[test]
fn intervals_lie_where_their_times_say_and_gaps_stay_gaps() {
    // A minute of beats, two minutes of nothing, a minute of beats.
    let interval_ms = |k: usize| 800.0 + 20.0 * (k as f64).sin();
    let runs = [(0.0, 75), (180.0, 75)];
    let (mut intervals_ms, mut ends_secs) = (Vec::new(), Vec::new());
    for (begin_secs, count) in runs {
        let mut end_secs = begin_secs;
        for k in 0..count {
            end_secs += interval_ms(k) / 1e3;
            intervals_ms.push(interval_ms(k));
            ends_secs.push(end_secs);
        }
    }
    let channels = [intervals_ms, ends_secs];
    let recording = Recording { rate_hz: 1.0, begin_ns: 5_000_000_000, channels: &channels };
    let settings = analysis::Settings { treatment: Treatment::AsTheyAre, ..Default::default() };
    let analysed = analysis::whole(&settings, &recording).unwrap();
    let coverage = |begin_secs: i64, end_secs: i64| {
        let ns = |secs: i64| (5 + secs) * 1_000_000_000;
        analysed.windows.measure(Span { begin_ns: ns(begin_secs), end_ns: ns(end_secs) }).coverage
    };
    assert!((coverage(0, 60) - 1.0).abs() < 0.02, "{}", coverage(0, 60));
    assert!((coverage(0, 240) - 0.5).abs() < 0.02, "{}", coverage(0, 240));
    assert!(coverage(70, 170) < 0.01, "{}", coverage(70, 170));
    assert_eq!(analysed.events.iter().filter(|beat| beat.at_ns < 70_000_000_000).count(), 75);
}

#[test]
fn intervals_as_they_are_give_what_the_formulas_give() {
    // Every 20th interval is wrong.
    let interval = |k: u32| if k % 20 == 7 { 400.0 } else { 800.0 + f64::from(k * k % 40) };
    let intervals_ms: Vec<f64> = (0..200).map(interval).collect();
    let channels = [intervals_ms.clone()];
    let recording = Recording { rate_hz: 1.0, begin_ns: 0, channels: &channels };
    let rmssd = |treatment| {
        let settings = analysis::Settings { treatment, ..analysis::Settings::default() };
        let windows = analysis::whole(&settings, &recording).unwrap().windows;
        let place = windows.values().iter().position(|value| value.name == "HRV_RMSSD").unwrap();
        windows.measure(Span { begin_ns: 0, end_ns: 200_000_000_000 }).values[place].unwrap()
    };
    let expected = time_domain(&intervals_ms).unwrap().rmssd_ms;
    assert!((rmssd(Treatment::AsTheyAre) / expected - 1.0).abs() < 1e-9);
    assert!(rmssd(Treatment::Corrected) < 0.5 * expected);
}
