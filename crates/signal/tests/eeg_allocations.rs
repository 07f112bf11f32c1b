//! An EEG costs no allocation per sample, and its memory stays within what its windows need.

mod counting;

use counting::allocations;
use teampulse_signal::analysis::Causal;
use teampulse_signal::eeg::analysis::{Settings, causal};

const SECOND_NS: i64 = 1_000_000_000;

/// Four channels at 256 Hz without blinks, with a window of ten seconds.
fn feed(analysis: &mut dyn Causal, secs: std::ops::Range<i64>) {
    for sec in secs {
        for k in 0..256 {
            let phase = (sec * 256 + k) as f64;
            let waves = [0.247, 0.151, 0.093, 0.311].map(|step| 20.0 * (step * phase).sin());
            analysis.push(sec * SECOND_NS + k * SECOND_NS / 256, &waves);
        }
        analysis.forget((sec - 10) * SECOND_NS);
    }
}

#[test]
fn samples_allocate_nothing_in_steady_state() {
    let channels = ["TP9", "AF7", "AF8", "TP10"].map(ToString::to_string).to_vec();
    let mut analysis = causal(&Settings { channels, ..Settings::default() }, 256.0).unwrap();
    feed(&mut *analysis, 0..80);
    let before = allocations();
    feed(&mut *analysis, 80..120);
    assert_eq!(allocations() - before, 0);
}
