//! The map from device time to session time: continuous and piecewise linear.

use std::collections::VecDeque;

/// The number of pieces kept for late device times.
const KNOTS: usize = 64;
/// The steepest slope of a piece: it keeps the map strictly increasing.
const STEEPEST: f64 = 0.5;

/// The offset of session time from device time, as a continuous piecewise linear function.
///
/// Mapped times are final: a bend starts at the newest mapped device time, so that an older one is later
/// mapped by the same function. Device times at least 4 ns apart keep their order.
#[derive(Clone, Debug)]
pub(super) struct OffsetMap {
    /// The knots in order of device time, at least one.
    knots: VecDeque<Knot>,
    frontier: i64,
}

/// The start of a piece.
#[derive(Clone, Copy, Debug)]
struct Knot {
    /// Device time since the epoch's first reading [ns].
    device: i64,
    /// Session time minus device time at the knot [ns].
    offset: f64,
    /// The slope of the offset over device time.
    slope: f64,
}

impl OffsetMap {
    /// The memory that it allocates [B].
    pub const BYTES: usize = (KNOTS + 2) * size_of::<Knot>();

    /// A constant offset [ns].
    pub fn level(offset: f64) -> OffsetMap {
        let mut knots = VecDeque::with_capacity(KNOTS + 2);
        knots.push_back(Knot { device: 0, offset, slope: 0.0 });
        OffsetMap { knots, frontier: 0 }
    }

    /// The offset at a device time [ns], without fixing the map up to it.
    pub fn at(&self, device: i64) -> f64 {
        let newest = self.knots.len() - 1;
        let piece = self.knots.iter().rposition(|knot| knot.device <= device);
        let knot = &self.knots[piece.unwrap_or(0).min(newest)];
        knot.offset + knot.slope * (i128::from(device) - i128::from(knot.device)) as f64
    }

    /// Makes the map final up to a device time [ns].
    pub fn settle(&mut self, device: i64) {
        self.frontier = self.frontier.max(device);
    }

    /// The newest device time up to which the map is fixed [ns].
    pub fn frontier(&self) -> i64 {
        self.frontier
    }

    /// Steers the map from the frontier to the offset `target` over `within` [ns] and continues with
    /// `slope`, correcting by no more than `limit` (a slope).
    pub fn lead_to(&mut self, target: f64, slope: f64, within: f64, limit: f64) {
        let here = Knot { device: self.frontier, offset: self.at(self.frontier), slope };
        while self.knots.back().is_some_and(|knot| knot.device >= here.device) {
            self.knots.pop_back();
        }
        let error = target - here.offset;
        let correction = (error / within).clamp(-limit, limit);
        let steep = (slope + correction).clamp(-STEEPEST, STEEPEST);
        let first = Knot { slope: steep, ..here };
        self.push(first);
        if correction != 0.0 {
            let end = here.device.saturating_add((error / correction).min(1e15) as i64);
            let offset = first.offset + steep * (end - here.device) as f64;
            let slope = slope.clamp(-STEEPEST, STEEPEST);
            self.push(Knot { device: end, offset, slope });
        }
    }

    fn push(&mut self, knot: Knot) {
        if self.knots.len() > KNOTS {
            self.knots.pop_front();
        }
        self.knots.push_back(knot);
    }
}
