//! A filter that runs sample by sample.

use super::{Design, Section};
use crate::gaps::is_usable;

/// A running filter: a cascade of second-order sections in transposed direct form II.
///
/// Equals SciPy's `sosfilt`, bit-identical for any chunking, and never allocates. A sample that is [not
/// usable](crate::gaps::is_usable) repeats the one before, so that one bad sample does not spoil all that
/// follow.
#[derive(Clone, Debug)]
pub struct Cascade {
    stages: Vec<Stage>,
    /// The last usable sample; NaN before the first one of a settled filter.
    held: f64,
}

#[derive(Clone, Copy, Debug)]
struct Stage {
    section: Section,
    state: [f64; 2],
    /// The state after an infinite constant input of 1.
    settled: [f64; 2],
}

impl Cascade {
    /// A filter with zero initial state: `sosfilt` without `zi`.
    pub fn at_rest(design: &Design) -> Cascade {
        let mut level = 1.0;
        let stage = |section: &Section| {
            let settled = section.settled_state().map(|state| state * level);
            level *= section.constant_gain();
            Stage { section: *section, state: [0.0; 2], settled }
        };
        Cascade { stages: design.sections().iter().map(stage).collect(), held: 0.0 }
    }

    /// A filter settled on its first usable sample, so that it starts without a transient: `sosfilt` with `zi
    /// = sosfilt_zi(sos) * x[0]`. Returns NaN until then.
    pub fn settled(design: &Design) -> Cascade {
        Cascade { held: f64::NAN, ..Cascade::at_rest(design) }
    }

    /// Takes in the next sample, and returns the filtered one.
    pub fn push(&mut self, sample: f64) -> f64 {
        let input = if is_usable(sample) { sample } else { self.held };
        if self.held.is_nan() {
            self.settle(input);
        }
        self.held = input;
        self.stages.iter_mut().fold(input, |value, stage| stage.push(value))
    }

    /// Filters samples in place.
    pub fn filter(&mut self, samples: &mut [f64]) {
        self.filter_each(samples.iter_mut());
    }

    /// Filters samples in place from the last to the first.
    pub(super) fn filter_backwards(&mut self, samples: &mut [f64]) {
        self.filter_each(samples.iter_mut().rev());
    }

    fn filter_each<'a>(&mut self, mut samples: impl Iterator<Item = &'a mut f64>) {
        while self.held.is_nan() {
            let Some(sample) = samples.next() else { return };
            *sample = self.push(*sample);
        }
        match self.stages.len() {
            1 => self.filter_in_registers::<1>(samples),
            2 => self.filter_in_registers::<2>(samples),
            3 => self.filter_in_registers::<3>(samples),
            4 => self.filter_in_registers::<4>(samples),
            _ => samples.for_each(|sample| *sample = self.push(*sample)),
        }
    }

    /// Filters samples in place for a constant number of sections, whose states stay in registers.
    fn filter_in_registers<'a, const N: usize>(
        &mut self,
        samples: impl Iterator<Item = &'a mut f64>,
    ) {
        let Some(kept) = self.stages.first_chunk_mut::<N>() else { return };
        let (mut stages, mut held) = (*kept, self.held);
        for sample in samples {
            held = if is_usable(*sample) { *sample } else { held };
            *sample = stages.iter_mut().fold(held, |value, stage| stage.push(value));
        }
        (*kept, self.held) = (stages, held);
    }

    /// Sets the state after an infinite constant input of `level`.
    pub fn settle(&mut self, level: f64) {
        self.held = level;
        let level = if is_usable(level) { level } else { 0.0 };
        for stage in &mut self.stages {
            stage.state = stage.settled.map(|state| state * level);
        }
    }

    /// The two state variables of each section: SciPy's `zf`.
    pub fn states(&self) -> impl Iterator<Item = [f64; 2]> {
        self.stages.iter().map(|stage| stage.state)
    }
}

impl Stage {
    fn push(&mut self, input: f64) -> f64 {
        let ([b0, b1, b2], [a1, a2]) = (self.section.b, self.section.a);
        let output = b0 * input + self.state[0];
        self.state = [b1 * input - a1 * output + self.state[1], b2 * input - a2 * output];
        output
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::filter::butterworth::band_pass;

    fn band() -> Design {
        band_pass(2, 5.0, 15.0, 130.0).unwrap()
    }

    #[test]
    fn a_settled_filter_begins_without_a_jump() {
        let mut filter = Cascade::settled(&band());
        assert!(filter.push(f64::NAN).is_nan());
        assert!((0..50).all(|_| filter.push(1000.0).abs() < 1e-9));
    }

    #[test]
    fn a_bad_sample_counts_as_the_one_before_it() {
        let run = |samples: [f64; 4]| {
            samples.map({
                let mut filter = Cascade::settled(&band());
                move |sample| filter.push(sample)
            })
        };
        assert_eq!(run([1.0, 2.0, f64::NAN, 3.0]), run([1.0, 2.0, 2.0, 3.0]));
        assert_eq!(run([1.0, 2.0, f64::INFINITY, 3.0]), run([1.0, 2.0, 2.0, 3.0]));
    }

    proptest! {
        #[test]
        fn a_slice_is_filtered_as_its_samples_are(
            samples in prop::collection::vec(prop::num::f64::ANY, 0..200),
            order in 1..6u32,
        ) {
            let band = band_pass(order, 5.0, 15.0, 130.0).unwrap();
            let (mut slice, mut one) = (Cascade::settled(&band), Cascade::settled(&band));
            let singly: Vec<u64> = samples.iter().map(|&x| one.push(x).to_bits()).collect();
            let mut at_once = samples;
            slice.filter(&mut at_once);
            prop_assert_eq!(at_once.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), singly);
        }

        #[test]
        fn chunks_of_any_length_give_the_same_bits(
            samples in prop::collection::vec(prop::num::f64::ANY, 1..500),
            chunk in 1..4097usize,
        ) {
            let (mut whole, mut chunks) = (samples.clone(), samples);
            Cascade::settled(&band()).filter(&mut whole);
            let mut filter = Cascade::settled(&band());
            chunks.chunks_mut(chunk).for_each(|chunk| filter.filter(chunk));
            let bits = |samples: &[f64]| samples.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&whole), bits(&chunks));
        }

        #[test]
        fn no_input_spoils_what_follows(
            samples in prop::collection::vec(prop::num::f64::ANY, 1..200),
        ) {
            let mut filter = Cascade::at_rest(&band());
            prop_assert!(samples.iter().all(|&sample| filter.push(sample).is_finite()));
        }
    }
}
