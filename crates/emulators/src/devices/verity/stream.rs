use super::VerityModel;
use super::control::Kind;
use super::delta::compress;
use crate::devices::Wearer;
use crate::devices::pmd::{MTU, POWER_ON_NS};

/// The largest size of a value [bytes]: three less than the MTU.
const MOST_BYTES: usize = MTU as usize - 3;

/// Counts of the green light for a sensor on the skin, their change by a pulse, the gain of each pair of light and
/// sensor, and the ambient light. Magnitudes as in issue 445.
const LIGHT: f64 = 430_000.0;
const LIGHT_OF_PULSE: f64 = 40_000.0;
const GAINS: [f64; 3] = [1.0, 0.87, 1.02];
const AMBIENT: i32 = 184_000;

/// An active measurement of samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream {
    pub kind: Kind,
    model: VerityModel,
    /// The rate by the sensor's quartz \[Hz\].
    rate_hz: f64,
    /// When the first sample was taken, in true time \[s\].
    began_secs: f64,
    /// The number of samples that were sent or lost.
    taken: u64,
}

impl Stream {
    /// Creates a stream; `quartz` is the speed of the sensor's clock: 1.02 if it is 2 % too fast.
    pub fn new(kind: Kind, model: VerityModel, began_secs: f64, quartz: f64) -> Self {
        // The true rate, which may differ from the reported one.
        let rate_hz = match (kind, model) {
            (Kind::Ppg, VerityModel::VeritySense) => 55.0,
            (Kind::Ppg, VerityModel::Oh1) => 135.0,
            (_, VerityModel::VeritySense) => 52.0,
            (_, VerityModel::Oh1) => 50.0,
        };
        Self { kind, model, rate_hz: rate_hz * quartz, began_secs, taken: 0 }
    }

    /// The number of samples per frame that real sensors send (issues 317 and 318).
    const fn samples_per_frame(self) -> u64 {
        match (self.kind, self.model) {
            (Kind::Ppg, VerityModel::VeritySense) => 42,
            (Kind::Ppg, VerityModel::Oh1) => 18,
            (_, VerityModel::VeritySense) => 71,
            (_, VerityModel::Oh1) => 36,
        }
    }

    fn secs_of(self, sample: u64) -> f64 {
        self.began_secs + sample as f64 / self.rate_hz
    }

    /// Returns when the next frame is complete \[s\].
    pub fn due_secs(self) -> f64 {
        self.secs_of(self.taken + self.samples_per_frame() - 1)
    }

    /// Returns the frame that is due, or several if compression does not make it small enough for one packet.
    pub fn frames(&mut self, wearer: &mut dyn Wearer, quartz: f64) -> Vec<Vec<u8>> {
        let from = self.taken;
        self.taken += self.samples_per_frame();
        let secs = (from..self.taken).map(|sample| self.secs_of(sample));
        if self.kind == Kind::Ppg {
            let samples: Vec<[i32; 4]> = secs.map(|secs| light(secs, wearer)).collect();
            self.write(&samples, from, quartz)
        } else {
            let samples: Vec<[i32; 3]> = secs.map(|secs| acceleration(secs, wearer)).collect();
            self.write(&samples, from, quartz)
        }
    }

    /// Writes samples from a number on, each frame stamped with the time of its last sample.
    fn write<const N: usize>(self, samples: &[[i32; N]], from: u64, quartz: f64) -> Vec<Vec<u8>> {
        let (frame_type, bytes) = if self.kind == Kind::Ppg { (0, 3) } else { (1, 2) };
        let is_compressed = self.model == VerityModel::VeritySense;
        let payload = if is_compressed {
            compress(samples, bytes)
        } else {
            let values = samples.iter().flatten();
            values.flat_map(|value| value.to_le_bytes().into_iter().take(bytes)).collect()
        };
        let last_secs = self.secs_of(from + samples.len() as u64 - 1);
        let stamp_ns = POWER_ON_NS + (last_secs * quartz * 1e9).round() as u64;
        let mut frame = vec![self.kind as u8];
        frame.extend(stamp_ns.to_le_bytes());
        frame.push(if is_compressed { frame_type | 0x80 } else { frame_type });
        frame.extend(payload);
        if frame.len() <= MOST_BYTES || samples.len() < 2 {
            return vec![frame];
        }
        let (first, second) = samples.split_at(samples.len() / 2);
        let mut frames = self.write(first, from, quartz);
        frames.extend(self.write(second, from + first.len() as u64, quartz));
        frames
    }
}

/// Returns three values of green light through the skin, and ambient light.
fn light(secs: f64, wearer: &mut dyn Wearer) -> [i32; 4] {
    let counts = LIGHT + LIGHT_OF_PULSE * wearer.light(secs);
    let [one, two, three] = GAINS.map(|gain| (gain * counts).round() as i32);
    [one, two, three, AMBIENT]
}

/// Returns the acceleration [mg], limited to the range of 8 g.
fn acceleration(secs: f64, wearer: &mut dyn Wearer) -> [i32; 3] {
    wearer.acceleration_mg(secs).map(|mg| mg.round().clamp(-8000.0, 8000.0) as i32)
}
