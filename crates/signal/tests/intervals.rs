//! Artefacts among beats against NeuroKit2 0.2.13 (`golden/hrv.py`), and what correction must hold to.

#[path = "synthetic/intervals.rs"]
mod synthetic;

use Kind::{Ectopic, LongShort};
use Wrong::{Astray, Extra, Longer, Missed};
use proptest::prelude::*;
use synthetic::intervals_ms;
use teampulse_signal::hrv::time_domain;
use teampulse_signal::intervals::*;

fn beats_secs(count: u32) -> Vec<f64> {
    let mut time_ms = 0.0;
    let beat = |interval: f64| {
        time_ms += interval;
        time_ms / 1000.0
    };
    std::iter::once(0.0).chain(intervals_ms(count)).map(beat).collect()
}

/// The beats of `golden/hrv.py` with an early, a late, an extra, a missed and a long one.
fn disturbed_secs() -> Vec<f64> {
    let mut times = beats_secs(350);
    times[200] -= 0.190;
    times[300] += 0.170;
    let middle = times[119].midpoint(times[120]);
    // Whole milliseconds, as in Python.
    times.insert(120, (middle * 1000.0).floor() / 1000.0 + 0.040);
    times.remove(60);
    times.iter().enumerate().map(|(k, time)| if k < 240 { *time } else { time + 0.650 }).collect()
}

fn rmssd_ms(beats: &Beats) -> f64 {
    time_domain(&beats.intervals_ms()).expect("there are beats").rmssd_ms
}

fn once() -> Correction {
    Correction { passes: Passes::Once }
}

#[test]
fn artefacts_are_those_that_neurokit_finds() {
    let artefacts = Artefacts::among(&disturbed_secs());
    let of = |kind: Kind| {
        let meant = artefacts.found.iter().filter(|each| each.kind == kind);
        meant.map(|each| each.beat).collect::<Vec<_>>()
    };
    assert_eq!(of(Ectopic), [201, 265, 301, 302]);
    assert_eq!(of(Kind::Missed), [60]);
    assert_eq!(of(Kind::Extra), [119]);
    assert_eq!(of(LongShort), [120, 200, 240, 300]);
    assert_eq!(artefacts.beats, 351);
    assert!((artefacts.percent() - 1000.0 / 351.0).abs() < 1e-12);
}

#[test]
fn the_beat_that_is_astray_is_moved_and_not_the_one_after_it() {
    // An ectopic beat shows by the jump back, at the beat after.
    let clean: Vec<f64> =
        (0..200).map(|k| f64::from(k) * 0.85 + 0.004 * f64::from(k * k % 7)).collect();
    let mut early = clean.clone();
    early[100] -= 0.06;
    let jump = Artefact { beat: 101, kind: Ectopic };
    assert!(Artefacts::among(&early).found.contains(&jump));
    let after = once().correct(&Beats::detected(&early)).beats;
    for (beat, (after, before)) in after.times_secs().iter().zip(&early).enumerate() {
        assert_eq!(beat == 100, (after - before).abs() > 0.0, "{beat}");
    }
    assert!((after.times_secs()[100] - clean[100]).abs() < 0.02);
}

#[test]
fn a_long_interval_is_none_where_no_beat_can_be_moved() {
    for longer_secs in [0.4, -0.4] {
        let mut paused = beats_secs(200);
        paused[100..].iter_mut().for_each(|each| *each += longer_secs);
        let corrected = Correction::default().correct(&Beats::detected(&paused));
        assert_eq!(corrected.beats.times_secs().len(), 201);
        let intervals_ms = corrected.beats.intervals_ms();
        let none: Vec<usize> = (0..200).filter(|&place| intervals_ms[place].is_nan()).collect();
        assert_eq!(none, [99]);
        assert_eq!(corrected.passes[0].found, [Artefact { beat: 100, kind: LongShort }]);
    }
}

