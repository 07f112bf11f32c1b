//! Whether blinks go up or down, which depends on the reference electrode.

use super::candidates::Candidate;

/// How much of what was seen before counts after the next candidate.
const KEPT: f64 = 0.95;
/// So much higher than its neighbour is what is no mere rebound of it.
const NO_REBOUND: f64 = 1.5;

/// Weighs candidates of both directions.
///
/// Where blinks follow each other fast, what lies between two looks like one of the other direction:
/// it comes right after one and is hardly higher, and does not count.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Polarity {
    balance_uv: f64,
    last: Option<Candidate>,
}

impl Polarity {
    /// Whether a candidate has the polarity of most, including itself; `reach` is the range that counts as
    /// near [samples].
    pub(super) fn fits(&mut self, candidate: &Candidate, reach: usize) -> bool {
        if self.is_rebound(candidate, reach) {
            return false;
        }
        self.last = Some(*candidate);
        self.balance_uv = KEPT * self.balance_uv + candidate.height_uv;
        self.balance_uv * candidate.height_uv.signum() > 0.0
    }

    fn is_rebound(&self, candidate: &Candidate, reach: usize) -> bool {
        let Some(last) = self.last else { return false };
        let is_opposite = self.balance_uv * candidate.height_uv.signum() < 0.0;
        let is_close = candidate.place - last.place <= reach as f64;
        let is_low = candidate.height_uv.abs() < NO_REBOUND * last.height_uv.abs();
        is_opposite && is_close && is_low
    }
}
