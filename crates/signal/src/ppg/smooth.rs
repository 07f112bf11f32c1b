//! Smoothing that preserves the height and position of pulse waves.

/// The half-width of the fit [s]; removes frequencies above 10 Hz.
const REACH_SECS: f64 = 0.06;

/// A Savitzky–Golay filter of order 2 (1964, doi:10.1021/ac60214a047). Symmetric: no delay.
#[derive(Clone, Debug)]
pub(super) struct Smoothing {
    /// The weights from the centre outwards.
    weights: Vec<f64>,
}

impl Smoothing {
    pub(super) fn new(rate_hz: f64) -> Smoothing {
        let reach = (REACH_SECS * rate_hz).round().max(1.0);
        let scale = (2.0 * reach - 1.0) * (2.0 * reach + 1.0) * (2.0 * reach + 3.0);
        let middle = 3.0 * reach * reach + 3.0 * reach - 1.0;
        let weight = |away: usize| 3.0 * (middle - 5.0 * (away * away) as f64) / scale;
        Smoothing { weights: (0..=reach as usize).map(weight).collect() }
    }

    /// The half-width in samples.
    pub(super) fn reach(&self) -> usize {
        self.weights.len() - 1
    }

    /// Appends the smoothed values; the signal is extended by its end values.
    pub(super) fn smooth_into(&self, signal: &[f64], smoothed: &mut Vec<f64>) {
        let reach = self.reach();
        smoothed.reserve(signal.len());
        let inside = reach..signal.len().saturating_sub(reach).max(reach);
        smoothed.extend((0..reach.min(signal.len())).map(|place| self.at_edge(signal, place)));
        smoothed
            .extend(inside.clone().map(|place| self.at(&signal[place - reach..=place + reach])));
        smoothed.extend((inside.end..signal.len()).map(|place| self.at_edge(signal, place)));
    }

    pub(super) fn smoothed(&self, signal: &[f64]) -> Vec<f64> {
        let mut smoothed = Vec::new();
        self.smooth_into(signal, &mut smoothed);
        smoothed
    }

    /// The smoothed value at the centre.
    pub(super) fn at(&self, around: &[f64]) -> f64 {
        let reach = self.reach();
        let pairs = around[..reach].iter().rev().zip(&around[reach + 1..]);
        let sides = pairs.zip(&self.weights[1..]).map(|((l, r), weight)| weight * (l + r));
        self.weights[0] * around[reach] + sides.sum::<f64>()
    }

    fn at_edge(&self, signal: &[f64], place: usize) -> f64 {
        let last = signal.len() - 1;
        let pair =
            |away: usize| signal[place.saturating_sub(away)] + signal[(place + away).min(last)];
        let sides = (1..=self.reach()).map(|away| self.weights[away] * pair(away));
        self.weights[0] * signal[place] + sides.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_stays_as_it_is() {
        let parabola: Vec<f64> = (0..40).map(|k| f64::from(k * k) - 3.0 * f64::from(k)).collect();
        let smoothed = Smoothing::new(100.0).smoothed(&parabola);
        assert_eq!(smoothed.len(), 40);
        for place in 6..34 {
            assert!((smoothed[place] - parabola[place]).abs() < 1e-9);
        }
    }

    #[test]
    fn any_length_stays() {
        for length in 0..20 {
            assert_eq!(Smoothing::new(200.0).smoothed(&vec![1.0; length]).len(), length);
        }
    }
}
