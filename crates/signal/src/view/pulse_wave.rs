//! The pulse wave in the colour of skin, at an even rate.

use std::collections::VecDeque;

use super::Frame;

/// The rate of the wave [Hz].
pub(super) const WAVE_HZ: f64 = 30.0;
const STEP_NS: f64 = 1e9 / WAVE_HZ;
/// The window of the projection, 1.6 s [samples].
const WINDOW: usize = 48;
/// The longest time between two frames that is bridged [ns]: below 12 frames a second there is no wave.
const PAUSE_NS: i64 = 250_000_000;
/// A larger change of colour between two frames, as a share, means a different face or different light.
const JUMP: f64 = 0.2;

/// A sample of the wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaveSample {
    pub at_ns: i64,
    /// The pulse, as a share of the colour.
    pub pulse: f64,
    /// The brightness of the view [0..1].
    pub brightness: f64,
    /// The mean green of the skin [0..1].
    pub green: f64,
    /// The share of the view that is skin [0..1].
    pub skin: f64,
}

/// Computes the wave from frames at irregular times.
#[derive(Clone, Debug, Default)]
pub(super) struct PulseWave {
    last: Option<Frame>,
    /// The time of the next sample [ns].
    next_ns: f64,
    /// The newest samples: their colours, and the wave as far as it is complete.
    colours: VecDeque<[f64; 3]>,
    waiting: VecDeque<WaveSample>,
}

impl PulseWave {
    /// Takes in a frame; calls `out` with each sample that is complete, and with `None` where the wave is
    /// interrupted.
    pub fn push(&mut self, frame: Frame, mut out: impl FnMut(Option<WaveSample>)) {
        let is_known = frame.colour.iter().all(|part| *part > 0.0) && frame.brightness.is_finite();
        let Some(last) = self.last.filter(|last| is_known && follows(last, &frame)) else {
            if self.last.is_some() {
                out(None);
            }
            let (last, next_ns) = (is_known.then_some(frame), frame.at_ns as f64);
            *self = PulseWave { last, next_ns, ..PulseWave::default() };
            return;
        };
        let passed = (frame.at_ns - last.at_ns) as f64;
        while self.next_ns <= frame.at_ns as f64 {
            let share = ((self.next_ns - last.at_ns as f64) / passed).clamp(0.0, 1.0);
            let between = |from: f64, to: f64| from + share * (to - from);
            let colour = [0, 1, 2].map(|part| between(last.colour[part], frame.colour[part]));
            self.colours.push_back(colour);
            self.waiting.push_back(WaveSample {
                at_ns: self.next_ns.round() as i64,
                pulse: 0.0,
                brightness: between(last.brightness, frame.brightness),
                green: colour[1],
                skin: frame.skin,
            });
            self.next_ns += STEP_NS;
            if self.colours.len() == WINDOW {
                self.project();
                self.colours.pop_front();
                out(self.waiting.pop_front());
            }
        }
        self.last = Some(frame);
    }

    /// Adds the projection of the newest window to the wave.
    fn project(&mut self) {
        let mut mean = [0.0; 3];
        for colour in &self.colours {
            mean.iter_mut().zip(colour).for_each(|(mean, part)| *mean += part / WINDOW as f64);
        }
        let [red, green, blue] = mean;
        let axes = |[r, g, b]: &[f64; 3]| {
            let (r, g, b) = (r / red, g / green, b / blue);
            (g - b, g + b - 2.0 * r)
        };
        let spread = |axis: &dyn Fn(&[f64; 3]) -> f64| {
            let (sum, square) = self.colours.iter().fold((0.0, 0.0), |(sum, square), colour| {
                let number = axis(colour);
                (sum + number, square + number * number)
            });
            let mean = sum / WINDOW as f64;
            (mean, (square / WINDOW as f64 - mean * mean).max(0.0).sqrt())
        };
        let (mean_one, spread_one) = spread(&|colour| axes(colour).0);
        let (mean_other, spread_other) = spread(&|colour| axes(colour).1);
        let weight = if spread_other > 0.0 { spread_one / spread_other } else { 0.0 };
        for (sample, colour) in self.waiting.iter_mut().zip(&self.colours) {
            let (one, other) = axes(colour);
            sample.pulse += (one - mean_one + weight * (other - mean_other)) / WINDOW as f64;
        }
    }
}

/// Whether a frame continues the wave of the one before it.
fn follows(last: &Frame, frame: &Frame) -> bool {
    let is_soon = (1..=PAUSE_NS).contains(&(frame.at_ns - last.at_ns));
    let is_same = |part: usize| (frame.colour[part] / last.colour[part] - 1.0).abs() < JUMP;
    is_soon && (0..3).all(is_same)
}
