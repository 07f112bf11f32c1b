//! Whether the signal of a belt has a rhythm other than the counted one.

use super::spectral::Spectral;

/// The half-width of a line in the spectrum of 30 s [Hz].
const LINE_HZ: f64 = 0.05;
/// The relative half-width of the counted rhythm, and of its harmonics.
const OWN_WIDTH: f64 = 0.2;
const HARMONIC_WIDTH: f64 = 0.1;
/// The harmonics that the shape of breaths may have.
const HARMONICS: [f64; 3] = [2.0, 3.0, 4.0];
/// Drift lies below this frequency [Hz].
const LEAST_HZ: f64 = 0.08;
/// Steps, pedalling and the heart are faster than this, but few breaths at rest are [1/min].
const FAST_PER_MIN: f64 = 24.0;
/// The power of a slower rhythm, relative to the counted one, below which it is not a rival, and from which it may be
/// the breathing: blood pressure waves and sway are slower rhythms, too.
const SLOWER: (f64, f64) = (0.3, 0.8);
/// The limits for a slower rhythm if the counted one is fast: a fast rhythm may be motion that masks the breathing.
const SLOWER_THAN_FAST: (f64, f64) = (0.03, 0.1);
/// The limits in that case for a clear line, which has more than this share of all slower power.
const CLEAR_SLOWER_THAN_FAST: (f64, f64) = (0.003, 0.01);
const CLEAR_SHARE: f64 = 0.7;
/// The limits for the power of a faster rhythm.
const FASTER: (f64, f64) = (0.15, 0.45);
/// The limits for the relative difference between the counted rate and that of the highest line.
const DIFFERENT: (f64, f64) = (0.15, 0.4);

/// How certain it is that the counted rate is the only one in a spectrum [0..1].
pub(super) fn alone(spectral: &Spectral, rate_per_min: f64) -> f64 {
    let hz = rate_per_min / 60.0;
    let own: f64 = power(spectral, |at| (at - hz).abs() <= (OWN_WIDTH * hz).max(LINE_HZ));
    let is_slower = |at: f64| (LEAST_HZ..(0.75 * hz).min(hz - LINE_HZ)).contains(&at);
    let is_faster = |at: f64| at > (1.3 * hz).max(hz + LINE_HZ) && !is_harmonic(at, hz);
    let line = highest_line(spectral, is_slower);
    let is_clear = line > CLEAR_SHARE * power(spectral, is_slower);
    let slower = if rate_per_min < FAST_PER_MIN {
        SLOWER
    } else if is_clear {
        CLEAR_SLOWER_THAN_FAST
    } else {
        SLOWER_THAN_FAST
    };
    let difference = (spectral.rate_per_min / rate_per_min - 1.0).abs();
    falls(line / own, slower)
        .min(falls(highest_line(spectral, is_faster) / own, FASTER))
        .min(falls(difference, DIFFERENT))
}

/// Falls from 1 at the first limit to 0 at the second.
pub(super) fn falls(value: f64, (from, to): (f64, f64)) -> f64 {
    ((to - value) / (to - from)).clamp(0.0, 1.0)
}

fn is_harmonic(at_hz: f64, hz: f64) -> bool {
    let width_hz = |order: f64| ((HARMONIC_WIDTH * order).min(0.3) * hz).max(LINE_HZ);
    let is_near = |order: f64| (at_hz - order * hz).abs() <= width_hz(order);
    HARMONICS.into_iter().any(is_near)
}

/// The power of the breathing band at the frequencies selected by `has`.
fn power(spectral: &Spectral, has: impl Fn(f64) -> bool) -> f64 {
    spectral.powers.iter().filter(|(hz, _)| has(*hz)).map(|(_, power)| power).sum()
}

/// The power of the highest line among the frequencies selected by `may`.
fn highest_line(spectral: &Spectral, may: impl Fn(f64) -> bool) -> f64 {
    let is_top =
        |three: &&[(f64, f64)]| may(three[1].0) && three[1].1 >= three[0].1.max(three[2].1);
    let line =
        |three: &[(f64, f64)]| power(spectral, |hz| (hz - three[1].0).abs() <= LINE_HZ && may(hz));
    spectral.powers.windows(3).filter(is_top).map(line).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::spectrum::Transforms;

    /// A minute of sines: frequency [Hz] and height.
    fn alone_with(sines: &[(f64, f64)], rate_per_min: f64) -> f64 {
        let at =
            |k: u32| sines.iter().map(|(hz, a)| a * (TAU * hz * f64::from(k) / 25.0).sin()).sum();
        let means: Vec<f64> = (0..1500).map(at).collect();
        alone(&Spectral::of(&means, 25.0, &Transforms::default()).unwrap(), rate_per_min)
    }

    #[test]
    fn one_rhythm_and_its_harmonics_are_alone() {
        for per_min in [6.0, 15.0, 30.0, 50.0] {
            let hz = per_min / 60.0;
            assert!(alone_with(&[(hz, 1.0)], per_min) > 0.99, "{per_min}");
            assert!(alone_with(&[(hz, 1.0), (2.0 * hz, 0.4)], per_min) > 0.99, "{per_min}");
        }
    }

    #[test]
    fn a_second_rhythm_of_comparable_power_is_a_rival() {
        // Breath beneath steps, beneath pedals, and what counts neither.
        assert!(alone_with(&[(0.25, 1.0), (0.9, 2.5)], 54.0) < 0.1);
        assert!(alone_with(&[(0.22, 1.0), (0.6, 1.5)], 36.0) < 0.1);
        assert!(alone_with(&[(0.22, 1.0), (0.45, 0.1)], 18.0) < 0.5);
        assert!(alone_with(&[(0.25, 0.1), (0.9, 1.0)], 54.0) < 0.1, "motion ten times the breath");
        // The heart beside breaths that are counted rightly, and blood pressure waves.
        assert!(alone_with(&[(0.25, 1.0), (0.9, 0.3)], 15.0) > 0.99);
        assert!(alone_with(&[(0.25, 1.0), (0.1, 0.3)], 15.0) > 0.99);
    }
}
