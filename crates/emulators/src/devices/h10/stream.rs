use super::control::Kind;
use crate::devices::Wearer;
use crate::devices::pmd::POWER_ON_NS;

/// An active measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream {
    pub kind: Kind,
    /// The rate by the strap's quartz \[Hz\].
    rate_hz: f64,
    /// When the first sample was taken, in true time \[s\].
    began_secs: f64,
    /// The number of samples that were sent or lost.
    taken: u64,
}

impl Stream {
    /// Creates a stream; `quartz` is the speed of the strap's clock: 1.02 if it is 2 % too fast.
    pub fn new(kind: Kind, rate_hz: u16, began_secs: f64, quartz: f64) -> Self {
        Self { kind, rate_hz: f64::from(rate_hz) * quartz, began_secs, taken: 0 }
    }

    /// The number of samples that fit into a packet of 232 bytes.
    const fn samples_per_frame(self) -> u64 {
        match self.kind {
            Kind::Ecg => 73,
            Kind::Acceleration => 36,
        }
    }

    fn secs_of(self, sample: u64) -> f64 {
        self.began_secs + sample as f64 / self.rate_hz
    }

    /// Returns when the next frame is complete \[s\].
    pub fn due_secs(self) -> f64 {
        self.secs_of(self.taken + self.samples_per_frame() - 1)
    }

    /// Returns the frame that is due, stamped by the strap's clock, which has run since power-on.
    pub fn frame(&mut self, wearer: &mut dyn Wearer, quartz: f64, set_by_ns: u64) -> Vec<u8> {
        let stamp_ns = POWER_ON_NS + set_by_ns + (self.due_secs() * quartz * 1e9).round() as u64;
        let (kind, frame_type) = match self.kind {
            Kind::Ecg => (0, 0),
            Kind::Acceleration => (2, 1),
        };
        let mut frame = vec![kind];
        frame.extend(stamp_ns.to_le_bytes());
        frame.push(frame_type);
        for sample in self.taken..self.taken + self.samples_per_frame() {
            self.sample(self.secs_of(sample), wearer, &mut frame);
        }
        self.taken += self.samples_per_frame();
        frame
    }

    fn sample(self, secs: f64, wearer: &mut dyn Wearer, frame: &mut Vec<u8>) {
        match self.kind {
            Kind::Ecg => {
                // The input range of an H10 is ±20 mV.
                let uv = wearer.ecg_uv(secs).round().clamp(-20_000.0, 20_000.0) as i32;
                let [low, middle, high, _] = uv.to_le_bytes();
                frame.extend([low, middle, high]);
            }
            Kind::Acceleration => {
                for mg in wearer.acceleration_mg(secs) {
                    frame.extend((mg.round().clamp(-8000.0, 8000.0) as i16).to_le_bytes());
                }
            }
        }
    }
}
