//! Results of stretches, kept for the windows to come.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};

use super::fusion::{Stretch, rate_of_stretch};
use super::modulation::Beat;

/// So many are kept: those of windows of 600 s and more that end each second.
const MOST: usize = 2048;

/// Results of stretches, by their start [ns] and the fingerprint of their beats.
#[derive(Default)]
pub(super) struct Kept {
    told: BTreeMap<(i64, u64), Option<Stretch>>,
}

impl Kept {
    /// The result of the stretch with these beats.
    pub(super) fn stretch(&mut self, beats: &[Beat], begin_ns: i64) -> Option<Stretch> {
        if self.told.len() >= MOST {
            self.told.pop_first();
        }
        let report = || rate_of_stretch(beats, begin_ns);
        *self.told.entry((begin_ns, print(beats))).or_insert_with(report)
    }
}

/// The same for the same beats, and for no others that ever occur.
fn print(beats: &[Beat]) -> u64 {
    let mut print = DefaultHasher::new();
    for beat in beats {
        print.write_i64(beat.at_ns);
        beat.heights.iter().for_each(|height| print.write_u64(height.to_bits()));
    }
    print.finish()
}
