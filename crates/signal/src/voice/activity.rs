//! Voice activity detection.

use super::path::DELAY;

/// The floor is the minimum level over this many half seconds.
const HALVES: usize = 16;
/// The number of frames in half a second.
const HALF_SECOND: u32 = 50;
/// The lower limit of the floor [dBFS].
pub(super) const LEAST_FLOOR_DBFS: f64 = -75.0;

/// The level of background noise: the minimum over the last eight seconds.
#[derive(Debug)]
pub(super) struct Floor {
    least: [f64; HALVES],
    place: usize,
    frames: u32,
    /// The newest levels, from which the mean is taken.
    recent: [f64; 5],
}

impl Floor {
    pub(super) fn new() -> Floor {
        let (least, recent) = ([f64::INFINITY; HALVES], [f64::NAN; 5]);
        Floor { least, place: 0, frames: 0, recent }
    }

    /// Takes in the level of a frame, and returns the floor [dBFS].
    pub(super) fn push(&mut self, level_dbfs: f64) -> f64 {
        self.recent.rotate_left(1);
        self.recent[4] = level_dbfs;
        let mean = self.recent.iter().sum::<f64>() / 5.0;
        if self.frames == HALF_SECOND {
            self.place = (self.place + 1) % HALVES;
            self.least[self.place] = f64::INFINITY;
            self.frames = 0;
        }
        self.frames += 1;
        // A mean with a missing level is NaN, which the minimum ignores.
        self.least[self.place] = self.least[self.place].min(mean);
        let least = self.least.iter().copied().fold(f64::INFINITY, f64::min);
        if least.is_finite() { least.max(LEAST_FLOOR_DBFS) } else { level_dbfs }
    }
}

/// Combines loud or voiced frames into speech: a gap of less than 0.2 s between two such frames is a
/// closure within speech; an isolated run shorter than 30 ms is a click.
#[derive(Debug)]
pub(super) struct Speech {
    /// The number of successive active frames so far.
    active: usize,
    /// The time since the end of the last speech [frames].
    over: usize,
}

/// Fewer active frames in a row than this are a click.
const LEAST_ACTIVE: usize = 3;

impl Speech {
    pub(super) fn new() -> Speech {
        Speech { active: 0, over: usize::MAX }
    }

    /// Whether the next frame is speech; `coming` states whether this frame and the next [`DELAY`] frames are active.
    pub(super) fn push(&mut self, coming: impl Iterator<Item = bool>) -> bool {
        let mut ahead = [false; DELAY + 1];
        ahead.iter_mut().zip(coming).for_each(|(to, is_active)| *to = is_active);
        let length = self.active + ahead.iter().take_while(|is_active| **is_active).count();
        self.active = if ahead[0] { self.active + 1 } else { 0 };
        if ahead[0] && (length >= LEAST_ACTIVE || self.over < LEAST_ACTIVE) {
            self.over = 0;
            return true;
        }
        self.over = self.over.saturating_add(1);
        self.over.saturating_add(next_run(&ahead)) <= DELAY
    }
}

/// The number of frames until speech resumes.
fn next_run(ahead: &[bool; DELAY + 1]) -> usize {
    let runs = ahead.windows(LEAST_ACTIVE);
    runs.enumerate().find(|(_, run)| run.iter().all(|is| *is)).map_or(DELAY + 1, |(after, _)| after)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speech(active: &str) -> String {
        let active: Vec<bool> = active.chars().map(|each| each == '#').collect();
        let mut speech = Speech::new();
        let each = |from: usize| speech.push(active[from..].iter().copied());
        (0..active.len()).map(each).map(|is| if is { '#' } else { '.' }).collect()
    }

    #[test]
    fn a_closure_is_speech_and_a_click_is_not() {
        let active = "...#......####.....####........................####";
        let joined = "..........#############........................####";
        assert_eq!(speech(active), joined);
    }

    #[test]
    fn the_floor_is_that_of_pauses() {
        let mut floor = Floor::new();
        let level = |k: i32| if k % 200 < 150 { -20.0 } else { -60.0 };
        let floors: Vec<f64> = (0..2000).map(|k| floor.push(level(k))).collect();
        assert!(floors[300..].iter().all(|floor| *floor == -60.0));
    }
}
