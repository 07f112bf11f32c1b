//! Joining by movement: two accelerometers on one person.

mod grid;
mod coarse;
mod fine;

use super::line::RobustLine;
use super::{JoinError, Placement, SKEW_FROM_SECS, Search, placement};

use coarse::best_offset;
use fine::{Followed, follow};
use grid::Grid;

/// The fewest stretches in which both moved alike.
const LEAST_STRETCHES: usize = 6;
/// The smallest share of them that agree on one line.
const LEAST_AGREEING: f64 = 0.6;

/// How strongly a sensor was accelerated at a moment, whichever way it was turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movement {
    /// By the clock of its recording [s].
    pub secs: f64,
    /// The length of the vector of acceleration, gravity included, in any unit.
    pub magnitude: f64,
}

/// Joins by the movement that two accelerometers on one person felt, each in the order of time. Sampled at 20 Hz or
/// more; for some minutes at least in which the person moved.
///
/// The envelopes of both movements show where the recording belongs. From there stretches of half a minute are
/// followed: each in which both moved alike shows the offset to a few milliseconds, and a robust line goes through
/// these. How far a movement arrives at one place later than at the other is for [`Search::delay`].
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
