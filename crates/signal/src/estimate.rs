//! A value with its uncertainty.

/// A value and its standard uncertainty (one standard deviation), in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// The standard uncertainty of the value; NaN where none can be stated.
    pub sigma: f64,
}

impl Estimate {
    /// A value whose uncertainty is unknown.
    pub fn unstated(value: f64) -> Estimate {
        Estimate { value, sigma: f64::NAN }
    }

    /// The same quantity in another unit: value and uncertainty times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Estimate {
        Estimate { value: self.value * factor, sigma: self.sigma * factor.abs() }
    }

    /// The same value with an independent uncertainty added in quadrature.
    #[must_use]
    pub fn widened(self, sigma: f64) -> Estimate {
        Estimate { value: self.value, sigma: self.sigma.hypot(sigma) }
    }

    /// The value in standard uncertainties; infinite for a non-zero value without uncertainty, NaN for zero
    /// without uncertainty and where the uncertainty is unknown.
    pub fn significance(self) -> f64 {
        self.value.abs() / self.sigma
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_keeps_the_uncertainty_positive() {
        let estimate = Estimate { value: 2.0, sigma: 0.5 }.scaled(-2.0);
        assert_eq!(estimate, Estimate { value: -4.0, sigma: 1.0 });
    }

    #[test]
    fn independent_uncertainties_add_in_quadrature() {
        assert_eq!(Estimate { value: 1.0, sigma: 3.0 }.widened(4.0).sigma, 5.0);
    }

    #[test]
    fn significance_counts_standard_uncertainties() {
        assert_eq!(Estimate { value: -6.0, sigma: 2.0 }.significance(), 3.0);
        assert!(Estimate::unstated(1.0).significance().is_nan());
    }
}
