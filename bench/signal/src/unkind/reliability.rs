//! Whether a quality is the probability of being right.

use super::windows::Window;

/// Windows whose quality lies in one tenth.
#[derive(Clone, Copy, Default)]
struct Tenth {
    count: usize,
    right: usize,
    quality: f64,
}

/// Windows by the tenth in which their quality lies.
#[derive(Default)]
pub struct Reliability([Tenth; 10]);

impl Reliability {
    pub fn add(&mut self, window: &Window) {
        let tenth = &mut self.0[((window.quality * 10.0) as usize).min(9)];
        tenth.count += 1;
        tenth.right += usize::from(window.is_right);
        tenth.quality += window.quality;
    }

    /// Each tenth with enough windows to say: mean quality, share that is right, count.
    pub fn tenths(&self) -> impl Iterator<Item = (f64, f64, usize)> + '_ {
        let known = self.0.iter().filter(|tenth| tenth.count > 0);
        known.map(|tenth| {
            let count = tenth.count as f64;
            (tenth.quality / count, tenth.right as f64 / count, tenth.count)
        })
    }
}
