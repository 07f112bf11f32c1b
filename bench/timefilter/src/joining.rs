//! Recordings of another clock that join a session afterwards: how accurately they are placed, and how often the stated
//! interval contains the truth.

use std::fmt;
use std::ops::Range;

use teampulse_emulators::body::{Body, Rates, Sensor, Settings, Traits};
use teampulse_emulators::noise::Noise;
use teampulse_timefilter::clock::Latency;
use teampulse_timefilter::join::{
    JoinError, Movement, Placement, Search, by_beats, by_marks, by_motion,
};

/// The seeds on which settings were chosen, and the seeds to which nothing was fitted.
const CHOSEN: Range<u64> = 1..201;
const JUDGED: Range<u64> = 30_001..30_201;
/// The share of recordings in which the stated 95 % interval must contain the truth; `FOUND_SHARE` must be placed at
/// all.
const HELD_SHARE: f64 = 0.95;
/// That bar if the interval is given by the user, drawn with exactly 95 %: 200 draws give 92 to 98 %.
const OWN_HELD_SHARE: f64 = 0.92;
const FOUND_SHARE: f64 = 0.95;
/// The range of a device's clock offset [s], and of its rate error [ppm].
const OFFSET_SECS: Range<f64> = -300.0..300.0;
const SKEW_PPM: Range<f64> = -60.0..60.0;
/// The largest offset that is searched [s].
const MOST_SECS: f64 = 600.0;
/// The duration of a recording, and how much longer the session is before and after it [s].
const LASTS_SECS: Range<f64> = 600.0..3000.0;
const AROUND_SECS: f64 = 200.0;

/// The signals by which a recording is placed.
#[derive(Clone, Copy)]
enum Means {
    /// Pulses at the wrist, with the range of pulse arrival times of adults.
    Pulses,
    /// Pulses at the wrist, with the person's pulse arrival time known within 15 ms.
    OwnPulses,
    /// Pulses of the same wristband, which was also streamed live.
    Itself,
    /// The beats of a second ECG.
    Beats,
    /// Acceleration at the wrist, compared with that at the chest.
    Movement,
    /// Presses of a button.
    Presses,
}

impl Means {
    /// The bar for the p95 of the error [s]; `None` if no clock can show more.
    const fn bar_secs(self) -> Option<f64> {
        match self {
            Means::Pulses => None,
            Means::OwnPulses | Means::Itself => Some(0.020),
            Means::Movement => Some(0.025),
            Means::Beats | Means::Presses => Some(0.005),
        }
    }

    /// The share of recordings in which the stated interval must contain the truth.
    const fn held_share(self) -> f64 {
        match self {
            Means::OwnPulses => OWN_HELD_SHARE,
            _ => HELD_SHARE,
        }
    }
}

impl fmt::Display for Means {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Means::Pulses => "pulses at the wrist and an ECG",
            Means::OwnPulses => "the same, with the person's own pulse arrival time ± 15 ms",
            Means::Itself => "pulses at the wrist and the same ones, streamed live",
            Means::Beats => "beats of two ECGs",
            Means::Movement => "acceleration of wrist and chest",
            Means::Presses => "six presses of a button, half of them at either end",
        })
    }
}

/// Prints two lines for each means; returns whether all meet their bars.
pub fn measure() -> bool {
    let all = [
        Means::Beats,
        Means::Itself,
        Means::OwnPulses,
        Means::Pulses,
        Means::Movement,
        Means::Presses,
    ];
    let mut is_good = true;
    for means in all {
        for (word, seeds) in [("chosen", CHOSEN), ("judged", JUDGED)] {
            is_good &= measure_seeds(means, word, seeds);
        }
    }
    is_good
}

fn measure_seeds(means: Means, word: &str, seeds: Range<u64>) -> bool {
    let runs = seeds.clone().count();
    let (mut errors_secs, mut held, mut stated_secs) = (Vec::new(), 0, Vec::new());
    for (found, case) in seeds.filter_map(|seed| Case::new(seed).placed(means)) {
        // The end with the larger error counts.
        let ends = [case.device_secs(case.from_secs), case.device_secs(case.to_secs)];
        let ends = ends.map(|at| (case.error_secs(&found, at), found.uncertainty_secs(at)));
        held += usize::from(ends.iter().all(|(error, stated)| error <= stated));
        errors_secs.push(ends[0].0.max(ends[1].0));
        stated_secs.push(ends[0].1.max(ends[1].1));
    }
    errors_secs.sort_by(f64::total_cmp);
    stated_secs.sort_by(f64::total_cmp);
    let found = errors_secs.len();
    let p95_secs = errors_secs.get(found * 95 / 100).copied().unwrap_or(f64::NAN);
    let stated_ms = 1e3 * stated_secs.get(found / 2).copied().unwrap_or(f64::NAN);
    let held_share = held as f64 / found.max(1) as f64;
    let is_near = means.bar_secs().is_none_or(|bar_secs| p95_secs <= bar_secs);
    let is_found = found as f64 >= FOUND_SHARE * runs as f64;
    let is_good = is_near && is_found && held_share >= means.held_share();
    let bar = means.bar_secs().map_or_else(
        || "no bar: no clock shows how late a person's pulse is".to_owned(),
        |secs| format!("bar {:.0} ms", 1e3 * secs),
    );
    println!(
        "{}  joined by {means} ({word} seeds): {found} of {runs} placed (bar 95 %), p95 {:.1} ms ({bar}), in the stated \
         interval in {:.1} % (bar {:.0} %), median ± {stated_ms:.1} ms",
        if is_good { "pass" } else { "FAIL" },
        1e3 * p95_secs,
        100.0 * held_share,
        100.0 * means.held_share(),
    );
    is_good
}

