//! Joining: finds where a recording with another clock belongs on a session's time axis, from events that both
//! recorded, such as heartbeats or button presses.
//!
//! Only the times of events are used. The distances between all pairs of an event of the session and one of
//! the recording form a histogram; at the true offset, most events agree on one distance. Irregular events,
//! such as heartbeats, agree nowhere else. Regular ones agree at many offsets, and a few agree at some offset by
//! chance; then the result is an error rather than a guess. From the best offset, pairs are followed outwards
//! across gaps, and a robust line through them gives offset and skew.
//!
//! Two accelerometers on one person need no events ([`by_motion`]): half-minute segments with similar motion
//! take their place.
//!
//! **Stated error.** Half of the 95 % interval of a placed time is the root of the sum of squares of four
//! terms: the uncertainty of the line at that time, from the scatter of its pairs in blocks of a minute, since
//! the errors of neighbours are correlated; the resolution of the stamps; for a recording that is too short to
//! show its skew, the effect of [`UNKNOWN_SKEW_PPM`] on times away from the middle; and the uncertainty of the
//! delay.
//!
//! **Delay.** How much later the recording shows an event than the session does, if both clocks are right. No
//! clock can show it, so it must be known: the pulse of a heartbeat arrives at the wrist 200 to 300 ms after
//! the R wave, which differs between people by tens of milliseconds.
//!
//! ```
//! use teampulse_timefilter::clock::Latency;
//! use teampulse_timefilter::join::{Search, by_beats};
//!
//! // Beats of an irregular heart, whose pulses a watch shows 250 ms later, with its clock 40 s behind.
//! let beats: Vec<f64> = (0..300).map(f64::from).map(|k| 0.9 * k + 0.06 * (0.37 * k * k).sin()).collect();
//! let pulses: Vec<f64> = beats.iter().map(|beat| beat + 0.25 - 40.0).collect();
//!
//! let search = Search { delay: Latency::new(0.25, 0.02), ..Search::default() };
//! let found = by_beats(&beats, &pulses, &search)?;
//! assert!((found.session_from_device(100.0) - 140.0).abs() < 0.002);
//! assert!((0.02..0.03).contains(&found.uncertainty_secs(100.0)));
//! # Ok::<(), teampulse_timefilter::join::JoinError>(())
//! ```

mod chance;
mod correlogram;
mod follow;
mod line;
mod motion;
mod error;

use crate::clock::Latency;

pub use error::JoinError;
pub use motion::{Movement, by_motion};

use chance::expected_by_chance;
use correlogram::best_lag;
use follow::pairs;
use line::RobustLine;

/// The fewest beats required in each recording.
const LEAST_BEATS: usize = 40;
/// The smallest share of the recording's events in the common time that must have a partner.
const LEAST_SHARE: f64 = 0.5;
/// A placement is refused if more offsets than this would fit as well by chance.
const MOST_EXPECTED: f64 = 0.01;
/// Recordings that overlap at least this long show their skew [s].
const SKEW_FROM_SECS: f64 = 480.0;
/// The assumed rate difference of two device clocks where a recording is too short to show it [ppm, 95 %].
pub const UNKNOWN_SKEW_PPM: f64 = 100.0;
/// The tolerance of a distance between two beats [s], and between two presses.
const BEAT_SECS: f64 = 0.03;
const MARK_SECS: f64 = 0.1;

/// The search settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// The largest distance between the two clocks [s]; infinite if nothing is known about it.
    pub max_offset_secs: f64,
    /// How much later the recording shows an event, if both clocks are right.
    pub delay: Latency,
    /// Half of the resolution of the recording's event timestamps [s].
    pub resolution_secs: f64,
}

impl Default for Search {
    fn default() -> Search {
        let (max_offset_secs, delay) = (f64::INFINITY, Latency::new(0.0, 0.0));
        Search { max_offset_secs, delay, resolution_secs: 0.0 }
    }
}

/// The placement of a recording on the session's time axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The time of the recording's clock at which the offset applies [s]: the middle of the pairs.
    pub center_secs: f64,
    /// The offset added to the recording's time there [s].
    pub offset_secs: f64,
    /// How much slower the recording's clock runs than the session's [ppm]; 0 if the recording is too short to
    /// show it.
    pub skew_ppm: f64,
    /// The number of events matched in both recordings, or of segments with similar motion.
    pub pairs: usize,
    /// The share of the recording's events, or segments, in the common time that have a partner [0..1].
    pub share: f64,
    /// The spread of the pairs around the line, 1.4826 · MAD [s].
    pub spread_secs: f64,
    line_95_secs: f64,
    skew_95_ppm: f64,
    fixed_95_secs: f64,
}

