//! A cache of segment results for later windows.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};

use super::fusion::{Stretch, rate_of_stretch};
use super::modulation::Beat;

/// The cache size: windows of 600 s and more that end each second.
const MOST: usize = 2048;

/// Segment results by their start [ns] and the fingerprint of their beats.
#[derive(Default)]
pub(super) struct Kept {
    found: BTreeMap<(i64, u64), Option<Stretch>>,
}

impl Kept {
    /// The result of the segment with these beats.
    pub(super) fn stretch(&mut self, beats: &[Beat], begin_ns: i64) -> Option<Stretch> {
        if self.found.len() >= MOST {
            self.found.pop_first();
        }
        let report = || rate_of_stretch(beats, begin_ns);
        *self.found.entry((begin_ns, print(beats))).or_insert_with(report)
    }
}

/// A fingerprint of beats.
fn print(beats: &[Beat]) -> u64 {
    let mut print = DefaultHasher::new();
    for beat in beats {
        print.write_i64(beat.at_ns);
        beat.heights.iter().for_each(|height| print.write_u64(height.to_bits()));
    }
    print.finish()
}