#[test]
fn an_early_beat_does_not_drag_its_neighbours() {
    // Both beats beside an ectopic one are found, too: each in the middle between beats of which
    // one is wrong would be wrong itself.
    let corrected = once().correct(&Beats::detected(&disturbed_secs()));
    let clean = beats_secs(350);
    let off = |beat: usize| (corrected.beats.times_secs()[beat] - clean[beat]).abs();
    assert!((199..203).all(|beat| off(beat) < 0.06), "{corrected:?}");
}

#[test]
fn a_quiet_series_is_hardly_touched() {
    let artefacts = Artefacts::among(&beats_secs(350));
    let found: Vec<_> = artefacts.found.iter().map(|each| (each.beat, each.kind)).collect();
    assert_eq!(found, [(265, Ectopic)]);
}

/// Times of beats [s] from the intervals between them [ms].
fn times_secs(intervals_ms: &[f64]) -> Vec<f64> {
    let mut time_ms = 0.0;
    let beat = |interval: &f64| {
        time_ms += interval;
        time_ms / 1000.0
    };
    std::iter::once(&0.0).chain(intervals_ms).map(beat).collect()
}

#[test]
fn small_changes_of_a_quiet_heart_are_its_own() {
    // Normal jitter of 12 ms, as of a heart at rest: by the paper's thresholds some are ectopic.
    let mut state = 1u32;
    let mut uniform = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
    };
    let mut normal = || (0..12).map(|_| uniform()).sum::<f64>();
    let quiet = times_secs(&(0..400).map(|_| 700.0 + 12.0 * normal()).collect::<Vec<_>>());
    assert!(Artefacts::among(&quiet).total() > 5);
    let corrected = Correction::default().correct(&Beats::detected(&quiet));
    assert_eq!(corrected.passes, []);
}

#[test]
fn a_heart_that_slows_down_and_comes_back_is_not_corrected() {
    // Breathed in deeply, and out: as in record 108 of MIT-BIH.
    let slow = [1044.0, 1244.0, 1344.0, 1158.0, 1089.0];
    let steady = |k: u32| 1000.0 + 20.0 * (0.9 * f64::from(k)).sin() + f64::from(k * k % 23);
    let mut intervals_ms: Vec<f64> = (0..200).map(steady).collect();
    intervals_ms[100..105].copy_from_slice(&slow);
    let times_secs = times_secs(&intervals_ms);
    let found = Artefacts::among(&times_secs);
    assert!(found.found.iter().any(|each| (100..106).contains(&each.beat)), "{found:?}");
    let corrected = Correction::default().correct(&Beats::detected(&times_secs));
    assert_eq!(corrected.beats.intervals_ms().iter().filter(|each| each.is_nan()).count(), 0);
    assert_eq!(corrected.beats.times_secs(), times_secs);
}

/// What goes wrong with a beat.
#[derive(Clone, Copy, Debug)]
enum Wrong {
    Missed,
    Extra,
    /// The beat is early or late by this share of its interval.
    Astray(f64),
    /// Its interval is longer by this share, and all after it later.
    Longer(f64),
}

/// Does this wrong after each `every` beats; and where those are afterwards.
fn with_artefacts(clean: &[f64], wrong: Wrong, every: usize) -> (Vec<f64>, Vec<usize>) {
    let mut times = clean.to_vec();
    let places: Vec<usize> = (20..times.len() - 20).step_by(every).collect();
    for &place in places.iter().rev() {
        let interval = times[place] - times[place - 1];
        match wrong {
            Missed => drop(times.remove(place)),
            Extra => times.insert(place, times[place - 1] + 0.4 * interval),
            Astray(share) => times[place] += share * interval,
            Longer(share) => times[place..].iter_mut().for_each(|each| *each += share * interval),
        }
    }
    let shifted = |(turn, place): (usize, usize)| match wrong {
        Missed => place - turn,
        Extra => place + turn,
        Astray(_) | Longer(_) => place,
    };
    (times, places.into_iter().enumerate().map(shifted).collect())
}

