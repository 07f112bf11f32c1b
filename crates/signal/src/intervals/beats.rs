/// Times of heartbeats, and which of them were edited manually.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Beats {
    times_secs: Vec<f64>,
    decided: Vec<bool>,
    /// Whether the interval that ends at each beat is missing for an unknown reason.
    broken: Vec<bool>,
}

/// One beat, for the correction.
#[derive(Clone, Copy)]
pub(super) struct Beat {
    pub(super) at_secs: f64,
    pub(super) decided: bool,
    pub(super) broken: bool,
}

/// A manual edit of a beat. Edits are kept in addition to the detected beats, never instead of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Edit {
    /// A beat that was not detected.
    Add {
        /// The time of the beat [s].
        at_secs: f64,
    },
    /// The detected beat nearest to a time is false.
    Remove {
        /// The time of the beat [s].
        at_secs: f64,
    },
    /// The detected beat nearest to a time is misplaced.
    Move {
        /// When it was detected [s].
        from_secs: f64,
        /// The true time of the beat [s].
        to_secs: f64,
    },
    /// The detected beat nearest to a time is correct, however odd it looks.
    Keep {
        /// The time of the beat [s].
        at_secs: f64,
    },
}

impl Beats {
    /// Beats as detected, sorted; times that are not finite are left out.
    pub fn detected(times_secs: &[f64]) -> Beats {
        let mut times_secs: Vec<f64> =
            times_secs.iter().copied().filter(|each| each.is_finite()).collect();
        times_secs.sort_by(f64::total_cmp);
        times_secs.dedup();
        let none = vec![false; times_secs.len()];
        Beats { decided: none.clone(), broken: none, times_secs }
    }

    /// Applies a person's edits to the beats, one after the other.
    ///
    /// An edit refers to a beat when it lies within `within_secs` [s] of the named time. Also returns the
    /// edits (by index) that match no beat, or have no time, and were skipped.
    ///
    /// ```
    /// use teampulse_signal::intervals::{Beats, Edit};
    /// let detected = Beats::detected(&[0.0, 0.8, 1.1, 1.6]);
    /// let (beats, left_out) = detected.edited(&[Edit::Remove { at_secs: 1.1 }], 0.05);
    /// assert_eq!(beats.times_secs(), [0.0, 0.8, 1.6]);
    /// assert!(left_out.is_empty());
    /// ```
    #[must_use]
    pub fn edited(&self, edits: &[Edit], within_secs: f64) -> (Beats, Vec<usize>) {
        let mut beats = self.clone();
        let fits = |&(_, edit): &(usize, &Edit)| !beats.edit(*edit, within_secs);
        let left_out = edits.iter().enumerate().filter(fits).map(|(place, _)| place).collect();
        (beats, left_out)
    }

    /// Creates the series from beats that are in order.
    pub(super) fn ordered(beats: &[Beat]) -> Beats {
        Beats {
            times_secs: beats.iter().map(|each| each.at_secs).collect(),
            decided: beats.iter().map(|each| each.decided).collect(),
            broken: beats.iter().map(|each| each.broken).collect(),
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = Beat> + '_ {
        let flags = self.decided.iter().zip(&self.broken);
        let beat = |(&at_secs, (&decided, &broken))| Beat { at_secs, decided, broken };
        self.times_secs.iter().zip(flags).map(beat)
    }

    /// Splits the beats where `apart` holds for two successive times [s].
    pub fn split(&self, apart: impl Fn(f64, f64) -> bool) -> Vec<Beats> {
        let all: Vec<Beat> = self.iter().collect();
        let stretches = all.chunk_by(|a, b| !apart(a.at_secs, b.at_secs));
        stretches.map(Beats::ordered).collect()
    }

    /// Times [s], finite and ascending.
    pub fn times_secs(&self) -> &[f64] {
        &self.times_secs
    }

    /// Whether each beat was added, moved or confirmed manually, and is exempt from correction.
    pub fn decided(&self) -> &[bool] {
        &self.decided
    }

    /// Intervals between successive beats [ms]; NaN for one rejected by the correction.
    pub fn intervals_ms(&self) -> Vec<f64> {
        let interval = |(pair, broken): (&[f64], &bool)| {
            if *broken { f64::NAN } else { (pair[1] - pair[0]) * 1000.0 }
        };
        self.times_secs.windows(2).zip(self.broken.iter().skip(1)).map(interval).collect()
    }

    /// Applies an edit; returns whether it matched a beat.
    fn edit(&mut self, edit: Edit, within_secs: f64) -> bool {
        match edit {
            Edit::Add { at_secs } => at_secs.is_finite() && self.add(at_secs),
            Edit::Remove { at_secs } => {
                self.nearest(at_secs, within_secs).is_some_and(|index| self.remove(index))
            }
            Edit::Keep { at_secs } => {
                self.nearest(at_secs, within_secs).is_some_and(|index| self.keep(index))
            }
            Edit::Move { from_secs, to_secs } => {
                let found = self.nearest(from_secs, within_secs).filter(|_| to_secs.is_finite());
                found.is_some_and(|index| self.remove(index) && self.add(to_secs))
            }
        }
    }

    fn nearest(&self, at_secs: f64, within_secs: f64) -> Option<usize> {
        let after = self.times_secs.partition_point(|&each| each < at_secs);
        let around = after.saturating_sub(1)..(after + 1).min(self.times_secs.len());
        let distance = |index: usize| (self.times_secs[index] - at_secs).abs();
        let nearest = around.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
        (distance(nearest) <= within_secs).then_some(nearest)
    }

    fn add(&mut self, at_secs: f64) -> bool {
        let index = self.times_secs.partition_point(|&each| each < at_secs);
        if self.times_secs.get(index).is_some_and(|&each| each <= at_secs) {
            return self.keep(index);
        }
        self.times_secs.insert(index, at_secs);
        self.decided.insert(index, true);
        self.broken.insert(index, false);
        true
    }

    fn remove(&mut self, index: usize) -> bool {
        self.times_secs.remove(index);
        self.decided.remove(index);
        self.broken.remove(index);
        true
    }

    fn keep(&mut self, index: usize) -> bool {
        self.decided[index] = true;
        true
    }
}
