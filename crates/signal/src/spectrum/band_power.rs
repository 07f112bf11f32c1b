//! A spectrum and its band powers.

use std::ops::Range;

use crate::error::SignalError;

/// Power at ascending frequencies.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// The frequencies of the bins [Hz].
    pub frequencies_hz: Vec<f64>,
    /// The power at each frequency: a density [unit² / Hz], or as set by the estimator.
    pub power: Vec<f64>,
    /// The number of averaged segments.
    pub segments: usize,
}

/// The maximum of a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The frequency of the maximum [Hz].
    pub frequency_hz: f64,
    /// The power at the maximum, in the unit of the spectrum.
    pub power: f64,
}

/// The rule of integration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Trapezoids between the bins: `numpy.trapezoid`.
    Trapezoid,
    /// Parabolas through three bins each: `scipy.integrate.simpson`, with Cartwright's correction of the last interval
    /// if the number of bins is even.
    Simpson,
    /// Each bin times the bin spacing: the sum over all bins is the power of the signal.
    Sum,
}

impl Spectrum {
    /// The power between `low_hz` and `high_hz` [unit²], from a density.
    ///
    /// Integrates over the bins with `low_hz` ≤ f < `high_hz`: half-open, so that adjacent bands share no bins. The
    /// rules differ where a band has few bins; state which was used. `None` with fewer than two bins (one for
    /// [`Rule::Sum`]).
    pub fn band_power(&self, low_hz: f64, high_hz: f64, rule: Rule) -> Option<f64> {
        let bins = self.bins(low_hz, high_hz);
        let (x, y) = (&self.frequencies_hz[bins.clone()], &self.power[bins]);
        match rule {
            Rule::Sum => Some(y.iter().sum::<f64>() * self.step_hz()?).filter(|_| !y.is_empty()),
            _ if y.len() < 2 => None,
            Rule::Trapezoid => Some(trapezoid(x, y)),
            Rule::Simpson => Some(simpson(x, y)),
        }
    }

    /// The bin of the greatest power with `low_hz` ≤ f < `high_hz`. `None` without a bin.
    pub fn peak(&self, low_hz: f64, high_hz: f64) -> Option<Peak> {
        let at =
            |bin: usize| Peak { frequency_hz: self.frequencies_hz[bin], power: self.power[bin] };
        self.bins(low_hz, high_hz).map(at).max_by(|one, other| one.power.total_cmp(&other.power))
    }

    /// The bins with `low_hz` ≤ f < `high_hz`.
    pub fn bins(&self, low_hz: f64, high_hz: f64) -> Range<usize> {
        let before = |edge_hz: f64| self.frequencies_hz.partition_point(|&f| f < edge_hz);
        let (begin, end) = (before(low_hz), before(high_hz));
        begin.min(end)..end
    }

    pub(super) fn finite(self) -> Result<Spectrum, SignalError> {
        let is_finite = self.power.iter().all(|power| power.is_finite());
        if is_finite { Ok(self) } else { Err(SignalError::Overflow) }
    }

    fn step_hz(&self) -> Option<f64> {
        let (first, last) = (self.frequencies_hz.first()?, self.frequencies_hz.last()?);
        let steps = self.frequencies_hz.len() - 1;
        (steps > 0).then(|| (last - first) / steps as f64)
    }
}

fn trapezoid(x: &[f64], y: &[f64]) -> f64 {
    let pairs = x.windows(2).zip(y.windows(2));
    pairs.map(|(x, y)| (x[1] - x[0]) * (y[0] + y[1]) / 2.0).sum()
}

fn simpson(x: &[f64], y: &[f64]) -> f64 {
    if y.len() == 2 {
        return trapezoid(x, y);
    }
    let triples = x.windows(3).zip(y.windows(3)).step_by(2);
    let whole: f64 = triples.map(|(x, y)| parabola(x[1] - x[0], x[2] - x[1], y)).sum();
    if y.len() % 2 == 1 {
        return whole;
    }
    let (x, y) = (&x[x.len() - 3..], &y[y.len() - 3..]);
    whole + last_interval(x[1] - x[0], x[2] - x[1], y)
}

/// Integral of the parabola through three points.
fn parabola(first: f64, second: f64, y: &[f64]) -> f64 {
    let both = first + second;
    let ends = y[0] * (2.0 - second / first) + y[2] * (2.0 - first / second);
    both / 6.0 * (ends + y[1] * both * both / (first * second))
}

/// Integral over the second interval alone. Cartwright (2017), equation 8.
fn last_interval(first: f64, second: f64, y: &[f64]) -> f64 {
    let both = first + second;
    let last = (2.0 * second * second + 3.0 * first * second) / (6.0 * both);
    let middle = (second * second + 3.0 * first * second) / (6.0 * first);
    last * y[2] + middle * y[1] - second.powi(3) / (6.0 * first * both) * y[0]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn flat(bins: usize) -> Spectrum {
        let frequencies_hz = (0..bins).map(|bin| bin as f64 / 2.0).collect();
        Spectrum { frequencies_hz, power: vec![3.0; bins], segments: 1 }
    }

    #[test]
    fn a_band_is_half_open() {
        assert_eq!(flat(20).bins(1.0, 2.0), 2..4);
        assert_eq!(flat(20).bins(2.0, 1.0), 2..2);
        assert_eq!(flat(20).bins(f64::NAN, f64::NAN), 0..0);
    }

    #[test]
    fn the_sum_of_neighbouring_bands_is_that_of_both() {
        let power = |low_hz, high_hz| flat(20).band_power(low_hz, high_hz, Rule::Sum).unwrap();
        assert_eq!(power(1.0, 3.0) + power(3.0, 6.0), power(1.0, 6.0));
        assert_eq!(power(1.0, 6.0), 15.0);
    }

    #[test]
    fn a_band_without_bins_has_no_power() {
        for rule in [Rule::Sum, Rule::Trapezoid, Rule::Simpson] {
            assert_eq!(flat(20).band_power(100.0, 200.0, rule), None);
            assert_eq!(flat(0).band_power(0.0, 200.0, rule), None);
        }
        assert_eq!(flat(20).peak(100.0, 200.0), None);
    }

    proptest! {
        #[test]
        fn simpson_is_exact_for_parabolas(bins in 3usize..30, c0 in -9.0..9.0f64, c2 in -9.0..9.0f64) {
            let height = |f: f64| c0 + c2 * f * f;
            let power = flat(bins).frequencies_hz.iter().map(|&f| height(f)).collect();
            let spectrum = Spectrum { power, ..flat(bins) };
            let end = (bins - 1) as f64 / 2.0;
            let exact = c0 * end + c2 * end.powi(3) / 3.0;
            let found = spectrum.band_power(0.0, 1e9, Rule::Simpson).unwrap();
            prop_assert!((found - exact).abs() < 1e-9 * (1.0 + exact.abs()), "{found} {exact}");
        }
    }
}