#[test]
fn injected_artefacts_are_found_and_variability_comes_back() {
    let clean = beats_secs(2000);
    let clean = Correction::default().correct(&Beats::detected(&clean)).beats.times_secs().to_vec();
    let before = rmssd_ms(&Beats::detected(&clean));
    for wrong in [
        Missed,
        Extra,
        Astray(0.2),
        Astray(-0.2),
        Astray(-0.35),
        Longer(0.3),
        Longer(0.6),
        Longer(-0.3),
    ] {
        let (disturbed, places) = with_artefacts(&clean, wrong, 40);
        let artefacts = Artefacts::among(&disturbed);
        let is_found =
            |place: &&usize| artefacts.found.iter().any(|each| each.beat.abs_diff(**place) < 2);
        let found = places.iter().filter(is_found).count();
        assert!(
            found as f64 >= 0.95 * places.len() as f64,
            "{wrong:?}: {found} of {}",
            places.len()
        );
        let corrected = Correction::default().correct(&Beats::detected(&disturbed));
        let after = rmssd_ms(&corrected.beats);
        assert!((after / before - 1.0).abs() < 0.05, "{wrong:?}: {after} ms after {before} ms");
    }
}

#[test]
fn what_a_person_decided_stays() {
    let detected = Beats::detected(&disturbed_secs());
    let at_secs = detected.times_secs()[60];
    let (kept, left_out) = detected.edited(&[Edit::Keep { at_secs }], 0.01);
    assert!(left_out.is_empty());
    let corrected = once().correct(&kept);
    assert_eq!(corrected.count(Kind::Missed), 0);
    assert!(corrected.beats.times_secs().contains(&at_secs));
}

#[test]
fn edits_lie_over_the_beats_and_can_be_taken_back() {
    let detected = Beats::detected(&[0.0, 0.8, 1.6, 2.4]);
    let edits = [
        Edit::Add { at_secs: 2.0 },
        Edit::Move { from_secs: 0.81, to_secs: 0.7 },
        Edit::Remove { at_secs: 1.6 },
        Edit::Remove { at_secs: 9.0 },
    ];
    let (edited, left_out) = detected.edited(&edits, 0.05);
    assert_eq!(edited.times_secs(), [0.0, 0.7, 2.0, 2.4]);
    assert_eq!(edited.decided(), [false, true, true, false]);
    assert_eq!(left_out, [3]);
    assert_eq!(detected.edited(&[], 0.05).0, detected);
}

#[test]
fn many_corrections_are_doubtful() {
    let (disturbed, _) = with_artefacts(&beats_secs(400), Astray(0.3), 15);
    let corrected = Correction::default().correct(&Beats::detected(&disturbed));
    assert!(corrected.is_doubtful(), "{} %", corrected.percent());
    assert!(!Correction::default().correct(&Beats::detected(&beats_secs(400))).is_doubtful());
}

#[test]
fn too_few_beats_are_not_judged() {
    for count in 0..4 {
        assert_eq!(Artefacts::among(&vec![1.0; count]).total(), 0);
    }
}

proptest! {
    #[test]
    fn whatever_comes_beats_stay_in_order(
        times in prop::collection::vec(prop_oneof![prop::num::f64::ANY, 0.0..60.0], 0..150),
        edits in prop::collection::vec((0u8..4, prop::num::f64::ANY, 0.0..60.0), 0..10),
        within_secs in prop::num::f64::ANY,
    ) {
        let edit = |&(kind, any, at_secs): &(u8, f64, f64)| match kind {
            0 => Edit::Add { at_secs: any },
            1 => Edit::Remove { at_secs },
            2 => Edit::Move { from_secs: at_secs, to_secs: any },
            _ => Edit::Keep { at_secs },
        };
        let edits: Vec<Edit> = edits.iter().map(edit).collect();
        let (beats, _) = Beats::detected(&times).edited(&edits, within_secs);
        let corrected = Correction::default().correct(&beats);
        prop_assert!(beats.times_secs().is_sorted());
        prop_assert!(corrected.beats.times_secs().is_sorted());
        for (time, decided) in beats.times_secs().iter().zip(beats.decided()) {
            prop_assert!(!decided || corrected.beats.times_secs().contains(time));
        }
        Artefacts::among(&times);
    }
}
