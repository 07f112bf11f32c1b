//! The polarity of blinks, which depends on the reference electrode.

use super::candidates::Candidate;

/// The decay of earlier evidence per candidate.
const KEPT: f64 = 0.95;
/// A candidate this many times higher than its neighbour is not its rebound.
const NO_REBOUND: f64 = 1.5;

/// Weighs candidates of both polarities.
///
/// Between blinks in quick succession the signal resembles a blink of the opposite polarity: such rebounds
/// follow at once, are hardly higher, and do not count.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Polarity {
    balance_uv: f64,
    last: Option<Candidate>,
}

impl Polarity {
    /// Whether a candidate has the polarity of most candidates, itself included; candidates within `reach` [samples]
    /// are neighbours.
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
