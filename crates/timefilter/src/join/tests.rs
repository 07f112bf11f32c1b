use proptest::prelude::*;

use super::*;

/// Pseudo-random numbers from 0 to 1.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn around(&mut self, sigma: f64) -> f64 {
        let sum: f64 = (0..12).map(|_| self.next()).sum();
        sigma * (sum - 6.0)
    }
}

/// The beats of a heart with breathing and slower oscillations over `secs`.
fn beats(secs: f64, chance: &mut Chance) -> Vec<f64> {
    let (mut at, mut beats) = (0.0_f64, Vec::new());
    while at < secs {
        beats.push(at);
        at += 0.85 + 0.04 * (1.5 * at).sin() + 0.03 * (0.6 * at).sin() + chance.around(0.015);
    }
    beats
}

/// The beats that a device records: late by `delay_secs`, with a clock that has an offset and a skew, some
/// missed.
fn recorded(beats: &[f64], offset_secs: f64, skew_ppm: f64, chance: &mut Chance) -> Vec<f64> {
    let device = |secs: f64| (secs - offset_secs) / (1.0 + skew_ppm * 1e-6);
    let kept: Vec<f64> = beats.iter().copied().filter(|_| chance.next() > 0.05).collect();
    kept.into_iter().map(|beat| device(beat + 0.25 + chance.around(0.006))).collect()
}

fn search() -> Search {
    Search { delay: Latency::new(0.25, 0.01), ..Search::default() }
}

#[test]
fn offset_and_skew_of_an_hour_are_found() {
    let mut chance = Chance(1);
    let session = beats(3600.0, &mut chance);
    for (offset_secs, skew_ppm) in [(0.0, 0.0), (-3600.5, 100.0), (86_400.25, -100.0)] {
        let recording = recorded(&session, offset_secs, skew_ppm, &mut chance);
        let found = by_beats(&session, &recording, &search()).unwrap();
        for at in [recording[0], recording[recording.len() - 1]] {
            let truth = at * (1.0 + skew_ppm * 1e-6) + offset_secs;
            let off = (found.session_from_device(at) - truth).abs();
            assert!(off < 0.003 && off < found.uncertainty_secs(at), "{off}: {found:?}");
        }
        assert!((found.skew_ppm - skew_ppm).abs() < 2.0, "{found:?}");
    }
}

#[test]
fn a_part_that_lasts_two_minutes_is_found_with_the_doubt_about_its_skew() {
    let mut chance = Chance(2);
    let session = beats(1800.0, &mut chance);
    let part: Vec<f64> =
        session.iter().copied().filter(|secs| (600.0..720.0).contains(secs)).collect();
    let recording = recorded(&part, 1000.0, 0.0, &mut chance);
    let found = by_beats(&session, &recording, &search()).unwrap();
    assert!((found.session_from_device(-340.0) - 660.0).abs() < 0.005, "{found:?}");
    assert_eq!((found.skew_ppm, found.skew_uncertainty_ppm()), (0.0, UNKNOWN_SKEW_PPM));
}

#[test]
fn a_gap_of_half_an_hour_is_followed_through() {
    let mut chance = Chance(3);
    let session = beats(5400.0, &mut chance);
    let worn: Vec<f64> =
        session.iter().copied().filter(|secs| !(1500.0..3300.0).contains(secs)).collect();
    let recording = recorded(&worn, 5.0, 60.0, &mut chance);
    let found = by_beats(&session, &recording, &search()).unwrap();
    assert!((found.skew_ppm - 60.0).abs() < 2.0 && found.pairs > 3500, "{found:?}");
}

#[test]
fn a_metronome_is_ambiguous() {
    let regular: Vec<f64> = (0..600).map(|k| 0.8 * f64::from(k)).collect();
    let found = by_beats(&regular, &regular, &search());
    assert!(matches!(found, Err(JoinError::Ambiguous { .. })), "{found:?}");
}

#[test]
fn two_hearts_do_not_match() {
    let session = beats(1800.0, &mut Chance(4));
    let other: Vec<f64> = beats(1800.0, &mut Chance(5)).iter().map(|secs| 1.11 * secs).collect();
    assert!(by_beats(&session, &other, &search()).is_err());
}

#[test]
fn presses_are_joined_and_regular_ones_are_not() {
    let presses = [12.0, 15.5, 31.25, 1201.0];
    let tags = presses.map(|secs| secs + 500.0);
    let search = Search { resolution_secs: 0.005, ..Search::default() };
    let found = by_marks(&presses, &tags, &search).unwrap();
    assert!((found.session_from_device(512.0) - 12.0).abs() < 1e-6, "{found:?}");
    assert!(found.uncertainty_secs(512.0) >= 0.005, "{found:?}");
    let alone = by_marks(&[7.0], &[3.0], &search).unwrap();
    assert!((alone.offset_secs - 4.0).abs() < 0.02, "{alone:?}");
    let regular = by_marks(&[1.0, 2.0, 3.0, 4.0], &[1.0, 2.0, 3.0, 4.0], &search);
    assert!(matches!(regular, Err(JoinError::Ambiguous { .. })), "{regular:?}");
}

/// Presses at intervals of 0.8 to 4.5 s.
fn presses(count: usize, chance: &mut Chance) -> Vec<f64> {
    let mut at = 100.0 * chance.next();
    let next = |_| {
        at += 0.8 + 3.7 * chance.next();
        at
    };
    (0..count).map(next).collect()
}

#[test]
fn unrelated_presses_are_refused() {
    let mut chance = Chance(6);
    let mut placed = 0;
    for turn in 0..1000 {
        let (ours, theirs) = (3 + turn % 10, 3 + (turn / 10) % 6);
        let session = presses(ours, &mut chance);
        let recording = presses(theirs, &mut chance);
        if ours != theirs {
            placed += i32::from(by_marks(&session, &recording, &Search::default()).is_ok());
        }
    }
    assert!(placed <= 9, "{placed} of about 900");
}

#[test]
fn presses_among_others_are_found() {
    let mut chance = Chance(7);
    let (mut found, mut right) = (0, 0);
    for turn in 0..500 {
        let session = presses(8 + turn % 8, &mut chance);
        let from = turn % 4;
        let kept = &session[from..from + 4 + turn % 3];
        let recording: Vec<f64> = kept.iter().map(|at| at + 70.0 + chance.around(0.01)).collect();
        if let Ok(placed) = by_marks(&session, &recording, &Search::default()) {
            found += 1;
            right += i32::from((placed.offset_secs + 70.0).abs() < 0.03);
        }
    }
    assert!(found >= 450 && found == right, "{right} of {found}");
}

proptest! {
    #[test]
    fn any_times_are_joined_or_refused(
        session in prop::collection::vec(-1e6..1e6_f64, 0..200),
        recording in prop::collection::vec(prop_oneof![Just(f64::NAN), -1e6..1e6_f64], 0..200),
    ) {
        for joined in [by_beats(&session, &recording, &search()), by_marks(&session, &recording, &search())] {
            prop_assert!(joined.is_err() || joined.unwrap().uncertainty_secs(0.0) >= 0.01);
        }
    }
}
