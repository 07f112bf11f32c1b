use proptest::prelude::*;

use super::*;
use crate::clock::Latency;
use crate::join::UNKNOWN_SKEW_PPM;

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

/// A swing: its start, duration [s], frequency [Hz] and strength [g].
type Swing = (f64, f64, f64, f64);

/// The movements of a person: swings that begin at random.
fn swings(secs: f64, per_min: f64, chance: &mut Chance) -> Vec<Swing> {
    let (mut at, mut swings) = (0.0, Vec::new());
    while at < secs {
        at -= chance.next().max(1e-9).ln() * 60.0 / per_min;
        let (lasts, hz) = (0.5 + 1.5 * chance.next(), 1.0 + 2.0 * chance.next());
        swings.push((at, lasts, hz, 0.05 + 0.15 * chance.next()));
    }
    swings
}

fn strength(swings: &[Swing], at: f64) -> f64 {
    let first = swings.partition_point(|swing| swing.0 < at - 2.0);
    let under_way = swings[first..].iter().take_while(|swing| swing.0 <= at);
    let of_swing = |(from, lasts, hz, g): &Swing| {
        let after = at - from;
        let swell = (std::f64::consts::PI * after / lasts).sin().powi(2);
        if after < *lasts { g * swell * (std::f64::consts::TAU * hz * after).sin() } else { 0.0 }
    };
    under_way.map(of_swing).sum()
}

/// What a sensor measures of some swings between two times, with a clock that has an offset and a skew.
struct Sensor {
    rate_hz: f64,
    offset_secs: f64,
    skew_ppm: f64,
}

impl Sensor {
    fn feels(
        &self,
        swings: &[&[Swing]],
        secs: std::ops::Range<f64>,
        chance: &mut Chance,
    ) -> Vec<Movement> {
        let count = ((secs.end - secs.start) * self.rate_hz) as usize;
        let movement = |place: usize| {
            let at = secs.start + place as f64 / self.rate_hz;
            let felt: f64 = swings.iter().map(|swings| strength(swings, at)).sum();
            let secs = (at - self.offset_secs) / (1.0 + self.skew_ppm * 1e-6);
            Movement { secs, magnitude: 1.0 + felt + chance.around(0.004) }
        };
        (0..count).map(movement).collect()
    }
}

const SESSION: Sensor = Sensor { rate_hz: 50.0, offset_secs: 0.0, skew_ppm: 0.0 };

fn search() -> Search {
    Search { delay: Latency::new(0.0, 0.005), ..Search::default() }
}

#[test]
fn a_wrist_is_placed_by_what_a_chest_felt_too() {
    let mut chance = Chance(1);
    let (both, wrist) = (swings(1800.0, 12.0, &mut chance), swings(1800.0, 6.0, &mut chance));
    let session = SESSION.feels(&[&both], 0.0..1800.0, &mut chance);
    for (offset_secs, skew_ppm) in [(-240.0, 60.0), (1_000_000.5, -40.0)] {
        let device = Sensor { rate_hz: 32.0, offset_secs, skew_ppm };
        let recording = device.feels(&[&both, &wrist], 300.0..1700.0, &mut chance);
        let found = by_motion(&session, &recording, &search()).expect("is found");
        for at in [recording[0].secs, recording[recording.len() - 1].secs] {
            let truth = at * (1.0 + skew_ppm * 1e-6) + offset_secs;
            let off = (found.session_from_device(at) - truth).abs();
            assert!(off < 0.01 && off < found.uncertainty_secs(at), "{off}: {found:?}");
        }
        assert!((found.skew_ppm - skew_ppm).abs() < 10.0, "{found:?}");
    }
}

#[test]
fn a_recording_of_minutes_is_placed_with_the_doubt_about_its_skew() {
    let mut chance = Chance(2);
    let both = swings(1200.0, 20.0, &mut chance);
    let session = SESSION.feels(&[&both], 0.0..1200.0, &mut chance);
    let device = Sensor { rate_hz: 64.0, offset_secs: 7.25, skew_ppm: 0.0 };
    let recording = device.feels(&[&both], 500.0..740.0, &mut chance);
    let found = by_motion(&session, &recording, &search()).expect("is found");
    assert!((found.offset_secs - 7.25).abs() < 0.005, "{found:?}");
    assert_eq!((found.skew_ppm, found.skew_uncertainty_ppm()), (0.0, UNKNOWN_SKEW_PPM));
}

#[test]
fn two_people_and_people_at_rest_are_refused() {
    let mut chance = Chance(3);
    let (one, other) = (swings(1200.0, 12.0, &mut chance), swings(1200.0, 12.0, &mut chance));
    let session = SESSION.feels(&[&one], 0.0..1200.0, &mut chance);
    let of_other = SESSION.feels(&[&other], 0.0..1200.0, &mut chance);
    let at_rest = SESSION.feels(&[], 0.0..1200.0, &mut chance);
    for recording in [of_other, at_rest, Vec::new()] {
        assert!(by_motion(&session, &recording, &search()).is_err());
    }
}

#[test]
fn a_walk_in_even_steps_is_refused() {
    let step: Vec<Swing> = (0..2400).map(|k| (0.5 * f64::from(k), 0.5, 2.0, 0.2)).collect();
    let mut chance = Chance(4);
    let session = SESSION.feels(&[&step], 0.0..1200.0, &mut chance);
    let recording = SESSION.feels(&[&step], 100.0..1100.0, &mut chance);
    assert!(by_motion(&session, &recording, &search()).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_movement_is_joined_or_refused(
        session in prop::collection::vec((-1e6..1e6_f64, prop::num::f64::ANY), 0..200),
        recording in prop::collection::vec((0.0..300.0_f64, -2.0..2.0_f64), 0..2000),
    ) {
        let movement = |(secs, magnitude): &(f64, f64)| Movement { secs: *secs, magnitude: *magnitude };
        let session: Vec<Movement> = session.iter().map(movement).collect();
        let recording: Vec<Movement> = recording.iter().map(movement).collect();
        for (one, other) in [(&session, &recording), (&recording, &session)] {
            let joined = by_motion(one, other, &search());
            prop_assert!(joined.is_err() || joined.unwrap().uncertainty_secs(0.0) >= 0.005);
        }
    }
}
