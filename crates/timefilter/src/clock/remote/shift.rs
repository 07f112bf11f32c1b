//! The shift of timestamps: piecewise linear, and steered from its present value.

use std::collections::VecDeque;

/// The number of knots kept, for timestamps that arrive out of order.
const CORNERS: usize = 16;
/// The time within which an error is corrected [ns].
const WITHIN_NANOS: f64 = 3e9;
/// The largest skew that is assumed [1].
const SKEWED: f64 = 5e-4;
/// The fastest correction of an error [1].
const FASTEST: f64 = 0.5;
/// How far the shift is extrapolated beyond its last knot [ns]: one hour.
const FURTHEST_NANOS: i64 = 3_600_000_000_000;

/// The shift of timestamps: a continuous function of the timestamp, limited in slope so that it preserves
/// their order.
#[derive(Clone, Debug, Default)]
pub(super) struct Shift {
    corners: VecDeque<Corner>,
    /// The slope beyond the last knot.
    slope: f64,
    /// The latest timestamp so far.
    latest: Option<i64>,
}

#[derive(Clone, Copy, Debug)]
struct Corner {
    stamp: i64,
    offset: i64,
}

impl Shift {
    /// The most memory that it allocates [B].
    pub(super) const BYTES: usize = CORNERS.next_power_of_two() * size_of::<Corner>();

    /// Shifts a timestamp.
    pub(super) fn apply(&mut self, stamp: i64) -> i64 {
        self.latest = self.latest.max(Some(stamp));
        self.of(stamp)
    }

    /// Shifts an old timestamp, without fixing the shift up to it.
    pub(super) fn of(&self, stamp: i64) -> i64 {
        stamp.saturating_sub(self.at(stamp))
    }

    /// Whether any timestamp has been shifted.
    pub(super) fn is_used(&self) -> bool {
        self.latest.is_some()
    }

    /// The shift of the latest timestamp [ns].
    pub(super) fn newest(&self) -> i64 {
        self.latest.map_or(0, |latest| self.at(latest))
    }

    /// Steers the shift towards `target` [ns], which changes with `slope`, from the latest timestamp on;
    /// before the first timestamp the shift is set at once.
    pub(super) fn steer(&mut self, target: i64, slope: f64) {
        let slope = slope.clamp(-SKEWED, SKEWED);
        let Some(latest) = self.latest else {
            // The first timestamp is not known yet: until then the offset is constant.
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
