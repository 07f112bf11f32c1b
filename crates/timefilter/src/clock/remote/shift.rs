//! By how much stamps are shifted: a line of many pieces, steered from where it has come to.

use std::collections::VecDeque;

/// How many corners are remembered, for stamps that come out of their turn.
const CORNERS: usize = 16;
/// Within how much time an error is worked off [ns].
const WITHIN_NANOS: f64 = 3e9;
/// No clock is taken to be faster or slower than this [1].
const SKEWED: f64 = 5e-4;
/// No error is worked off faster than this [1].
const FASTEST: f64 = 0.5;
/// How far beyond its last corner the line is drawn [ns]: an hour.
const FURTHEST_NANOS: i64 = 3_600_000_000_000;

/// The shift of stamps: a continuous function of the stamp, so steep nowhere that a later stamp
/// would be shifted before an earlier one.
#[derive(Clone, Debug, Default)]
pub(super) struct Shift {
    corners: VecDeque<Corner>,
    /// How it goes on behind the last corner.
    slope: f64,
    /// The latest stamp so far.
    latest: Option<i64>,
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    stamp: i64,
    offset: i64,
}

impl Shift {
    /// What it allocates at most [B].
    pub(super) const BYTES: usize = CORNERS.next_power_of_two() * size_of::<Corner>();

    /// A stamp, shifted.
    pub(super) fn apply(&mut self, stamp: i64) -> i64 {
        self.latest = self.latest.max(Some(stamp));
        self.of(stamp)
    }

    /// The same for a stamp of long ago, which settles nothing.
    pub(super) fn of(&self, stamp: i64) -> i64 {
        stamp.saturating_sub(self.at(stamp))
    }

    /// Whether any stamp was shifted by it.
    pub(super) fn is_used(&self) -> bool {
        self.latest.is_some()
    }

    /// What the latest stamp was shifted by [ns].
    pub(super) fn newest(&self) -> i64 {
        self.latest.map_or(0, |latest| self.at(latest))
    }

    /// From the latest stamp on it approaches this offset [ns], which itself changes by `slope`;
    /// before the first stamp it is there at once.
    pub(super) fn steer(&mut self, target: i64, slope: f64) {
        let slope = slope.clamp(-SKEWED, SKEWED);
        let Some(latest) = self.latest else {
            // Where the first stamp will lie is not known: until then the offset stands still.
            self.corners = VecDeque::from([Corner { stamp: i64::MIN, offset: target }]);
            self.slope = 0.0;
            return;
        };
        let offset = self.at(latest);
        let error = target.saturating_sub(offset) as f64;
        let approach = slope + (error / WITHIN_NANOS).clamp(-FASTEST, FASTEST);
        self.corners.retain(|corner| corner.stamp < latest);
        let excess = self.corners.len().saturating_sub(CORNERS - 2);
        self.corners.drain(..excess);
        self.corners.push_back(Corner { stamp: latest, offset });
        let there = offset.saturating_add((approach * WITHIN_NANOS) as i64);
        let stamp = latest.saturating_add(WITHIN_NANOS as i64);
        self.corners.push_back(Corner { stamp, offset: there });
        self.slope = slope;
    }

    fn at(&self, stamp: i64) -> i64 {
        let after = self.corners.partition_point(|corner| corner.stamp <= stamp);
        let Some(next) = self.corners.get(after) else {
            let Some(last) = self.corners.back() else { return 0 };
            let beyond = stamp.saturating_sub(last.stamp).min(FURTHEST_NANOS);
            return last.offset.saturating_add((self.slope * beyond as f64) as i64);
        };
        let Some(before) = after.checked_sub(1).map(|before| self.corners[before]) else {
            return next.offset;
        };
        let part = stamp.saturating_sub(before.stamp) as f64
            / next.stamp.saturating_sub(before.stamp).max(1) as f64;
        let change = next.offset.saturating_sub(before.offset) as f64 * part;
        before.offset.saturating_add(change as i64)
    }
}
