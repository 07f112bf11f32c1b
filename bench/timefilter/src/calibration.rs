//! Calibration from simulated taps and lights: how close it comes to the true lag, and how often its stated interval
//! contains the true lag.

use std::f64::consts::TAU;
use std::fmt;

use teampulse_timefilter::calibrate::{Calibration, Seen, calibrate};

/// The first seed of the recordings, none of which was used to fit anything.
const FIRST_SEED: u64 = 10_000;
/// The number of recordings of each kind, each with a different lag.
const RUNS: u64 = 200;
/// The distance within which a latency counts as found [s], and the share of recordings in which it must be found.
const NEAR_SECS: f64 = 0.005;
const NEAR_SHARE: f64 = 0.95;
/// The share of recordings in which the stated 95 % interval must contain the true lag.
const HELD_SHARE: f64 = 0.93;
/// The true lag is between zero and this many seconds, in either direction.
const LAG_SECS: f64 = 0.4;

/// What records an event.
#[derive(Clone, Copy)]
enum Witness {
    /// A button: the moment of contact.
    Button,
    /// An accelerometer with this rate [Hz] at rest on a body. It stamps the middle of the share of its interval [0..1]
    /// over which it averages, which is the whole interval with the decimating filter that most accelerometers have.
    Accelerometer(f64, f64),
    /// The brightness of a camera's images at this rate [Hz], exposed for a share of the interval.
    Camera(f64, f64),
}

/// Prints a line for each kind of recording; returns whether all meet their bars.
pub fn measure() -> bool {
    use Witness::{Accelerometer, Button, Camera};
    let kinds = [
        (Button, Accelerometer(200.0, 1.0)),
        (Button, Accelerometer(100.0, 1.0)),
        (Button, Accelerometer(50.0, 1.0)),
        (Accelerometer(1000.0, 1.0), Accelerometer(200.0, 1.0)),
        (Accelerometer(1000.0, 1.0), Accelerometer(100.0, 1.0)),
        (Accelerometer(1000.0, 1.0), Accelerometer(50.0, 1.0)),
        (Button, Camera(30.0, 1.0)),
        (Button, Accelerometer(200.0, 0.0)),
        (Button, Accelerometer(100.0, 0.0)),
        (Button, Accelerometer(50.0, 0.0)),
        (Button, Camera(30.0, 0.0)),
    ];
    let mut is_good = true;
    for (reference, stream) in kinds {
        for events in [1, 5] {
            is_good &= measure_kind(reference, stream, events);
        }
    }
    is_good
}

/// Whether 5 ms can be required. For a blow of unknown shape, one sample shows only the interval in which it came; for
/// a light, only the exposure.
fn is_enough(stream: Witness, events: usize) -> bool {
    match stream {
        Witness::Accelerometer(rate_hz, share) => {
            rate_hz >= if events > 1 && share > 0.0 { 100.0 } else { 200.0 }
        }
        Witness::Camera(_, share) => share > 0.0,
        Witness::Button => true,
    }
}

fn measure_kind(reference: Witness, stream: Witness, events: usize) -> bool {
    let (mut near, mut held, mut stated_secs) = (0, 0, Vec::new());
    for seed in (1..=RUNS).map(|run| FIRST_SEED + run) {
        let (found, lag_secs) = record(reference, stream, events, seed);
        let Some(found) = found else { continue };
        let error_secs = (found.lag_secs - lag_secs).abs();
        near += usize::from(error_secs <= NEAR_SECS);
        held += usize::from(error_secs <= found.uncertainty_secs);
        stated_secs.push(found.uncertainty_secs);
    }
    stated_secs.sort_by(f64::total_cmp);
    let found = stated_secs.len();
    let stated_ms = 1e3 * stated_secs.get(found / 2).copied().unwrap_or(f64::NAN);
    let near_share = near as f64 / RUNS as f64;
    let held_share = held as f64 / found.max(1) as f64;
    let has_bar = is_enough(stream, events);
    let is_good = held_share >= HELD_SHARE && (near_share >= NEAR_SHARE || !has_bar);
    println!(
        "{}  latency of {stream} from {events} x {reference}: found in {found} of {RUNS}, within \
         5 ms in {:.1} % ({}), in the stated interval in {:.1} % (bar 93 %), median ± {stated_ms:.1} ms",
        match (is_good, has_bar) {
            (true, true) => "pass",
            (true, false) => "note",
            (false, _) => "FAIL",
        },
        100.0 * near_share,
        if has_bar { "bar 95 %" } else { "bar 95 % not required with so few samples" },
        100.0 * held_share,
    );
    is_good
}

/// Makes a recording; returns what calibration finds in it, and the true lag [s].
fn record(
    reference: Witness,
    stream: Witness,
    events: usize,
    seed: u64,
) -> (Option<Calibration>, f64) {
    let mut chance = Chance(seed);
    let lag_secs = chance.between(-LAG_SECS, LAG_SECS);
    let mut secs = 3.0;
    let scene: Vec<Tap> = (0..events)
        .map(|_| {
            secs += chance.between(2.0, 4.0);
            Tap::new(secs, &mut chance)
        })
        .collect();
    let lasts_secs = secs + 4.0;
    let mut see =
        |witness: Witness, lag_secs| witness.record(&scene, lasts_secs, lag_secs, &mut chance);
    let (a, b) = (see(reference, 0.0), see(stream, lag_secs));
    (calibrate(a.seen(), b.seen(), 1.0).ok(), lag_secs)
}

