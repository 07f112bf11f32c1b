//! Artefacts among beats against NeuroKit2 0.2.13 (`golden/hrv.py`), and what correction must hold to.

#[path = "synthetic/intervals.rs"]
mod synthetic;

use Kind::{Ectopic, Extra, LongShort, Missed};
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
    assert_eq!(of(Missed), [60]);
    assert_eq!(of(Extra), [119]);
    assert_eq!(of(LongShort), [120, 200, 240, 300]);
    assert_eq!(artefacts.beats, 351);
    assert!((artefacts.percent() - 1000.0 / 351.0).abs() < 1e-12);
}

#[test]
fn a_single_artefact_is_corrected_as_neurokit_corrects_it() {
    let before = beats_secs(350);
    let after = once().correct(&Beats::detected(&before)).beats;
    let moved = before
        .iter()
        .zip(after.times_secs())
        .enumerate()
        .filter(|(_, (a, b))| (*a - *b).abs() > 0.0);
    let moved: Vec<(usize, f64)> = moved.map(|(beat, (_, at_secs))| (beat, *at_secs)).collect();
    assert_eq!(moved.len(), 1);
    // NeuroKit2 cuts off the fraction of a sample.
    assert!(moved[0].0 == 265 && (moved[0].1 - 225.480).abs() < 0.001, "{moved:?}");
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

/// Puts one artefact after each `every` beats: missed, extra, early and late in turn; and where.
fn with_artefacts(mut times: Vec<f64>, every: usize) -> (Vec<f64>, Vec<f64>) {
    let places: Vec<usize> = (20..times.len() - 20).step_by(every).collect();
    let mut at_secs = Vec::new();
    for (turn, place) in places.into_iter().enumerate().rev() {
        at_secs.push(times[place]);
        match turn % 4 {
            0 => drop(times.remove(place)),
            1 => times.insert(place, times[place - 1] + 0.4 * (times[place] - times[place - 1])),
            2 => times[place] -= 0.25,
            _ => times[place] += 0.25,
        }
    }
    (times, at_secs)
}

#[test]
fn injected_artefacts_are_found_and_variability_comes_back() {
    let clean = beats_secs(4000);
    let (disturbed, at_secs) = with_artefacts(clean.clone(), 40);
    let artefacts = Artefacts::among(&disturbed);
    let near = |at: f64| artefacts.found.iter().any(|each| (disturbed[each.beat] - at).abs() < 1.5);
    let found = at_secs.iter().filter(|&&at| near(at)).count();
    assert!(found as f64 >= 0.95 * at_secs.len() as f64, "{found} of {}", at_secs.len());
    let corrected = Correction::default().correct(&Beats::detected(&disturbed));
    let (before, after) = (rmssd_ms(&Beats::detected(&clean)), rmssd_ms(&corrected.beats));
    assert!((after / before - 1.0).abs() < 0.05, "{after} ms after {before} ms");
}

#[test]
fn what_a_person_decided_stays() {
    let detected = Beats::detected(&disturbed_secs());
    let at_secs = detected.times_secs()[60];
    let (kept, left_out) = detected.edited(&[Edit::Keep { at_secs }], 0.01);
    assert!(left_out.is_empty());
    let corrected = once().correct(&kept);
    assert_eq!(corrected.count(Missed), 0);
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
    let (disturbed, _) = with_artefacts(beats_secs(400), 15);
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