impl Placement {
    /// Converts a time of the recording's clock [s] to session time [s].
    pub fn session_from_device(&self, secs: f64) -> f64 {
        secs + self.offset_secs + self.skew_ppm * 1e-6 * (secs - self.center_secs)
    }

    /// Half the width of the 95 % interval of a placed time [s]; `secs` is by the recording's clock.
    pub fn uncertainty_secs(&self, secs: f64) -> f64 {
        let of_skew = self.skew_95_ppm * 1e-6 * (secs - self.center_secs);
        self.line_95_secs.hypot(of_skew).hypot(self.fixed_95_secs)
    }

    /// Half the width of the 95 % interval of the skew [ppm].
    pub fn skew_uncertainty_ppm(&self) -> f64 {
        self.skew_95_ppm
    }
}

/// Joins by many irregular events: the times of heartbeats [s], in any order.
pub fn by_beats(
    session: &[f64],
    recording: &[f64],
    search: &Search,
) -> Result<Placement, JoinError> {
    let (session, recording) = (sorted(session), sorted(recording));
    let found = session.len().min(recording.len());
    if found < LEAST_BEATS {
        return Err(JoinError::Few { found, needed: LEAST_BEATS });
    }
    let lag = best_lag(&session, &recording, search.max_offset_secs, BEAT_SECS)?;
    let pairs = pairs(&session, &recording, &lag);
    placed(&session, &recording, &pairs, search)
}

/// Joins by a few events that both recorded, such as button presses [s], in any order. One event is enough if
/// neither recording has another; several must be unevenly spaced, and more must agree than would by chance.
pub fn by_marks(
    session: &[f64],
    recording: &[f64],
    search: &Search,
) -> Result<Placement, JoinError> {
    let (session, recording) = (sorted(session), sorted(recording));
    if session.is_empty() || recording.is_empty() {
        return Err(JoinError::Few { found: 0, needed: 1 });
    }
    let lag = best_lag(&session, &recording, search.max_offset_secs, MARK_SECS)?;
    let pairs = pairs(&session, &recording, &lag);
    placed(&session, &recording, &pairs, search)
}

/// The finite times in ascending order.
fn sorted(secs: &[f64]) -> Vec<f64> {
    let mut secs: Vec<f64> = secs.iter().copied().filter(|secs| secs.is_finite()).collect();
    secs.sort_by(f64::total_cmp);
    secs.dedup();
    secs
}

/// The line through pairs.
fn placed(
    session: &[f64],
    recording: &[f64],
    pairs: &[(f64, f64)],
    search: &Search,
) -> Result<Placement, JoinError> {
    let line = RobustLine::through(pairs, SKEW_FROM_SECS).ok_or(JoinError::Apart)?;
    let common = |secs: &&f64| {
        let at = **secs + line.at(**secs);
        session.first().is_some_and(|first| at >= first - 1.0)
            && session.last().is_some_and(|last| at <= last + 1.0)
    };
    let share = line.count as f64 / recording.iter().filter(common).count().max(line.count) as f64;
    if share < LEAST_SHARE {
        return Err(JoinError::Unlike { share });
    }
    // If every event of both has a partner, the user vouches that they are the same events.
    let all = line.count == session.len() && line.count == recording.len();
    if !all && expected_by_chance(session, recording, &line, search.max_offset_secs) > MOST_EXPECTED
    {
        return Err(JoinError::Chance { agree: line.count, events: recording.len() });
    }
    Ok(placement(&line, share, search))
}

/// The placement given by a line through pairs; `share` is the share of the recording that is matched.
fn placement(line: &RobustLine, share: f64, search: &Search) -> Placement {
    let skew_95_ppm = if line.has_slope { 1e6 * line.slope_95 } else { UNKNOWN_SKEW_PPM };
    Placement {
        center_secs: line.center,
        offset_secs: line.at_center + search.delay.secs,
        skew_ppm: 1e6 * line.slope,
        pairs: line.count,
        share,
        spread_secs: line.spread,
        line_95_secs: line.center_95,
        skew_95_ppm,
        fixed_95_secs: search.delay.uncertainty_secs.hypot(search.resolution_secs),
    }
}

#[cfg(test)]
mod tests;
