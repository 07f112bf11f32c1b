//! The median of recent values.

/// The number of recent beats, or other deflections, that define what is usual.
pub(crate) const MEMORY: usize = 8;

#[derive(Clone, Debug, Default)]
pub(crate) struct Recent {
    values: [f64; MEMORY],
    count: usize,
    next: usize,
}

impl Recent {
    pub(crate) fn push(&mut self, value: f64) {
        self.values[self.next] = value;
        self.next = (self.next + 1) % MEMORY;
        self.count = (self.count + 1).min(MEMORY);
    }

    /// Replaces the newest value, if there is one.
    pub(crate) fn replace_newest(&mut self, value: f64) {
        if self.count > 0 {
            self.values[(self.next + MEMORY - 1) % MEMORY] = value;
        }
    }

    pub(crate) fn median(&self) -> Option<f64> {
        self.median_of(|value| value)
    }

    /// The median of a function of the values.
    pub(crate) fn median_of(&self, of: impl Fn(f64) -> f64) -> Option<f64> {
        let mut values = self.values.map(of);
        median(&mut values[..self.count])
    }
}

/// The median; changes the order of the values.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    let is_odd = values.len() % 2 == 1;
    Some(if is_odd { upper } else { values[middle - 1].midpoint(upper) })
}
