//! Peaks against SciPy.

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/peaks.rs"]
mod golden;

use teampulse_signal::peaks::{Rules, find_peaks};

const MANY: f64 = f64::INFINITY;

/// The script's signal.
fn signal() -> Vec<f64> {
    (0..150u32)
        .map(|k| f64::from(k * 7919 % 101 / 9) + f64::from(k * 31 % 300 / 40) * 2.0)
        .collect()
}

/// The same without equal peaks, of which SciPy keeps any when they are too close.
fn signal_without_ties() -> Vec<f64> {
    signal().iter().zip(0..150).map(|(x, k)| x + f64::from(k) / 1000.0).collect()
}

fn assert_peaks(signal: &[f64], rules: &Rules, theirs: &[[f64; 7]]) {
    let peaks = find_peaks(signal, rules);
    assert_eq!(peaks.len(), theirs.len());
    for (peak, theirs) in peaks.iter().zip(theirs) {
        let (left, right) = (peak.left_base as f64, peak.right_base as f64);
        let crossings = (peak.width, peak.left_crossing, peak.right_crossing);
        let ours = [
            peak.index as f64,
            peak.prominence,
            left,
            right,
            crossings.0,
            crossings.1,
            crossings.2,
        ];
        for (ours, theirs) in ours.iter().zip(theirs) {
            assert!((ours - theirs).abs() < 1e-12, "{peak:?} {theirs}");
        }
    }
}

#[test]
fn peaks_are_scipys_whatever_the_rules() {
    assert_peaks(&signal(), &Rules::default(), golden::ALL);
    assert_peaks(&signal(), &Rules { height: 12.0..=20.0, ..Rules::default() }, golden::HIGH);
    let apart = Rules { distance: 7, prominence: 3.0..=MANY, ..Rules::default() };
    assert_peaks(&signal_without_ties(), &apart, golden::APART);
    let narrow = Rules { prominence: 2.0..=15.0, width: 1.2..=4.0, ..Rules::default() };
    assert_peaks(&signal(), &narrow, golden::NARROW);
    let foot = Rules {
        width: 2.5..=MANY,
        relative_height: 1.0,
        prominence: 4.0..=MANY,
        ..Rules::default()
    };
    assert_peaks(&signal(), &foot, golden::AT_THE_FOOT);
}
