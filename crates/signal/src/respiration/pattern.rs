//! The breathing pattern.

use std::ops::Range;

use super::Breath;

/// The breathing pattern of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// The number of breaths entirely in the window.
    pub breaths: usize,
    /// Breaths per minute [1/min]: fractional breaths over the time that they cover. For whole breaths, this is 60 over
    /// their mean duration.
    pub rate_mean_per_min: f64,
    /// Standard deviation of the breaths' rates, 60 over each duration (n − 1) [1/min].
    pub rate_sd_per_min: f64,
    /// Mean amplitude [unit of the signal].
    pub amplitude_mean: f64,
    /// Standard deviation of amplitudes (n − 1) [unit of the signal].
    pub amplitude_sd: f64,
    /// Mean time of inhalation [s].
    pub inhalation_secs: f64,
    /// Mean time of exhalation, including the pause after it [s].
    pub exhalation_secs: f64,
    /// The ratio of inhalation to exhalation (I/E).
    pub inhalation_to_exhalation: f64,
    /// Mean of amplitude over duration [unit of the signal/s]: respiratory volume per time, as Birn
    /// et al. (2006), doi:10.1016/j.neuroimage.2006.02.048, define it.
    pub volume_per_time: f64,
}

impl Pattern {
    /// Computes the pattern of ascending breaths within a range of samples of a signal at `rate_hz`.
    ///
    /// The rate includes the partial breaths at both ends; the rest uses breaths entirely in the range and is
    /// NaN without one (standard deviations: two). Window: 30 s by convention, at least two breaths. `None`
    /// where no breath overlaps the range. Limits: a belt's amplitudes are comparable within one sitting
    /// only.
    pub fn of(breaths: &[Breath], rate_hz: f64, samples: Range<f64>) -> Option<Pattern> {
        let parts = || breaths.iter().map(|breath| (breath.overlap(&samples), breath.duration()));
        let covered: f64 = parts().map(|(overlap, _)| overlap).sum();
        let count: f64 = parts().map(|(overlap, duration)| overlap / duration).sum();
        let rate_mean_per_min = 60.0 * rate_hz * count / covered;
        if !(rate_mean_per_min > 0.0 && rate_mean_per_min.is_finite()) {
            return None;
        }
        let whole: Vec<&Breath> = breaths.iter().filter(|each| each.is_within(&samples)).collect();
        let all =
            |of: &dyn Fn(&Breath) -> f64| whole.iter().map(|each| of(each)).collect::<Vec<f64>>();
        let rates = all(&|breath| 60.0 * rate_hz / breath.duration());
        let amplitudes = all(&|breath| breath.amplitude);
        let inhalation_secs = mean(&all(&|breath| breath.inhalation())) / rate_hz;
        let exhalation_secs = mean(&all(&|breath| breath.exhalation())) / rate_hz;
        Some(Pattern {
            breaths: whole.len(),
            rate_mean_per_min,
            rate_sd_per_min: sample_sd(&rates),
            amplitude_mean: mean(&amplitudes),
            amplitude_sd: sample_sd(&amplitudes),
            inhalation_secs,
            exhalation_secs,
            inhalation_to_exhalation: inhalation_secs / exhalation_secs,
            volume_per_time: mean(&all(&|breath| breath.amplitude / breath.duration())) * rate_hz,
        })
    }
}

/// The mean; NaN without values.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The standard deviation (n − 1); NaN with fewer than two.
pub(super) fn sample_sd(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|each| (each - mean).powi(2)).sum();
    if values.len() < 2 { f64::NAN } else { (squares / (values.len() as f64 - 1.0)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Breaths of 4 s at 10 Hz.
    fn breath(number: u32) -> Breath {
        let begin = 40.0 * f64::from(number);
        Breath { begin, peak: begin + 15.0, end: begin + 40.0, amplitude: 2.0 }
    }

    #[test]
    fn equal_breaths_have_their_pattern() {
        let breaths: Vec<Breath> = (0..10).map(breath).collect();
        let pattern = Pattern::of(&breaths, 10.0, 0.0..400.0).unwrap();
        assert_eq!((pattern.breaths, pattern.rate_mean_per_min), (10, 15.0));
        assert_eq!((pattern.rate_sd_per_min, pattern.amplitude_sd), (0.0, 0.0));
        assert_eq!((pattern.inhalation_secs, pattern.exhalation_secs), (1.5, 2.5));
        assert!((pattern.inhalation_to_exhalation - 0.6).abs() < 1e-12);
        assert!((pattern.volume_per_time - 0.5).abs() < 1e-12);
    }

    #[test]
    fn where_a_window_cuts_does_not_change_the_rate() {
        let breaths: Vec<Breath> = (0..10).map(breath).collect();
        for begin in 0..200 {
            let begin = f64::from(begin);
            let pattern = Pattern::of(&breaths, 10.0, begin..begin + 110.0).unwrap();
            assert!((pattern.rate_mean_per_min - 15.0).abs() < 1e-12);
        }
    }

    #[test]
    fn without_a_breath_there_is_no_pattern() {
        assert_eq!(Pattern::of(&[], 10.0, 0.0..400.0), None);
        assert_eq!(Pattern::of(&[breath(0)], 10.0, 50.0..400.0), None);
        assert_eq!(Pattern::of(&[breath(0)], f64::NAN, 0.0..400.0), None);
        let part = Pattern::of(&[breath(0)], 10.0, 10.0..30.0).unwrap();
        assert!(part.rate_mean_per_min > 0.0 && part.amplitude_mean.is_nan());
    }
}
