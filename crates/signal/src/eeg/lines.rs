//! Narrow lines in the spectrum of an EEG, which do not come from the brain.

use std::ops::{Range, RangeInclusive};

use super::band::Band;
use crate::robust::median;
use crate::spectrum::Spectrum;

/// The lowest frequency of lines [Hz]: steps and the pulse begin here.
const LOWEST_HZ: f64 = 1.0;
/// The range where narrow peaks come from the brain: alpha and mu [Hz].
const ALPHA_HZ: RangeInclusive<f64> = 7.0..=13.5;
/// The neighbours of a line, in bins of 0.25 Hz from it; closer ones for alpha, whose peak is wider than a tone's.
const AROUND: Range<usize> = 3..11;
const AROUND_ALPHA: Range<usize> = 2..5;
/// How many times higher than its neighbours a line may be by chance, and how many times higher it is at zero quality.
const RATIOS: (f64, f64) = (16.0, 64.0);
const ALPHA_RATIOS: (f64, f64) = (40.0, 160.0);

/// How free of narrow lines a mean spectrum is [0..1].
///
/// A line is the highest bin of the power times frequency (as 1/f falls) over the median of its neighbours, 0.75 to 2.5
/// Hz away: the quality falls from 16 times, which chance reaches in one of 300 single segments, to zero at 64 times,
/// logarithmically. Steps, the pulse, and currents of 16.7 and 25 Hz are such lines. At 7 to 13.5 Hz the neighbours are
/// 0.5 to 1 Hz away and the limits 40 and 160: alpha is half a hertz wide or wider, a tone is not.
pub(super) fn free_of_lines(spectrum: &Spectrum) -> f64 {
    let bins = spectrum.bins(LOWEST_HZ, Band::Gamma.edges_hz().1);
    bins.map(|bin| free_of_line(spectrum, bin)).fold(1.0, f64::min)
}

fn free_of_line(spectrum: &Spectrum, bin: usize) -> f64 {
    let is_alpha = ALPHA_HZ.contains(&spectrum.frequencies_hz[bin]);
    let (around, (from, to)) =
        if is_alpha { (AROUND_ALPHA, ALPHA_RATIOS) } else { (AROUND, RATIOS) };
    let height = |bin: usize| Some(spectrum.power.get(bin)? * spectrum.frequencies_hz.get(bin)?);
    let sides = around.flat_map(|away| [bin.checked_sub(away), Some(bin + away)]);
    let others: Vec<f64> = sides.flatten().filter(|&bin| bin > 0).filter_map(height).collect();
    let usual = median(&others).unwrap_or(f64::NAN);
    let ratio = height(bin).unwrap_or(f64::NAN) / usual;
    // Without power there is nothing to judge: the amplitude shows that.
    if ratio.is_nan() {
        1.0
    } else {
        (1.0 - (ratio / from).ln() / (to / from).ln()).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spectrum of 1/f, with powers added at frequencies [Hz].
    fn with(peaks: &[(f64, f64)]) -> f64 {
        let frequencies_hz: Vec<f64> = (0..182).map(|bin| f64::from(bin) / 4.0).collect();
        let at = |hz: &f64| {
            let peaks = peaks.iter().filter(|(at, _)| (at - hz).abs() < 0.2);
            50.0 / hz.max(0.25) + peaks.map(|(_, power)| power).sum::<f64>()
        };
        let power = frequencies_hz.iter().map(at).collect();
        free_of_lines(&Spectrum { frequencies_hz, power, segments: 29 })
    }

    #[test]
    fn tones_are_lines_and_alpha_is_none() {
        assert!(with(&[]) > 0.99);
        for (hz, power) in [(1.75, 2000.0), (16.75, 200.0), (25.0, 200.0), (10.0, 1000.0)] {
            assert!(with(&[(hz, power)]) < 0.5, "{hz}");
        }
        let alpha = [(9.5, 20.0), (9.75, 40.0), (10.0, 50.0), (10.25, 40.0), (10.5, 20.0)];
        assert!(with(&alpha) > 0.99);
    }
}
