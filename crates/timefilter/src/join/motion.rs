//! Joining by motion: two accelerometers on one person.

mod grid;
mod coarse;
mod fine;

use super::line::RobustLine;
use super::{JoinError, Placement, SKEW_FROM_SECS, Search, placement};

use coarse::best_offset;
use fine::{Followed, follow};
use grid::Grid;

/// The fewest segments with similar motion.
const LEAST_STRETCHES: usize = 6;
/// The smallest share of these segments that must agree on one line.
const LEAST_AGREEING: f64 = 0.6;

/// The magnitude of acceleration at one moment, which does not depend on the sensor's orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movement {
    /// The time by the recording's clock [s].
    pub secs: f64,
    /// The length of the acceleration vector, including gravity, in any unit.
    pub magnitude: f64,
}

/// Joins two recordings by the motion that accelerometers on one person recorded in both. The sampling rate must be
/// 20 Hz or more, and the person must move for at least a few minutes.
///
/// The envelopes of the two motions show roughly where the recording belongs. From there it is followed in half-minute
/// segments: every segment in which the motions are similar gives the offset to within a few milliseconds, and a robust
/// line is fitted to these offsets. Set [`Search::delay`] to how much later a movement reaches one sensor than the
/// other.
pub fn by_motion(
    session: &[Movement],
    recording: &[Movement],
    search: &Search,
) -> Result<Placement, JoinError> {
    let (session, recording) = (Grid::of(session), Grid::of(recording));
    let (Some(session), Some(recording)) = (session, recording) else {
        return Err(JoinError::Still { found: 0, needed: LEAST_STRETCHES });
    };
    let found = best_offset(&session, &recording, search.max_offset_secs)?;
    let Followed { pairs, stretches } = follow(&session, &recording, found);
    if pairs.len() < LEAST_STRETCHES {
        return Err(JoinError::Still { found: pairs.len(), needed: LEAST_STRETCHES });
    }
    let line = RobustLine::through(&pairs, SKEW_FROM_SECS).ok_or(JoinError::Apart)?;
    let agreeing = line.count as f64 / pairs.len() as f64;
    if agreeing < LEAST_AGREEING {
        return Err(JoinError::Unlike { share: agreeing });
    }
    Ok(placement(&line, line.count as f64 / stretches.max(1) as f64, search))
}

#[cfg(test)]
mod tests;
