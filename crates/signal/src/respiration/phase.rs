//! The phase within a breath.

use super::Breath;

/// A phase of a breath, and its completion [0..1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// Inhalation.
    Inhalation(f64),
    /// Exhalation, or the pause before the next breath.
    Exhalation(f64),
}

/// The phase at a sample, or between samples, of a signal with these ascending breaths.
///
/// NeuroKit2's `RSP_Phase` (1 for inhalation) and `RSP_Phase_Completion`. `None` outside breaths.
///
/// ```
/// use teampulse_signal::respiration::{Breath, Phase, phase_at};
/// let breath = Breath { begin: 100.0, peak: 150.0, end: 250.0, amplitude: 1.0 };
/// assert_eq!(phase_at(&[breath], 125.0), Some(Phase::Inhalation(0.5)));
/// assert_eq!(phase_at(&[breath], 240.0), Some(Phase::Exhalation(0.9)));
/// assert_eq!(phase_at(&[breath], 250.0), None);
/// ```
pub fn phase_at(breaths: &[Breath], sample: f64) -> Option<Phase> {
    let after = breaths.partition_point(|breath| breath.begin <= sample);
    let breath = &breaths[after.checked_sub(1)?];
    let share = |begin: f64, length: f64| (sample - begin) / length;
    match sample {
        _ if sample < breath.peak => {
            Some(Phase::Inhalation(share(breath.begin, breath.inhalation())))
        }
        _ if sample < breath.end => {
            Some(Phase::Exhalation(share(breath.peak, breath.exhalation())))
        }
        _ => None,
    }
}
