//! Pairs of events, followed in both directions from the part where the offset was found.

use super::correlogram::Lag;

/// The number of events matched at once.
const BLOCK: usize = 32;
/// The rate at which the tolerance grows during a stretch without pairs [s/s].
const DRIFT: f64 = 200e-6;
/// The largest tolerance [s]: less than half of a fast heart's interval.
const MOST_SECS: f64 = 0.15;
/// The smallest share of a block with a partner for its offset to be followed.
const LEAST_SHARE: f64 = 0.5;

/// Matched pairs: the time of each event of the recording [s], and how much later its partner in the session
/// is [s].
pub(super) fn pairs(session: &[f64], recording: &[f64], lag: &Lag) -> Vec<(f64, f64)> {
    let middle = usize::midpoint(lag.first, lag.end);
    let start = Follower {
        session,
        offset: lag.offset_secs,
        at: recording[middle],
        tolerance: lag.tolerance_secs,
    };
    let (mut back, mut on) = (start.clone(), start);
    let mut found = Vec::new();
    for block in recording[..middle].rchunks(BLOCK) {
        found.extend(back.block(block));
    }
    for block in recording[middle..].chunks(BLOCK) {
        found.extend(on.block(block));
    }
    found.sort_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
    found
}

#[derive(Clone)]
struct Follower<'a> {
    session: &'a [f64],
    /// The offset, and where it was last seen [s].
    offset: f64,
    at: f64,
    tolerance: f64,
}

impl Follower<'_> {
    /// The pairs of a block; empty if too few events agree.
    fn block(&mut self, block: &[f64]) -> Vec<(f64, f64)> {
        let middle = block[block.len() / 2];
        let most = MOST_SECS.max(self.tolerance);
        let tolerance = (2.0 * self.tolerance + DRIFT * (middle - self.at).abs()).min(most);
        let pair = |secs: &f64| {
            let nearest = nearest(self.session, secs + self.offset)?;
            let off = nearest - secs;
            ((off - self.offset).abs() <= tolerance).then_some((*secs, off))
        };
        let pairs: Vec<(f64, f64)> = block.iter().filter_map(pair).collect();
        if (pairs.len() as f64) < LEAST_SHARE * block.len() as f64 {
            return Vec::new();
        }
        let mut offsets: Vec<f64> = pairs.iter().map(|pair| pair.1).collect();
        offsets.sort_by(f64::total_cmp);
        (self.offset, self.at) = (offsets[offsets.len() / 2], middle);
        pairs
    }
}

/// The time in an ascending list that is nearest to another.
fn nearest(ascending: &[f64], secs: f64) -> Option<f64> {
    let after = ascending.partition_point(|each| *each < secs);
    let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
    let near = near.filter_map(|place| ascending.get(place).copied());
    near.min_by(|a, b| (a - secs).abs().total_cmp(&(b - secs).abs()))
}
