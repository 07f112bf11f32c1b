//! The width of peaks.

use super::Peak;

/// Measures the width of a peak between its bases, at `share` of its prominence below its top (SciPy's `rel_height`).
pub(super) fn measure(signal: &[f64], peak: &mut Peak, share: f64) {
    let level = peak.height - peak.prominence * share;
    let is_above = |index: &usize| level < signal[*index];
    let left = (peak.left_base + 1..=peak.index).rev().find(|index| !is_above(index));
    let left = left.unwrap_or(peak.left_base);
    let right = (peak.index..peak.right_base).find(|index| !is_above(index));
    let right = right.unwrap_or(peak.right_base);
    peak.left_crossing = left as f64;
    if signal[left] < level {
        peak.left_crossing += share_of_step(signal[left], signal[left + 1], level);
    }
    peak.right_crossing = right as f64;
    if signal[right] < level {
        peak.right_crossing -= share_of_step(signal[right], signal[right - 1], level);
    }
    peak.width = peak.right_crossing - peak.left_crossing;
}

fn share_of_step(from: f64, to: f64, level: f64) -> f64 {
    (level - from) / (to - from)
}