/// The sensors that recorded the heart in the session and in the recording.
#[derive(Clone, Copy, PartialEq)]
enum Pair {
    EcgAndPulses,
    Pulses,
    Ecgs,
}

/// A person during a session, and a device that recorded part of it.
struct Case {
    seed: u64,
    traits: Traits,
    noise: Noise,
    from_secs: f64,
    to_secs: f64,
    offset_secs: f64,
    skew: f64,
}

impl Case {
    fn new(seed: u64) -> Case {
        let mut noise = Noise::seeded(seed);
        let mut traits = Traits::of_seed(seed);
        // A person who stands and walks between tasks, rather than one who sits.
        traits.movements_per_min = noise.uniform(3.0..12.0);
        let (offset_secs, skew) = (noise.uniform(OFFSET_SECS), 1e-6 * noise.uniform(SKEW_PPM));
        let to_secs = AROUND_SECS + noise.uniform(LASTS_SECS);
        Case { seed, traits, noise, from_secs: AROUND_SECS, to_secs, offset_secs, skew }
    }

    /// Returns the reading of the device's clock at a time of the session.
    fn device_secs(&self, secs: f64) -> f64 {
        (secs - self.offset_secs) / (1.0 + self.skew)
    }

    fn error_secs(&self, found: &Placement, at: f64) -> f64 {
        (found.session_from_device(at) - (at * (1.0 + self.skew) + self.offset_secs)).abs()
    }

    fn placed(mut self, means: Means) -> Option<(Placement, Case)> {
        let search = |delay| Search { max_offset_secs: MOST_SECS, delay, resolution_secs: 0.0 };
        let found = match means {
            Means::Pulses => self.by_heart(Pair::EcgAndPulses, &search(Latency::new(0.250, 0.050))),
            Means::Itself => self.by_heart(Pair::Pulses, &search(Latency::new(0.0, 0.010))),
            Means::OwnPulses => {
                let known_secs = self.noise.around(self.traits.pulse_arrival_secs, 0.0075);
                self.by_heart(Pair::EcgAndPulses, &search(Latency::new(known_secs, 0.015)))
            }
            Means::Beats => self.by_heart(Pair::Ecgs, &search(Latency::new(0.0, 0.005))),
            Means::Movement => self.by_movement(&search(Latency::new(0.0, 0.025))),
            Means::Presses => self.by_presses(),
        };
        found.ok().map(|found| (found, self))
    }

    /// Places the recording by beats as a detector finds them: within some milliseconds, with one in twenty missed.
    fn by_heart(&mut self, pair: Pair, search: &Search) -> Result<Placement, JoinError> {
        let mut body = body(self.seed, &self.traits, 0.0);
        let truth = &body.until(self.to_secs + AROUND_SECS).truth;
        let beats = || truth.beats.iter().map(|beat| beat.secs).collect::<Vec<f64>>();
        let pulses = || truth.pulses.iter().map(|pulse| pulse.foot_secs).collect::<Vec<f64>>();
        let (session, seen) = match pair {
            Pair::EcgAndPulses => (beats(), pulses()),
            Pair::Pulses => (pulses(), pulses()),
            Pair::Ecgs => (beats(), beats()),
        };
        let scatter_secs = |is_of_pulses: bool| if is_of_pulses { 0.008 } else { 0.002 };
        let own_secs = scatter_secs(pair == Pair::Pulses);
        let session: Vec<f64> =
            session.into_iter().map(|secs| secs + own_secs * self.noise.normal()).collect();
        let scatter_secs = scatter_secs(pair != Pair::Ecgs);
        let worn = seen.into_iter().filter(|secs| (self.from_secs..self.to_secs).contains(secs));
        let recording: Vec<f64> = worn
            .filter_map(|secs| {
                let is_missed = self.noise.chance(0.05);
                let secs = secs + scatter_secs * self.noise.normal();
                (!is_missed).then(|| (secs - self.offset_secs) / (1.0 + self.skew))
            })
            .collect();
        by_beats(&session, &recording, search)
    }

