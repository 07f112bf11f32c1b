//! Motion on an even time grid.

use super::Movement;

/// The step of the grid [s].
pub(super) const STEP_SECS: f64 = 0.02;
/// Gaps between samples longer than this are not interpolated [s].
const GAP_SECS: f64 = 0.25;
/// Changes of the magnitude slower than this are removed: gravity, and the sensor's calibration [steps].
const TREND: usize = 50;
/// The longest recording: four days [steps].
const MOST: f64 = 17_280_000.0;

/// The acceleration of a sensor relative to gravity, on an even time grid; 0 where it is unknown.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The time of the first value [s].
    pub start_secs: f64,
    pub values: Vec<f32>,
}

impl Grid {
    /// The motion without its trend; `None` if there is none.
    pub fn of(movement: &[Movement]) -> Option<Grid> {
        let is_sound = |each: &&Movement| each.secs.is_finite() && each.magnitude.is_finite();
        let mut sound: Vec<Movement> = movement.iter().filter(is_sound).copied().collect();
        sound.sort_by(|one, other| one.secs.total_cmp(&other.secs));
        let (first, last) = (sound.first()?.secs, sound.last()?.secs);
        let steps = (last - first) / STEP_SECS;
        if !(TREND as f64..MOST).contains(&steps) {
            return None;
        }
        let mut values = vec![f64::NAN; steps as usize + 1];
        for pair in sound.windows(2) {
            fill(&mut values, (pair[0].secs - first, pair[0]), (pair[1].secs - first, pair[1]));
        }
        Some(Grid { start_secs: first, values: without_trend(&values) })
    }

    /// The time at an index [s].
    pub fn secs(&self, place: usize) -> f64 {
        self.start_secs + place as f64 * STEP_SECS
    }

    /// The index of a time, which may lie outside the grid.
    pub fn place(&self, secs: f64) -> isize {
        ((secs - self.start_secs) / STEP_SECS).round() as isize
    }

    /// The values from an index on; `None` if they are not all present.
    pub fn part(&self, from: isize, length: usize) -> Option<&[f32]> {
        let from = usize::try_from(from).ok()?;
        self.values.get(from..from.checked_add(length)?)
    }
}

/// Fills the steps between two samples, each given with its time after the first sample [s].
fn fill(values: &mut [f64], (from, one): (f64, Movement), (to, other): (f64, Movement)) {
    if to - from > GAP_SECS || to <= from {
        return;
    }
    let (first, last) = ((from / STEP_SECS).ceil() as usize, (to / STEP_SECS).floor() as usize);
    for (place, value) in values.iter_mut().enumerate().take(last + 1).skip(first) {
        let share = (place as f64 * STEP_SECS - from) / (to - from);
        *value = one.magnitude + share * (other.magnitude - one.magnitude);
    }
}

/// Each value minus the mean of those around it.
fn without_trend(values: &[f64]) -> Vec<f32> {
    let mut sums = vec![(0.0, 0_u32)];
    let mut sum = (0.0, 0);
    for value in values {
        if value.is_finite() {
            sum = (sum.0 + value, sum.1 + 1);
        }
        sums.push(sum);
    }
    let around = |place: usize| {
        let (from, to) =
            (place.saturating_sub(TREND / 2), (place + TREND / 2 + 1).min(values.len()));
        (sums[to].0 - sums[from].0) / f64::from(sums[to].1 - sums[from].1)
    };
    let rest = |(place, value): (usize, &f64)| {
        if value.is_finite() { (value - around(place)) as f32 } else { 0.0 }
    };
    values.iter().enumerate().map(rest).collect()
}
