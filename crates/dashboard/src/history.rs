//! The last ten minutes of a stream, at screen resolution.

use crate::wire::{Column, known};

/// How much of the past is stored [s].
pub const STORED_SECS: f64 = 600.0;
/// The width of a column of a wave [s]; columns of other streams are four times as wide.
const WAVE_STEP_SECS: f64 = 0.25;
/// The maximum number of stored channels per stream.
const MOST_CHANNELS: usize = 64;

/// The columns of a stream, each with the smallest, largest and mean value of each channel.
#[derive(Debug)]
pub struct Track {
    step_secs: f64,
    width: usize,
    /// The number of columns in the ring.
    depth: i64,
    cells: Vec<Cell>,
    /// The index of the newest column, counted from the start of the session.
    newest: Option<i64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    min: f32,
    max: f32,
    mean: f32,
    count: u32,
}

impl Cell {
    fn add(&mut self, number: f32) {
        let Cell { min, max, .. } = *self;
        self.count += 1;
        if self.count == 1 {
            *self = Cell { min: number, max: number, mean: number, count: 1 };
        } else {
            self.min = min.min(number);
            self.max = max.max(number);
            self.mean += (number - self.mean) / self.count as f32;
        }
    }

    fn join(&mut self, other: Cell) {
        if self.count == 0 {
            *self = other;
        } else if other.count > 0 {
            let count = self.count + other.count;
            self.min = self.min.min(other.min);
            self.max = self.max.max(other.max);
            self.mean += (other.mean - self.mean) * (other.count as f32 / count as f32);
            self.count = count;
        }
    }
}

/// The stored data of a stream within a span of time.
#[derive(Debug)]
pub struct Excerpt {
    /// The start of the first column [s].
    pub from: f64,
    /// The width of a column [s].
    pub step: f64,
    /// The columns of each channel.
    pub channels: Vec<Column>,
}

impl Track {
    /// A track for waves or for other streams, with the given number of channels.
    pub fn new(is_wave: bool, channels: usize) -> Track {
        let step_secs = if is_wave { WAVE_STEP_SECS } else { 4.0 * WAVE_STEP_SECS };
        let depth = (STORED_SECS / step_secs) as i64;
        let width = channels.min(MOST_CHANNELS);
        let cells = vec![Cell::default(); width * depth as usize];
        Track { step_secs, width, depth, cells, newest: None }
    }

    /// The memory used by the track [bytes].
    pub fn held_bytes(&self) -> usize {
        size_of_val(&*self.cells)
    }

    /// Adds a sample with one value per channel, at a time [s]. Samples older than the oldest column are dropped.
    pub fn add(&mut self, t: f64, numbers: impl Iterator<Item = f64>) {
        let column = (t / self.step_secs).floor() as i64;
        let newest = *self.newest.get_or_insert(column);
        if column <= newest - self.depth {
            return;
        }
        // Columns between the newest and this one are cleared, as they hold data from ten minutes before.
        for passed in (newest + 1..=column).rev().take(self.depth as usize) {
            self.cells_of(passed).fill(Cell::default());
        }
        self.newest = Some(newest.max(column));
        for (cell, number) in self.cells_of(column).iter_mut().zip(numbers) {
            if number.is_finite() {
                cell.add(number as f32);
            }
        }
    }

    /// Returns the stored data between two times [s], in at most `points` columns.
    pub fn excerpt(&self, from: f64, to: f64, points: u32) -> Excerpt {
        let newest = self.newest.unwrap_or(i64::MIN / 2);
        let first = ((from / self.step_secs).floor() as i64).max(newest - self.depth + 1);
        let last = ((to / self.step_secs).floor() as i64).min(newest);
        let stored = usize::try_from(last - first + 1).unwrap_or(0);
        let merged = stored.div_ceil(points.max(1) as usize).max(1);
        let channels = (0..self.width).map(|channel| {
            let joined = (0..stored.div_ceil(merged)).map(|place| {
                let from = first + (place * merged) as i64;
                let mut cell = Cell::default();
                for column in from..=last.min(from + merged as i64 - 1) {
                    cell.join(self.cells[self.place(column) + channel]);
                }
                cell
            });
            column(joined)
        });
        let step = merged as f64 * self.step_secs;
        Excerpt { from: first as f64 * self.step_secs, step, channels: channels.collect() }
    }

    fn place(&self, column: i64) -> usize {
        column.rem_euclid(self.depth) as usize * self.width
    }

    fn cells_of(&mut self, column: i64) -> &mut [Cell] {
        let place = self.place(column);
        &mut self.cells[place..place + self.width]
    }
}

fn column(cells: impl Iterator<Item = Cell>) -> Column {
    let mut column = Column { min: Vec::new(), max: Vec::new(), mean: Vec::new() };
    for cell in cells {
        let number = |number: f32| (cell.count > 0).then(|| known(f64::from(number))).flatten();
        column.min.push(number(cell.min));
        column.max.push(number(cell.max));
        column.mean.push(number(cell.mean));
    }
    column
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_spike_is_kept_and_a_gap_is_a_gap() {
        let mut track = Track::new(true, 1);
        for place in 0..100 {
            let number = if place == 42 { 9.0 } else { 1.0 };
            track.add(f64::from(place) * 0.01, [number].into_iter());
        }
        track.add(2.1, [5.0].into_iter());
        let Excerpt { from, step, channels } = track.excerpt(0.0, 3.0, 1000);
        assert_eq!((from, step), (0.0, 0.25));
        assert_eq!(channels[0].max[..4], [Some(1.0), Some(9.0), Some(1.0), Some(1.0)]);
        assert_eq!(channels[0].max[4..], [None, None, None, None, Some(5.0)]);
        let coarse = track.excerpt(0.0, 3.0, 3);
        assert_eq!(
            (coarse.step, coarse.channels[0].max.clone()),
            (0.75, vec![Some(9.0), Some(1.0), Some(5.0)])
        );
    }

    #[test]
    fn ten_minutes_are_stored_and_no_more() {
        let mut track = Track::new(false, 1);
        for secs in 0..2000 {
            track.add(f64::from(secs), [f64::from(secs)].into_iter());
        }
        track.add(100.0, [1e9].into_iter());
        let stored = track.excerpt(0.0, 1e9, u32::MAX);
        assert_eq!((stored.from, stored.channels[0].min.len()), (1400.0, 600));
        assert!(stored.channels[0].max.iter().all(|max| max.is_some_and(|max| max < 1e9)));
        track.add(1e7, [1.0].into_iter());
        let after = track.excerpt(0.0, 1e9, u32::MAX);
        assert_eq!(after.channels[0].min.iter().flatten().count(), 1);
    }

    proptest! {
        #[test]
        fn any_times_and_questions_are_answered_within_the_bound(
            samples in prop::collection::vec((any::<f64>(), any::<f64>()), 0..50),
            (from, to, points) in (any::<f64>(), any::<f64>(), any::<u32>()),
        ) {
            let mut track = Track::new(true, 2);
            for (t, number) in samples {
                track.add(t.clamp(-1e9, 1e9), [number, number].into_iter());
            }
            let excerpt = track.excerpt(from.clamp(-1e12, 1e12), to.clamp(-1e12, 1e12), points);
            prop_assert!(excerpt.channels.iter().all(|each| each.min.len() <= 2400.min(points.max(1) as usize)));
        }
    }
}
