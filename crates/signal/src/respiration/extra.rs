//! Heartbeats that are counted as breaths.

use super::Breath;
use crate::robust::median;

/// A breath that is both shorter and lower than these shares of the median is a heartbeat.
const SHORT: f64 = 0.5;
const LOW: f64 = 0.5;

/// The share of the counted breaths that are far too short and too low to be breaths [0..1].
///
/// A heart below 60 beats a minute is as slow as fast breathing: in the pauses between slow breaths, single beats of it
/// are counted.
pub(super) fn extra_share(breaths: &[&Breath]) -> f64 {
    let usual = |of: fn(&Breath) -> f64| {
        let all: Vec<f64> = breaths.iter().map(|breath| of(breath)).collect();
        median(&all).unwrap_or(f64::NAN)
    };
    let (duration, amplitude) = (usual(Breath::duration), usual(|breath| breath.amplitude));
    let is_extra = |breath: &&&Breath| {
        breath.duration() < SHORT * duration && breath.amplitude < LOW * amplitude
    };
    breaths.iter().filter(is_extra).count() as f64 / breaths.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share among ten breaths of 4 s, of which two have this duration [s] and amplitude.
    fn share(duration: f64, amplitude: f64) -> f64 {
        let breath = |number: usize| {
            let (end, amplitude) =
                if number.is_multiple_of(5) { (duration, amplitude) } else { (4.0, 1.0) };
            Breath { begin: 0.0, peak: 1.0, end, amplitude }
        };
        let breaths: Vec<Breath> = (0..10).map(breath).collect();
        extra_share(&breaths.iter().collect::<Vec<_>>())
    }

    #[test]
    fn only_breaths_that_are_short_and_low_are_extra() {
        assert!((share(1.2, 0.2) - 0.2).abs() < 1e-12);
        assert!(share(1.2, 0.8).abs() < 1e-12 && share(3.5, 0.2).abs() < 1e-12);
    }

    #[test]
    fn without_breaths_none_is_extra() {
        assert!(extra_share(&[]).abs() < 1e-12);
    }
}
