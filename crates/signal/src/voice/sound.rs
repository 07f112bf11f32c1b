use crate::gaps::is_usable;

/// The newest samples of a sound with their times, numbered from the first one.
///
/// They are contiguous; no sample allocates once the buffer has grown to twice the kept length.
#[derive(Debug)]
pub(super) struct Sound {
    kept: usize,
    first: usize,
    samples: Vec<f64>,
    at_ns: Vec<i64>,
}

impl Sound {
    /// Keeps at least the newest `kept` samples.
    pub(super) fn new(kept: usize) -> Sound {
        let (samples, at_ns) = (Vec::with_capacity(2 * kept), Vec::with_capacity(2 * kept));
        Sound { kept, first: 0, samples, at_ns }
    }

    /// Takes in a sample; one that is not usable is NaN.
    pub(super) fn push(&mut self, at_ns: i64, sample: f64) {
        if self.samples.len() == 2 * self.kept {
            self.samples.drain(..self.kept);
            self.at_ns.drain(..self.kept);
            self.first += self.kept;
        }
        self.samples.push(if is_usable(sample) { sample } else { f64::NAN });
        self.at_ns.push(at_ns);
    }

    /// The number of samples so far.
    pub(super) fn count(&self) -> usize {
        self.first + self.samples.len()
    }

    /// The samples in a range of numbers; `None` unless all of them are held.
    pub(super) fn get(&self, from: i64, to: i64) -> Option<&[f64]> {
        let place = |number: i64| usize::try_from(number - self.first as i64).ok();
        self.samples.get(place(from)?..place(to)?)
    }

    /// The time of a sample [ns], if it is held.
    pub(super) fn time_ns(&self, number: usize) -> Option<i64> {
        self.at_ns.get(number.checked_sub(self.first)?).copied()
    }
}
