//! The usual height of deflections that are not beats.

use super::recent::{MEMORY, median};

/// Deflections older than this are ignored [s].
const LONGEST_AGO_SECS: f64 = 10.0;

/// Whether a deflection this far away in time [s] still counts.
pub(super) fn is_near(secs: f64) -> bool {
    secs.abs() <= LONGEST_AGO_SECS
}

/// The newest deflections that are not beats: time [s] and height.
#[derive(Clone, Debug)]
pub(super) struct Deflections {
    newest: [(f64, f64); MEMORY],
    next: usize,
}

impl Default for Deflections {
    fn default() -> Deflections {
        Deflections { newest: [(f64::NEG_INFINITY, 0.0); MEMORY], next: 0 }
    }
}

impl Deflections {
    pub(super) fn push(&mut self, secs: f64, strength: f64) {
        self.newest[self.next] = (secs, strength);
        self.next = (self.next + 1) % MEMORY;
    }

    /// Raises the newest height to at least `strength`.
    pub(super) fn raise_newest(&mut self, strength: f64) {
        let newest = &mut self.newest[(self.next + MEMORY - 1) % MEMORY];
        newest.1 = newest.1.max(strength);
    }

    /// The median height of the deflections near a time [s].
    pub(super) fn median(&self, at_secs: f64) -> Option<f64> {
        let is_any = self.newest.iter().any(|(secs, _)| is_near(at_secs - secs));
        is_any.then(|| self.usual(at_secs, 0, 1.0))
    }

    /// The median height of the deflections near a time [s], counting one per beat of the last `beats` cycles
    /// [s]; missing ones count as zero.
    pub(super) fn usual(&self, at_secs: f64, beats: usize, cycle_secs: f64) -> f64 {
        let mut heights = [0.0; MEMORY];
        let near = self.newest.iter().filter(|(secs, _)| is_near(at_secs - secs));
        let mut count = 0;
        for (place, (_, strength)) in heights.iter_mut().zip(near) {
            *place = *strength;
            count += 1;
        }
        let beats = beats.min((LONGEST_AGO_SECS / cycle_secs) as usize);
        median(&mut heights[..count.max(beats.min(MEMORY))]).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_long_ago_is_forgotten_and_one_of_many_cycles_is_not_usual() {
        let mut deflections = Deflections::default();
        deflections.push(0.0, 400.0);
        assert!(deflections.usual(1.0, 9, 0.4) < 1e-9);
        (0..8).for_each(|k| deflections.push(f64::from(k), 2.0));
        assert!((deflections.usual(8.0, 9, 0.8) - 2.0).abs() < 1e-9);
        assert!(deflections.usual(30.0, 9, 0.8) < 1e-9);
    }
}
