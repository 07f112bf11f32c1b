//! Changes between successive frames.

use super::blocks::Blocks;

/// The longest time between two frames that are compared [s].
const PAUSE_SECS: f64 = 2.0;
/// The smallest change of a block that counts as movement: absolute [0..1], and in standard deviations of the noise.
const LEAST_CHANGE: f64 = 0.008;
const BEYOND: f64 = 5.0;
/// The ratio of the standard deviation to the median absolute deviation of a normal distribution.
const OF_MEDIAN: f64 = 1.4826;

/// Compares each frame with the one before it.
#[derive(Clone, Debug, Default)]
pub(super) struct Movement {
    columns: usize,
    at: f64,
    lumas: Vec<f64>,
    /// Whether each block moved.
    moves: Vec<bool>,
}

impl Movement {
    /// Adds the next frame; returns the share of it that moves, and the mean change of its luma minus the change of the
    /// light [0..1]. Both are NaN without a previous frame to compare with.
    pub fn push(&mut self, blocks: &Blocks, at: f64) -> (f64, f64) {
        let lumas: Vec<f64> = blocks.lumas().collect();
        let before = std::mem::replace(&mut self.lumas, lumas);
        let passed = at - std::mem::replace(&mut self.at, at);
        let columns = std::mem::replace(&mut self.columns, blocks.columns);
        self.moves.clear();
        let is_next = columns == blocks.columns
            && before.len() == self.lumas.len()
            && !before.is_empty()
            && (0.0..=PAUSE_SECS).contains(&passed);
        if !is_next {
            return (f64::NAN, f64::NAN);
        }
        let changes: Vec<f64> =
            self.lumas.iter().zip(&before).map(|(now, before)| now - before).collect();
        // More than half of a view seldom moves, so the median is the change of the light, and the spread around it is
        // noise.
        let light = median(changes.clone());
        let noise = OF_MEDIAN * median(changes.iter().map(|each| (each - light).abs()).collect());
        let limit = LEAST_CHANGE.max(BEYOND * noise);
        self.moves.extend(changes.iter().map(|each| (each - light).abs() > limit));
        let sum: f64 = changes.iter().map(|each| (each - light).abs()).sum();
        (share(self.moves.iter().copied()), sum / changes.len() as f64)
    }

    /// Returns the share of the blocks of a region that moved in the last frame.
    pub fn share_within(&self, is_in: &[bool]) -> f64 {
        share(self.moves.iter().zip(is_in).filter(|(_, is_in)| **is_in).map(|(moves, _)| *moves))
    }
}

/// Returns the share of true values; 0 if there are none.
fn share(each: impl Iterator<Item = bool>) -> f64 {
    let (count, all) =
        each.fold((0_u32, 0_u32), |(count, all), is| (count + u32::from(is), all + 1));
    f64::from(count) / f64::from(all.max(1))
}

fn median(mut numbers: Vec<f64>) -> f64 {
    let middle = numbers.len() / 2;
    *numbers.select_nth_unstable_by(middle, f64::total_cmp).1
}
