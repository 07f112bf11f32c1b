use super::measure::Measure;
use super::series::{differences, present};
use crate::moments::sample_variance;

/// The ellipse of the Poincaré plot: each interval over the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poincare {
    /// Standard deviation across the line of identity [ms]: beat-to-beat variability.
    pub sd1_ms: f64,
    /// Standard deviation along the line of identity [ms]: slower variability.
    pub sd2_ms: f64,
    /// SD1 over SD2.
    pub sd1_sd2: f64,
    /// Area of the ellipse, π·SD1·SD2 [ms²].
    pub area_ms2: f64,
    /// Cardiac sympathetic index, SD2 over SD1.
    pub csi: f64,
    /// Cardiac vagal index, log₁₀(16·SD1·SD2).
    pub cvi: f64,
    /// Modified sympathetic index, 4·SD2²/SD1 [ms].
    pub csi_modified_ms: f64,
}

/// The Poincaré ellipse of intervals [ms].
///
/// SD1² = Var(Δ)/2 and SD2² = 2·Var(NN) − Var(Δ)/2, with n − 1 in both. Brennan et al. (2001),
/// doi:10.1109/10.959330; indices: Toichi et al. (1997), doi:10.1016/S0165-1838(96)00112-9, Jeppesen et
/// al. (2014), doi:10.1109/EMBC.2014.6944639. NeuroKit2 computes SD2 from the pairs, which omits half
/// of both ends. Window: as for RMSSD. `None` with fewer than three intervals. Limits: SD1 carries the same
/// information as RMSSD.
pub fn poincare(intervals_ms: &[f64]) -> Option<Poincare> {
    let (nn, steps) = (present(intervals_ms), differences(intervals_ms));
    let half = sample_variance(&steps) / 2.0;
    let (sd1, sd2) = (half.sqrt(), (2.0 * sample_variance(&nn) - half).max(0.0).sqrt());
    (sd1.is_finite() && sd2.is_finite()).then(|| Poincare {
        sd1_ms: sd1,
        sd2_ms: sd2,
        sd1_sd2: sd1 / sd2,
        area_ms2: std::f64::consts::PI * sd1 * sd2,
        csi: sd2 / sd1,
        cvi: (16.0 * sd1 * sd2).log10(),
        csi_modified_ms: 4.0 * sd2 * sd2 / sd1,
    })
}

impl Poincare {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([
            ("HRV_SD1", "ms", self.sd1_ms),
            ("HRV_SD2", "ms", self.sd2_ms),
            ("HRV_SD1SD2", "1", self.sd1_sd2),
            ("HRV_S", "ms^2", self.area_ms2),
            ("HRV_CSI", "1", self.csi),
            ("HRV_CVI", "1", self.cvi),
            ("HRV_CSI_Modified", "ms", self.csi_modified_ms),
        ])
    }
}
