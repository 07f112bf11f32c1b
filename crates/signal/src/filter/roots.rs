//! Zeros, poles and gain of a transfer function.

use std::f64::consts::PI;

use realfft::num_complex::Complex64;

use super::Section;

/// Twice the sampling rate at which filters are designed: 2 samples a second, as SciPy does.
const TWICE_RATE: f64 = 4.0;

/// An imaginary part below this share of the modulus is rounding: the root is real.
const REAL_WITHIN: f64 = 100.0 * f64::EPSILON;

const ZERO: Complex64 = Complex64::ZERO;

/// Zeros, poles and gain; complex ones come with their conjugates.
pub(super) struct Roots {
    zeros: Vec<Complex64>,
    poles: Vec<Complex64>,
    gain: f64,
}

impl Roots {
    /// The analog Butterworth low-pass with its cut-off at 1 rad/s.
    pub(super) fn butterworth(order: u32) -> Roots {
        let n = f64::from(order);
        let pole = |k: u32| {
            let m = f64::from(2 * k + 1) - n;
            // The middle pole of an odd order is exactly real.
            -Complex64::new(0.0, PI * m / (2.0 * n)).exp()
        };
        Roots { zeros: Vec::new(), poles: (0..order).map(pole).collect(), gain: 1.0 }
    }

    pub(super) fn low_pass(self, corner: f64) -> Roots {
        let gain = self.gain * corner.powi(self.degree());
        self.mapped(gain, |root| root * corner)
    }

    pub(super) fn high_pass(self, corner: f64) -> Roots {
        let (degree, gain) = (self.degree(), self.inverted_gain());
        let mut high = self.mapped(gain, |root| corner / root);
        high.zeros.extend((0..degree).map(|_| ZERO));
        high
    }

    pub(super) fn band_pass(self, centre: f64, width: f64) -> Roots {
        let degree = self.degree();
        let gain = self.gain * width.powi(degree);
        let mut band = self.mapped(gain, |root| root * width / 2.0).split_about(centre);
        band.zeros.extend((0..degree).map(|_| ZERO));
        band
    }

    pub(super) fn band_stop(self, centre: f64, width: f64) -> Roots {
        let (degree, gain) = (self.degree(), self.inverted_gain());
        let mut band = self.mapped(gain, |root| width / 2.0 / root).split_about(centre);
        for side in [centre, -centre] {
            band.zeros.extend((0..degree).map(|_| Complex64::new(0.0, side)));
        }
        band
    }

    /// The bilinear transform.
    pub(super) fn bilinear(self) -> Roots {
        let degree = self.degree();
        let product = |roots: &[Complex64]| -> Complex64 {
            roots.iter().map(|root| TWICE_RATE - root).product()
        };
        let gain = self.gain * (product(&self.zeros) / product(&self.poles)).re;
        let mut digital = self.mapped(gain, |root| (TWICE_RATE + root) / (TWICE_RATE - root));
        digital.zeros.extend((0..degree).map(|_| Complex64::new(-1.0, 0.0)));
        digital
    }

    /// Pairs each pole with the nearest zero, the pole nearest to the unit circle last; the gain goes into
    /// the first section. SciPy's `zpk2sos` with pairing "nearest".
    pub(super) fn sections(mut self) -> Vec<Section> {
        for roots in [&mut self.zeros, &mut self.poles] {
            if roots.len() % 2 == 1 {
                roots.push(ZERO);
            }
        }
        let mut zeros = one_of_each_pair(&self.zeros);
        let mut poles = one_of_each_pair(&self.poles);
        let mut sections = Vec::new();
        while let Some(pole) = take_least(&mut poles, from_circle, |_| true) {
            let other_pole = partner(pole, &mut poles, from_circle);
            let from_pole = |zero: Complex64| (zero - pole).norm();
            let zero = take_least(&mut zeros, from_pole, |_| true).unwrap_or(ZERO);
            let other_zero = partner(zero, &mut zeros, from_pole);
            let ([b1, b2], a) = (monic(zero, other_zero), monic(pole, other_pole));
            sections.push(Section { b: [1.0, b1, b2], a });
        }
        sections.reverse();
        if let Some(first) = sections.first_mut() {
            first.b = first.b.map(|b| b * self.gain);
        }
        sections
    }

    fn mapped(self, gain: f64, map: impl Fn(Complex64) -> Complex64) -> Roots {
        let mapped = |roots: Vec<Complex64>| roots.into_iter().map(&map).collect();
        Roots { zeros: mapped(self.zeros), poles: mapped(self.poles), gain }
    }

    /// Splits each root into two, around ± `centre`.
    fn split_about(self, centre: f64) -> Roots {
        let split = |roots: Vec<Complex64>| -> Vec<Complex64> {
            let away = |root: Complex64| (root * root - centre * centre).sqrt();
            let above = roots.iter().map(|&root| root + away(root));
            above.chain(roots.iter().map(|&root| root - away(root))).collect()
        };
        Roots { zeros: split(self.zeros), poles: split(self.poles), gain: self.gain }
    }

    fn inverted_gain(&self) -> f64 {
        let product =
            |roots: &[Complex64]| -> Complex64 { roots.iter().map(|root| -root).product() };
        self.gain * (product(&self.zeros) / product(&self.poles)).re
    }

    /// The excess of poles over zeros.
    fn degree(&self) -> i32 {
        self.poles.len() as i32 - self.zeros.len() as i32
    }
}

/// The upper root of each conjugate pair, then the real ones; each in order of size.
fn one_of_each_pair(roots: &[Complex64]) -> Vec<Complex64> {
    let is_real = |root: &Complex64| root.im.abs() <= REAL_WITHIN * root.norm();
    let mut above: Vec<Complex64> =
        roots.iter().copied().filter(|root| !is_real(root) && root.im > 0.0).collect();
    let mut real: Vec<Complex64> =
        roots.iter().filter(|root| is_real(root)).map(|root| root.re.into()).collect();
    let by_size = |one: &Complex64, other: &Complex64| {
        one.re.total_cmp(&other.re).then(one.im.total_cmp(&other.im))
    };
    above.sort_by(by_size);
    real.sort_by(by_size);
    above.append(&mut real);
    above
}

/// The conjugate of a complex root; for a real one, the next real one.
fn partner(
    root: Complex64,
    others: &mut Vec<Complex64>,
    distance: impl Fn(Complex64) -> f64,
) -> Complex64 {
    if root.im != 0.0 {
        return root.conj();
    }
    take_least(others, distance, |other| other.im == 0.0).unwrap_or(ZERO)
}

fn take_least(
    roots: &mut Vec<Complex64>,
    distance: impl Fn(Complex64) -> f64,
    may: impl Fn(Complex64) -> bool,
) -> Option<Complex64> {
    let candidates = roots.iter().enumerate().filter(|(_, root)| may(**root));
    let near =
        candidates.min_by(|(_, one), (_, other)| distance(**one).total_cmp(&distance(**other)));
    let index = near?.0;
    Some(roots.remove(index))
}

fn from_circle(root: Complex64) -> f64 {
    (1.0 - root.norm()).abs()
}

/// The coefficients of (1 − r z⁻¹)(1 − s z⁻¹) after the leading 1.
fn monic(r: Complex64, s: Complex64) -> [f64; 2] {
    [-(r + s).re, (r * s).re]
}
