//! Bins of which all packets were held up.

use super::Packet;

/// How near to each other the delays of raised bins are after a jump [s].
const AGREE_SECS: f64 = 0.05;
/// How many bins of high delays in agreement mean that the clock was set back.
pub(super) const RAISED_BINS: usize = 4;
/// After how many raised bins the way has become longer for good.
pub(in crate::clock) const RAISED_LONG: usize = 450;
/// By how much delays may change in half of that and be of a way that is longer for good [s].
const GROWN_SECS: f64 = 0.5;

/// Bins in a row in which all came late.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raised {
    pub bins: usize,
    /// Whether all agree with each other.
    agree: bool,
    delay: f64,
    /// How far the last one is above the line [s].
    pub height: f64,
    /// Whether numbers show that the clock goes on.
    pub vouched: bool,
    pub packets: [Packet; RAISED_BINS],
    /// The lowest delays of the first half of so many bins as last, and of the second.
    halves: [f64; 2],
}

impl Default for Raised {
    fn default() -> Raised {
        let none = Packet { device: 0, arrival: 0 };
        Raised {
            bins: 0,
            agree: true,
            delay: 0.0,
            height: 0.0,
            vouched: false,
            packets: [none; RAISED_BINS],
            halves: [f64::MAX; 2],
        }
    }
}

impl Raised {
    /// Whether the way has become longer for good: it lasts, and delays do not go on growing as those of a
    /// link that is too slow do.
    pub fn lasts(&mut self) -> bool {
        if self.bins < RAISED_LONG {
            return false;
        }
        let [first, second] = self.halves;
        let is_steady = (second - first).abs() < GROWN_SECS;
        if !is_steady {
            (self.bins, self.halves) = (RAISED_BINS, [f64::MAX; 2]);
        }
        is_steady
    }

    /// By how much the line may be wrong because of them [s]. A clock that goes on while delays grow
    /// gradually is a slow link; of one that was raised at once even numbers may not show that it stood
    /// still with its samples.
    pub fn unclear(&self) -> f64 {
        if self.vouched && !self.agree { 0.0 } else { self.height }
    }

    /// Takes a bin's lowest delay and how far that is above the line; whether the bins now show that
    /// the clock was set back: they were raised at once, and by the same.
    pub fn push(&mut self, delay: f64, height: f64, packet: Packet) -> bool {
        self.agree &= self.bins == 0 || (delay - self.delay).abs() < AGREE_SECS;
        let half = &mut self.halves[usize::from(self.bins >= RAISED_LONG / 2)];
        *half = half.min(delay);
        self.bins += 1;
        self.delay = if self.bins == 1 { delay } else { self.delay.min(delay) };
        self.height = height.max(0.0);
        self.packets.rotate_left(1);
        self.packets[RAISED_BINS - 1] = packet;
        self.agree && self.bins >= RAISED_BINS
    }
}
