//! Checks whether a quality is the probability of being right.

use super::windows::Window;

/// The windows whose quality is within one tenth.
#[derive(Clone, Copy, Default)]
struct Tenth {
    count: usize,
    right: usize,
    quality: f64,
}

/// The windows, grouped by the tenth that contains their quality.
#[derive(Default)]
pub struct Reliability([Tenth; 10]);

impl Reliability {
    pub fn add(&mut self, window: &Window) {
        let tenth = &mut self.0[((window.quality * 10.0) as usize).min(9)];
        tenth.count += 1;
        tenth.right += usize::from(window.is_right);
        tenth.quality += window.quality;
    }

    /// Returns the mean quality, the share of right windows and the count of each tenth that has windows.
    pub fn tenths(&self) -> impl Iterator<Item = (f64, f64, usize)> + '_ {
        let known = self.0.iter().filter(|tenth| tenth.count > 0);
        known.map(|tenth| {
            let count = tenth.count as f64;
            (tenth.quality / count, tenth.right as f64 / count, tenth.count)
        })
    }
}
