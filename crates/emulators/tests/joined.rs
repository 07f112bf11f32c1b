//! Recordings of a wristband that was worn during a session, joined to it afterwards: how close they come to the truth
//! by heartbeats alone and by presses of the button, and how often the truth is within the stated error.
//!
//! 100 simulated people for nine minutes with changing workload, which makes their pulses arrive up to 20 ms earlier.
//! The session has the R waves of a strap, each up to 4 ms off. The wristband samples the pulse wave at 64 Hz by a
//! clock that is up to 300 s and 100 ppm off. In a second session it was streamed live, too: its samples come through a
//! radio link whose delays differ, are placed by the filter of its clock, and pulses are found in them as they come.

use teampulse_emulators::body::{Body, Rates, Sensor, Settings, Traits};
use teampulse_emulators::noise::Noise;
use teampulse_signal::arrival::{ArrivalLimits, arrivals, summary};
use teampulse_signal::ppg::analysis::{Settings as PpgSettings, causal};
use teampulse_signal::ppg::find_pulses;
use teampulse_timefilter::clock::{
    ClockModel, KnownDevice, Latency, OneWay, OneWaySettings, Stamps,
};
use teampulse_timefilter::join::{Placement, Search, by_beats, by_marks};

const CASES: u64 = 100;
const FIRST_SEED: u64 = 1000;
const SECS: f64 = 540.0;
const RATE_HZ: f64 = 64.0;
/// The pulse arrival time that `import` assumes for anybody.
const ANYBODY: Latency = Latency::new(0.250, 0.050);
/// As it assumes it of one wristband that was streamed live, too.
const SAME_DEVICE: Latency = Latency::new(0.0, 0.010);
/// After this the filter of a clock has seen its delays [s].
const SETTLED_SECS: f64 = 60.0;
/// When the button is pressed, three times at each end [s].
const PRESSES_SECS: [f64; 6] = [12.3, 15.1, 19.6, 510.2, 514.9, 517.7];

/// One person with a session and a recording.
struct Case {
    beats: Vec<f64>,
    feet: Vec<f64>,
    peaks: Vec<f64>,
    live: Live,
    presses: Vec<f64>,
    tags: Vec<f64>,
    /// The pulse arrival time measured in another recording of this person.
    own: Latency,
    offset_secs: f64,
    skew_ppm: f64,
}

/// The R waves and the pulse wave of a person whose workload changes every minute.
fn worn(
    traits: &Traits,
    seed: u64,
    ppg_hz: f64,
    secs: f64,
    noise: &mut Noise,
) -> (Vec<f64>, Vec<f64>) {
    let settings = Settings { rates: Rates { ppg_hz, ..Rates::NONE }, ..Settings::default() };
    let mut body = Body::wearing(traits, seed, &settings).expect("the rate can be simulated");
    let (mut beats, mut samples) = (Vec::new(), Vec::new());
    while body.secs() < secs {
        body.state(noise.uniform(0.0..1.0), 0.3, 0.5);
        let record = body.until(body.secs() + 60.0);
        beats.extend(record.truth.beats.iter().map(|beat| beat.secs));
        samples.extend_from_slice(&record.wave(Sensor::Ppg).samples);
    }
    (beats, samples)
}

/// The pulse arrival time of a person, from three minutes of both signals on one clock.
fn arrival(traits: &Traits, seed: u64, noise: &mut Noise) -> Latency {
    let (beats, samples) = worn(traits, seed + 1_000_000, RATE_HZ, 180.0, noise);
    let pulses = find_pulses(&samples, RATE_HZ).expect("the rate is usual");
    let feet: Vec<f64> = pulses.iter().map(|pulse| pulse.onset / RATE_HZ).collect();
    let arrivals = arrivals(&beats, &feet, ArrivalLimits::default()).expect("the limits are valid");
    let summary = summary(&beats, &arrivals, 0.0..180.0).expect("each beat has its pulse");
    Latency::new(summary.median_ms / 1e3, 0.015)
}

