//! Bins in which all packets were delayed.

use super::Packet;

/// How close the delays of raised bins must be after a jump [s].
const AGREE_SECS: f64 = 0.05;
/// The number of raised bins with similar delays that show that the clock was set back.
pub(super) const RAISED_BINS: usize = 4;
/// The number of raised bins after which the path delay counts as permanently longer.
pub(in crate::clock) const RAISED_LONG: usize = 450;
/// How much delays may change over half of those bins for the increase to be permanent [s].
const GROWN_SECS: f64 = 0.5;

/// A run of consecutive raised bins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raised {
    pub bins: usize,
    /// Whether their delays are similar.
    agree: bool,
    delay: f64,
    /// How far the last bin is above the line [s].
    pub height: f64,
    /// Whether sample indices show that the clock runs on.
    pub vouched: bool,
    pub packets: [Packet; RAISED_BINS],
    /// The lowest delay in each half of the run.
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
    /// Whether the path delay has increased permanently: the run is long, and its delays do not keep
    /// growing as on an overloaded link.
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

    /// The additional uncertainty of the line due to the run [s]. A clock that runs on while delays grow
    /// gradually means a slow link; after a sudden rise, the device may have stopped sampling together with
    /// its clock, which sample indices do not show.
    pub fn unclear(&self) -> f64 {
        if self.vouched && !self.agree { 0.0 } else { self.height }
    }

    /// Adds a bin by its lowest delay and its height above the line. Returns whether the clock was set
    /// back: the bins were raised suddenly, all by the same amount.
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