/// A tap, and a light that turns on with it.
struct Tap {
    secs: f64,
    /// The strength along each axis, in units of gravity.
    strength: [f64; 3],
    ringing_hz: f64,
    lit_secs: f64,
}

impl Tap {
    fn new(secs: f64, chance: &mut Chance) -> Tap {
        let strength = chance.between(1.0, 3.0);
        let direction = [chance.normal(), chance.normal(), chance.normal()];
        let length = direction.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
        Tap {
            secs,
            strength: direction.map(|axis| strength * axis / length),
            ringing_hz: chance.between(15.0, 40.0),
            lit_secs: chance.between(1.5, 1.9),
        }
    }

    /// Returns a blow that rises in a few milliseconds and rings on, as a share of its strength.
    fn blow(&self, secs: f64) -> f64 {
        let since = secs - self.secs;
        if since < 0.0 {
            return 0.0;
        }
        (1.0 - (-since / 0.001).exp())
            * (-since / 0.025).exp()
            * (TAU * self.ringing_hz * since).cos()
    }

    fn light(&self, secs: f64) -> f64 {
        if (0.0..self.lit_secs).contains(&(secs - self.secs)) { 1.0 } else { 0.0 }
    }
}

/// The recording of a witness.
struct Recording {
    times: Vec<i64>,
    values: Option<Vec<f64>>,
}

impl Recording {
    fn seen(&self) -> Seen<'_> {
        match &self.values {
            Some(values) => Seen::Samples { times: &self.times, values },
            None => Seen::Events(&self.times),
        }
    }
}

impl Witness {
    fn record(
        self,
        scene: &[Tap],
        lasts_secs: f64,
        lag_secs: f64,
        chance: &mut Chance,
    ) -> Recording {
        let stamp = |secs: f64| ((1000.0 + secs + lag_secs) * 1e9) as i64;
        let (rate_hz, share, noise) = match self {
            Witness::Button => {
                let times = scene.iter().map(|tap| stamp(tap.secs)).collect();
                return Recording { times, values: None };
            }
            Witness::Accelerometer(rate_hz, share) => (rate_hz, share, 0.005),
            Witness::Camera(rate_hz, share) => (rate_hz, share, 1.0),
        };
        let (mut times, mut values) = (Vec::new(), Vec::new());
        let begin_secs = chance.between(0.0, 1.0 / rate_hz);
        for number in 0..(lasts_secs * rate_hz) as u32 {
            let secs = begin_secs + f64::from(number) / rate_hz;
            times.push(stamp(secs + 0.0003 * chance.normal()));
            let seen = self.see(scene, secs, share / rate_hz);
            values.extend(seen.iter().map(|value| value + noise * chance.normal()));
        }
        Recording { times, values: Some(values) }
    }

    /// Returns the mean over some time around a moment, for each channel.
    fn see(self, scene: &[Tap], secs: f64, exposed_secs: f64) -> Vec<f64> {
        const PARTS: i32 = 20;
        let around = |part: i32| {
            secs + (f64::from(part) + 0.5 - f64::from(PARTS) / 2.0) / f64::from(PARTS)
                * exposed_secs
        };
        let mean = |of: &dyn Fn(f64) -> f64| {
            (0..PARTS).map(|part| of(around(part))).sum::<f64>() / f64::from(PARTS)
        };
        let lasts_secs = if matches!(self, Witness::Camera(..)) { 4.0 } else { 0.4 };
        let near: Vec<&Tap> =
            scene.iter().filter(|tap| (secs - tap.secs).abs() < lasts_secs).collect();
        if matches!(self, Witness::Camera(..)) {
            let light = mean(&|secs| near.iter().map(|tap| tap.light(secs)).sum());
            return vec![40.0 + 80.0 * light];
        }
        let at_rest = [0.3, -0.2, 0.93];
        let sway = 0.03 * (TAU * 0.4 * secs).sin();
        let axis = |axis: usize| {
            let blow =
                mean(&|secs| near.iter().map(|tap| tap.strength[axis] * tap.blow(secs)).sum());
            at_rest[axis] + sway + blow
        };
        (0..3).map(axis).collect()
    }
}

impl fmt::Display for Witness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Witness::Button => f.write_str("button"),
            Witness::Accelerometer(rate_hz, share) => {
                write!(f, "accelerometer at {rate_hz} Hz, {}", averaging(*share))
            }
            Witness::Camera(rate_hz, share) => {
                write!(f, "light at {rate_hz} Hz, {}", averaging(*share))
            }
        }
    }
}

fn averaging(share: f64) -> &'static str {
    if share > 0.0 { "averaged" } else { "momentary" }
}

/// A pseudo-random generator that gives the same numbers for the same seed: splitmix64.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn normal(&mut self) -> f64 {
        let length = (-2.0 * self.between(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        length * (TAU * self.between(0.0, 1.0)).cos()
    }
}