/// The wristband in the session itself.
struct Live {
    /// When each sample was measured, by the session.
    samples: Vec<f64>,
    pulses: Vec<f64>,
}

impl Live {
    /// Sample by sample over a link whose delays differ; `late_secs` passes at least until one is here.
    fn of(samples: &[f64], rate_hz: f64, late_secs: f64, noise: &mut Noise) -> Live {
        let known = KnownDevice::find("empatica_e4").expect("it is in the table");
        let mut clock = OneWay::new(OneWaySettings::of(known));
        let mut analysis = causal(&PpgSettings::default(), RATE_HZ).expect("the rate is usual");
        let mut live = Live { samples: Vec::new(), pulses: Vec::new() };
        let (mut arrival_secs, mut ticked) = (0.0_f64, 0);
        for (place, sample) in samples.iter().enumerate() {
            let delay_secs = late_secs - 0.030 * (1.0 - noise.uniform(0.0..1.0)).ln();
            arrival_secs = arrival_secs.max(place as f64 / rate_hz + delay_secs);
            while f64::from(ticked) * 0.1 < arrival_secs {
                clock.tick(ns(f64::from(ticked) * 0.1));
                ticked += 1;
            }
            let stamps = Stamps {
                device: Some(ns(place as f64 / RATE_HZ)),
                index: place as u64,
                ..Stamps::arrived(ns(arrival_secs))
            };
            let at_ns = clock.correct(&stamps).measured;
            live.samples.push(at_ns as f64 / 1e9);
            analysis.push(at_ns, &[*sample]);
            live.pulses.extend(
                std::iter::from_fn(|| analysis.next_event()).map(|pulse| pulse.at_ns as f64 / 1e9),
            );
        }
        live
    }
}

fn ns(secs: f64) -> i64 {
    (secs * 1e9).round() as i64
}

impl Case {
    fn of_seed(seed: u64) -> Case {
        let mut noise = Noise::seeded(seed ^ 0x6a6f_696e);
        let (offset_secs, skew_ppm) = (noise.uniform(-300.0..300.0), noise.uniform(-100.0..100.0));
        let traits = Traits::of_seed(seed);
        // Its clock runs slow by the skew: between two of its ticks passes more of true time.
        let rate_hz = RATE_HZ / (1.0 + 1e-6 * skew_ppm);
        let (beats, samples) = worn(&traits, seed, rate_hz, SECS, &mut noise);
        let own = arrival(&traits, seed, &mut noise);
        let device = |secs: f64| secs / (1.0 + 1e-6 * skew_ppm) - offset_secs;
        let pulses = find_pulses(&samples, RATE_HZ).expect("the rate is usual");
        let feet = pulses.iter().map(|pulse| pulse.onset / RATE_HZ - offset_secs).collect();
        let peaks = pulses.iter().map(|pulse| pulse.sample / RATE_HZ - offset_secs).collect();
        let late_secs = noise.uniform(0.05..0.35);
        let live = Live::of(&samples, rate_hz, late_secs, &mut noise);
        let beats = beats.iter().map(|beat| beat + noise.uniform(-0.004..0.004)).collect();
        // A tag is stamped in hundredths, and the two buttons are a few milliseconds apart.
        let tag =
            |secs: &f64| (100.0 * device(*secs + noise.uniform(-0.002..0.002))).round() / 100.0;
        let tags = PRESSES_SECS.iter().map(tag).collect();
        Case {
            beats,
            feet,
            peaks,
            live,
            presses: PRESSES_SECS.to_vec(),
            tags,
            own,
            offset_secs,
            skew_ppm,
        }
    }

    fn by_heart(&self, delay: Latency) -> Placement {
        let search = Search { max_offset_secs: 600.0, delay, ..Search::default() };
        by_beats(&self.beats, &self.feet, &search).expect("the beats single out one offset")
    }

