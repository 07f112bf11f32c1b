//! A sliding fold of mergeable values.

/// A summary of several samples that can be merged.
pub(crate) trait Merge: Copy {
    /// The summary of no samples.
    const NOTHING: Self;

    /// The summary of both summaries' samples.
    fn merged(self, other: Self) -> Self;
}

/// Merges the newest `length` samples, in amortised constant time.
///
/// A queue of two stacks: the older samples are held as suffix summaries, the newer ones as they are. When
/// the older ones are used up, the newer ones replace them.
#[derive(Clone, Debug)]
pub(crate) struct Fold<T> {
    length: usize,
    older: Vec<T>,
    newer: Vec<T>,
    newer_merged: T,
}

impl<T: Merge> Fold<T> {
    pub(crate) fn new(length: usize) -> Fold<T> {
        let stack = || Vec::with_capacity(length);
        Fold { length, older: stack(), newer: stack(), newer_merged: T::NOTHING }
    }

    pub(crate) fn push(&mut self, sample: T) {
        if self.older.len() + self.newer.len() == self.length {
            self.let_go();
        }
        self.newer.push(sample);
        self.newer_merged = self.newer_merged.merged(sample);
    }

    pub(crate) fn merged(&self) -> T {
        let older = self.older.last().copied().unwrap_or(T::NOTHING);
        older.merged(self.newer_merged)
    }

    fn let_go(&mut self) {
        if self.older.is_empty() {
            let mut merged = T::NOTHING;
            while let Some(sample) = self.newer.pop() {
                merged = sample.merged(merged);
                self.older.push(merged);
            }
            self.newer_merged = T::NOTHING;
        }
        self.older.pop();
    }
}

/// A sum, without the accumulated rounding errors that subtracting old samples would cause.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sum(pub(crate) f64);

impl Merge for Sum {
    const NOTHING: Sum = Sum(0.0);

    fn merged(self, other: Sum) -> Sum {
        Sum(self.0 + other.0)
    }
}
