//! The heart in the signal of a belt.

use std::f64::consts::{PI, SQRT_2, TAU};

use super::Pattern;
use super::spectral::Spectral;
use super::variability::Variability;

/// The frequencies of the heart [Hz], and the usual one.
pub(super) const HEART_HZ: (f64, f64) = (0.8, 2.5);
const USUAL_HZ: f64 = 1.1;
/// Harmonics of faster breaths are as fast as the heart [1/min].
const FASTEST_PER_MIN: f64 = 24.0;
/// The share of the pulsation's amplitude that passes the low-pass at 1 Hz before the detection.
const LEFT: f64 = 0.4;
/// The longest time by which the heart can shift a turning point [s].
const LONGEST_SHIFT_SECS: f64 = 0.25;
/// The largest height of the pulsation at which the heights and phases of breaths are reported, as a share of a breath.
const LARGEST_HEIGHT: f64 = 0.06;
/// The largest share of the variance of durations that may be due to the heart.
const LARGEST_SHARE: f64 = 1.0 / 3.0;
/// A spread of durations below this does not matter [ms]: the steadiest breathing has as much.
const LEAST_SPREAD_MS: f64 = 50.0;

/// The effect of the heart on breaths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulsation {
    /// The amplitude of the pulsation, as a share of the height of breaths.
    height: f64,
    /// The standard deviation by which the pulsation shifts turning points [s].
    shift_secs: f64,
}

impl Pulsation {
    /// Estimates the pulsation beside a pattern: its amplitude from the power in the heart's band and in the breathing
    /// band, and its shift of turning points from the slope of a raised cosine of the inhalation.
    pub(super) fn of(spectral: &Spectral, pattern: &Pattern) -> Pulsation {
        let is_slow = pattern.rate_mean_per_min <= FASTEST_PER_MIN;
        let height = if is_slow { spectral.heart_to_breath.sqrt() / 2.0 } else { 0.0 };
        let curvature = (PI / pattern.inhalation_secs).powi(2) / 2.0;
        let shift_secs = LEFT * height * TAU * USUAL_HZ / curvature / SQRT_2;
        Pulsation { height, shift_secs: shift_secs.min(LONGEST_SHIFT_SECS) }
    }

    /// Whether heights and phases of breaths are mostly unaffected by the pulsation.
    pub(super) fn leaves_phases(self) -> bool {
        self.height.is_nan() || self.height <= LARGEST_HEIGHT
    }

    /// Whether the variability of durations is mostly unaffected by the pulsation, which shifts both turning points of
    /// a breath.
    pub(super) fn leaves(self, variability: &Variability) -> bool {
        let of_heart = 2.0 * (1000.0 * self.shift_secs).powi(2);
        let most = (LARGEST_SHARE * variability.sdbb_ms.powi(2)).max(LEAST_SPREAD_MS.powi(2));
        self.height.is_nan() || of_heart <= most
    }
}