    fn by_itself(&self) -> Placement {
        let search = Search { max_offset_secs: 600.0, delay: SAME_DEVICE, ..Search::default() };
        by_beats(&self.live.pulses, &self.peaks, &search).expect("the pulses single out one offset")
    }

    fn by_presses(&self) -> Placement {
        let search = Search { max_offset_secs: 600.0, resolution_secs: 0.005, ..Search::default() };
        by_marks(&self.presses, &self.tags, &search).expect("the presses single out one offset")
    }

    /// The larger error at the two ends of the recording [s], and whether it is within the stated uncertainty.
    fn error(&self, placement: &Placement) -> (f64, bool) {
        let at = |true_secs: f64| {
            let device_secs = true_secs / (1.0 + 1e-6 * self.skew_ppm) - self.offset_secs;
            let off = (placement.session_from_device(device_secs) - true_secs).abs();
            (off, off <= placement.uncertainty_secs(device_secs))
        };
        let (first, last) = (at(0.0), at(SECS));
        (first.0.max(last.0), first.1 && last.1)
    }
}

impl Case {
    /// The larger distance from what came live of the same samples [s], once its clock is known and at the end, and
    /// whether both are within what is stated.
    fn apart(&self, placement: &Placement) -> (f64, bool) {
        let last = self.live.samples.len() - 1;
        let at = |place: usize| {
            let device_secs = place as f64 / RATE_HZ - self.offset_secs;
            let off = (placement.session_from_device(device_secs) - self.live.samples[place]).abs();
            (off, off <= placement.uncertainty_secs(device_secs))
        };
        let (first, last) = (at((SETTLED_SECS * RATE_HZ) as usize), at(last));
        (first.0.max(last.0), first.1 && last.1)
    }
}

/// The 95th percentile.
fn p95(sizes: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = sizes.collect();
    sizes.sort_by(f64::total_cmp);
    sizes[sizes.len() * 95 / 100 - 1]
}

/// The 95th percentile of errors [ms], and how many are within the stated uncertainty.
fn judged(what: &str, errors: &[(f64, bool)]) -> (f64, usize) {
    let p95_ms = p95(errors.iter().map(|error| 1e3 * error.0));
    let within = errors.iter().filter(|error| error.1).count();
    eprintln!(
        "joined by {what}: p95 {p95_ms:.1} ms, within the stated error in {within} of {CASES}"
    );
    (p95_ms, within)
}

#[test]
fn a_wristband_is_joined_as_nearly_as_stated() {
    let cases: Vec<Case> = (FIRST_SEED..FIRST_SEED + CASES).map(Case::of_seed).collect();
    let errors = |joined: fn(&Case) -> Placement| -> Vec<(f64, bool)> {
        cases.iter().map(|case| case.error(&joined(case))).collect()
    };
    let of_anybody = errors(|case| case.by_heart(ANYBODY));
    let (p95_ms, within) = judged("heartbeats, pulse arrival of anybody", &of_anybody);
    assert!(p95_ms <= 50.0 && within >= 95, "{p95_ms} ms, {within}");
    let live: Vec<(f64, bool)> = cases.iter().map(|case| case.apart(&case.by_itself())).collect();
    let (p95_ms, within) = judged("its own pulses, which also came live", &live);
    assert!(p95_ms <= 20.0 && within >= 95, "{p95_ms} ms, {within}");
    let unknown_ms = p95(cases.iter().map(|case| 1e3 * (case.own.secs - ANYBODY.secs).abs()));
    eprintln!(
        "of which the person's own pulse arrival, which no beat shows: p95 {unknown_ms:.1} ms"
    );
    let (p95_ms, within) =
        judged("heartbeats, pulse arrival known", &errors(|case| case.by_heart(case.own)));
    assert!(p95_ms <= 20.0 && within >= 95, "{p95_ms} ms, {within}");
    let (p95_ms, within) = judged("a button pressed six times", &errors(Case::by_presses));
    assert!(p95_ms <= 5.0 && within >= 95, "{p95_ms} ms, {within}");
}
