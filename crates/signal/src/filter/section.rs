//! Second-order sections.

use realfft::num_complex::Complex64;

/// The coefficients of H(z) = (b₀ + b₁z⁻¹ + b₂z⁻²) / (1 + a₁z⁻¹ + a₂z⁻²).
///
/// A row of SciPy's `sos`, without its 1 for a₀.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Numerator: b₀, b₁, b₂.
    pub b: [f64; 3],
    /// Denominator after its leading 1: a₁, a₂.
    pub a: [f64; 2],
}

impl Section {
    /// Whether both poles lie inside the unit circle (and all coefficients are finite): Jury's test.
    pub fn is_stable(&self) -> bool {
        let [a1, a2] = self.a;
        self.b.iter().all(|b| b.is_finite()) && a2.abs() < 1.0 && a1.abs() < 1.0 + a2
    }

    /// The DC gain, H(1).
    pub fn constant_gain(&self) -> f64 {
        self.b.iter().sum::<f64>() / self.denominator_sum()
    }

    /// The steady state for a constant input of 1: SciPy's `lfilter_zi`.
    pub fn settled_state(&self) -> [f64; 2] {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        let first = (b1 - a1 * b0 + b2 - a2 * b0) / self.denominator_sum();
        [first, (1.0 + a1) * first - (b1 - a1 * b0)]
    }

    /// The radius of the outer pole: the decay of the impulse response per sample.
    pub fn pole_radius(&self) -> f64 {
        let [a1, a2] = self.a;
        let discriminant = a1 * a1 / 4.0 - a2;
        if discriminant < 0.0 { a2.sqrt() } else { a1.abs() / 2.0 + discriminant.sqrt() }
    }

    /// H at z⁻¹ = `delay`.
    pub(super) fn response(&self, delay: Complex64) -> Complex64 {
        let (numerator, denominator) = self.polynomials();
        value(numerator, delay) / value(denominator, delay)
    }

    /// Group delay [samples] at z⁻¹ = `delay`.
    pub(super) fn group_delay(&self, delay: Complex64) -> f64 {
        let (numerator, denominator) = self.polynomials();
        polynomial_delay(numerator, delay) - polynomial_delay(denominator, delay)
    }

    fn polynomials(&self) -> ([f64; 3], [f64; 3]) {
        (self.b, [1.0, self.a[0], self.a[1]])
    }

    fn denominator_sum(&self) -> f64 {
        1.0 + self.a[0] + self.a[1]
    }
}

fn value([c0, c1, c2]: [f64; 3], delay: Complex64) -> Complex64 {
    (delay * c2 + c1) * delay + c0
}

/// Re(Σ k·cₖz⁻ᵏ / Σ cₖz⁻ᵏ); NaN at a zero on the unit circle, where the phase jumps.
fn polynomial_delay(coefficients: [f64; 3], delay: Complex64) -> f64 {
    let [_, c1, c2] = coefficients;
    let ramp = (delay * (2.0 * c2) + c1) * delay;
    let ratio = ramp / value(coefficients, delay);
    if ratio.re.is_finite() { ratio.re } else { f64::NAN }
}