    /// Places the recording by movement of a chest strap at 50 Hz and a wristband at 32 Hz in steps of 1/64 g, which
    /// the arm moves, too.
    fn by_movement(&mut self, search: &Search) -> Result<Placement, JoinError> {
        let until_secs = self.to_secs + AROUND_SECS;
        let trunk = Felt::of(body(self.seed, &self.traits, FELT_HZ), until_secs);
        let mut arm = self.traits.clone();
        arm.movements_per_min = self.noise.uniform(1.0..6.0);
        let arm = Felt::of(body(self.seed + 1_000_000, &arm, FELT_HZ), until_secs);
        let late_secs = self.noise.around(0.0, 0.010);
        let chest_g = self.noise.uniform(0.4..1.0);
        let offset_g = [(); 3].map(|()| self.noise.around(0.0, 0.02));
        let mut sample = |secs: f64, noise_g: f64, vector: [f64; 3], step_g: f64| {
            let read = |(axis, off): (f64, f64)| {
                ((axis + off + noise_g * self.noise.normal()) / step_g).round() * step_g
            };
            let axes = vector.into_iter().zip(offset_g).map(read);
            Movement { secs, magnitude: axes.map(|axis| axis * axis).sum::<f64>().sqrt() }
        };
        let session: Vec<Movement> = times(0.0..until_secs, 50.0)
            .map(|secs| sample(secs, 0.003, trunk.at(secs, chest_g), 0.001))
            .collect();
        let (offset_secs, skew) = (self.offset_secs, self.skew);
        let recording = times(self.from_secs..self.to_secs, 32.0).map(|secs| {
            let [moved, by_arm] = [trunk.at(secs - late_secs, 1.0), arm.at(secs, 1.0)];
            // The arm contributes only what it adds to gravity.
            let vector = std::array::from_fn(|axis| moved[axis] + by_arm[axis] - GRAVITY_G[axis]);
            sample((secs - offset_secs) / (1.0 + skew), 0.006, vector, 1.0 / 64.0)
        });
        let recording: Vec<Movement> = recording.collect();
        by_motion(&session, &recording, search)
    }

    /// Places the recording by three presses in the first minute and three in the last, each stamped by the band within
    /// 5 ms.
    fn by_presses(&mut self) -> Result<Placement, JoinError> {
        let minutes = [self.from_secs, self.to_secs - 60.0];
        let session: Vec<f64> =
            (0..6).map(|press| minutes[press / 3] + self.noise.uniform(0.0..60.0)).collect();
        let recording: Vec<f64> = session
            .iter()
            .map(|secs| {
                let stamped_secs = secs + self.noise.uniform(-0.005..0.005);
                (stamped_secs - self.offset_secs) / (1.0 + self.skew)
            })
            .collect();
        let (max_offset_secs, resolution_secs) = (MOST_SECS, 0.005);
        let delay = Latency::new(0.0, 0.0);
        by_marks(&session, &recording, &Search { max_offset_secs, delay, resolution_secs })
    }
}

fn body(seed: u64, traits: &Traits, acceleration_hz: f64) -> Body {
    let rates = Rates { acceleration_hz, ..Rates::NONE };
    let settings = Settings { rates, ..Settings::default() };
    Body::wearing(traits, seed, &settings).expect("the rate can be simulated")
}

/// The rate at which movement is simulated [Hz].
const FELT_HZ: f64 = 200.0;
/// The acceleration of a body that stands upright.
const GRAVITY_G: [f64; 3] = [0.0, 0.0, 1.0];

/// The acceleration of a sensor on a body.
struct Felt(Vec<[f64; 3]>);

impl Felt {
    fn of(mut body: Body, until_secs: f64) -> Felt {
        let samples = &body.until(until_secs).wave(Sensor::Acceleration).samples;
        Felt(samples.as_chunks::<3>().0.to_vec())
    }

    /// Returns the acceleration with the movement scaled by `strength`, and gravity unchanged [g].
    fn at(&self, secs: f64, strength: f64) -> [f64; 3] {
        let place = (secs * FELT_HZ).max(0.0);
        let (before, share) = (place.floor() as usize, place.fract());
        let known = |place: usize| self.0.get(place).copied().unwrap_or(GRAVITY_G);
        let (one, other) = (known(before), known(before + 1));
        std::array::from_fn(|axis| {
            let felt = one[axis] + share * (other[axis] - one[axis]);
            GRAVITY_G[axis] + strength * (felt - GRAVITY_G[axis])
        })
    }
}

fn times(span: Range<f64>, rate_hz: f64) -> impl Iterator<Item = f64> {
    let count = ((span.end - span.start) * rate_hz) as usize;
    (0..count).map(move |place| span.start + place as f64 / rate_hz)
}
