//! The spectrum of an unevenly sampled series.

use std::f64::consts::TAU;

use super::Spectrum;
use crate::error::SignalError;
use crate::gaps::is_usable;

/// Lomb–Scargle periodogram: the power of the least-squares sinusoid at each frequency.
///
/// Equals `scipy.signal.lombscargle`, but with frequencies in Hertz. For beat intervals with gaps, without
/// resampling. Lomb (1976), doi:10.1007/BF00648343; Scargle (1982), doi:10.1086/160554; floating mean:
/// Zechmeister & Kürster (2009), doi:10.1051/0004-6361:200811296.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LombScargle {
    /// The treatment of the mean.
    pub mean: Mean,
    /// The unit of the result.
    pub normalisation: Normalisation,
}

/// The treatment of the values' mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mean {
    /// The mean is zero already: SciPy's default.
    Zero,
    /// The mean is subtracted first.
    Subtracted,
    /// A constant is fitted together with each sinusoid: astropy's default.
    Floating,
}

/// The unit of a periodogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normalisation {
    /// Amplitude² · N / 4 [unit²]: SciPy's default.
    Power,
    /// The share of the sum of squares explained by the sinusoid [0..1]: SciPy's `normalize=True`, astropy's
    /// "standard".
    Standard,
    /// [`Normalisation::Power`] times twice the mean interval of the times [unit² / Hz for times in
    /// seconds]: its integral is about the variance, comparable to [`Welch`](super::Welch).
    Density,
}

impl LombScargle {
    /// Computes the power of `values` at `times_secs`, at each of the ascending `frequencies_hz`.
    ///
    /// Points that are not usable are left out. Returns an error when fewer than three points are left, when times do
    /// not ascend, when the lengths differ, for a frequency that is not usable, and for the normalised power of
    /// constant values.
    pub fn of(
        self,
        times_secs: &[f64],
        values: &[f64],
        frequencies_hz: &[f64],
    ) -> Result<Spectrum, SignalError> {
        let points = Points::new(times_secs, values, self.mean)?;
        if let Some(&frequency_hz) = frequencies_hz.iter().find(|f| !is_usable(**f)) {
            return Err(SignalError::Frequency { frequency_hz, nyquist_hz: f64::INFINITY });
        }
        let is_floating = self.mean == Mean::Floating;
        let scale = self.normalisation.scale(&points, is_floating)?;
        let mut turning = Turning::new(&points.times_secs, frequencies_hz);
        let power = |&f: &f64| points.sums(turning.to(f)).amplitude_squared(is_floating) * scale;
        let spectrum = Spectrum {
            power: frequencies_hz.iter().map(power).collect(),
            frequencies_hz: frequencies_hz.to_vec(),
            segments: 1,
        };
        spectrum.finite()
    }
}

impl Normalisation {
    /// The factor on the squared amplitude.
    fn scale(self, points: &Points, is_floating: bool) -> Result<f64, SignalError> {
        let count = points.values.len() as f64;
        match self {
            Normalisation::Power => Ok(count / 4.0),
            Normalisation::Density => Ok(count / 2.0 * points.mean_interval_secs()),
            Normalisation::Standard => {
                let mean = if is_floating { points.mean() } else { 0.0 };
                let squares = points.values.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
                let scale = 0.5 * count / squares;
                if scale.is_finite() { Ok(scale) } else { Err(SignalError::Constant) }
            }
        }
    }
}

/// The usable points, with times from zero.
struct Points {
    times_secs: Vec<f64>,
    values: Vec<f64>,
}

impl Points {
    fn new(times_secs: &[f64], values: &[f64], mean: Mean) -> Result<Points, SignalError> {
        let (left, right) = (times_secs.len(), values.len());
        if left != right {
            return Err(SignalError::Lengths { left, right });
        }
        let usable = times_secs.iter().copied().zip(values.iter().copied());
        let usable = usable.filter(|(t, y)| is_usable(*t) && is_usable(*y));
        let (times_secs, values): (Vec<f64>, Vec<f64>) = usable.unzip();
        if values.len() < 3 {
            return Err(SignalError::TooShort { count: values.len(), least: 3 });
        }
        if let Some(before) = times_secs.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(SignalError::Order { index: before + 1 });
        }
        // The power does not depend on the time origin, but its rounding does.
        let begin = times_secs[0];
        let mut points =
            Points { times_secs: times_secs.iter().map(|t| t - begin).collect(), values };
        if mean == Mean::Subtracted {
            let mean = points.mean();
            points.values.iter_mut().for_each(|value| *value -= mean);
        }
        Ok(points)
    }

    fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len() as f64
    }

    fn mean_interval_secs(&self) -> f64 {
        self.times_secs[self.times_secs.len() - 1] / (self.times_secs.len() - 1) as f64
    }

    /// The sums over sines and cosines of all times at a frequency.
    fn sums(&self, turned: &Sines) -> Sums {
        let (sin, sin_rest) = turned.sin.as_chunks();
        let (cos, cos_rest) = turned.cos.as_chunks();
        let (values, values_rest) = self.values.as_chunks();
        let mut parts = [[0.0; LANES]; 7];
        let mut add = |lane: usize, sin: f64, cos: f64, value: f64| {
            let each = [cos, sin, cos * cos, cos * sin, value, value * cos, value * sin];
            parts.iter_mut().zip(each).for_each(|(part, each)| part[lane] += each);
        };
        for ((sin, cos), values) in sin.iter().zip(cos).zip(values) {
            let (sin, cos, values): (&[f64; LANES], &[f64; LANES], &[f64; LANES]) =
                (sin, cos, values);
            (0..LANES).for_each(|lane| add(lane, sin[lane], cos[lane], values[lane]));
        }
        let rest = sin_rest.iter().zip(cos_rest).zip(values_rest).enumerate();
        rest.for_each(|(lane, ((sin, cos), value))| add(lane, *sin, *cos, *value));
        Sums::of(parts.map(|part| part.iter().sum::<f64>() / self.values.len() as f64))
    }
}

/// The number of rotations before sines are recomputed, to limit rounding.
const TURNS: usize = 32;

/// The number of points summed in parallel.
const LANES: usize = 2;

/// The sines and cosines of all times at successive frequencies. On an even grid they are rotated by a step,
/// because a sine costs as much as all sums of a point.
struct Turning<'a> {
    times_secs: &'a [f64],
    /// `None` for an uneven grid.
    step: Option<Sines>,
    now: Sines,
    turns: usize,
}

impl<'a> Turning<'a> {
    fn new(times_secs: &'a [f64], frequencies_hz: &[f64]) -> Turning<'a> {
        let step = even_step_hz(frequencies_hz).map(|step_hz| Sines::of(times_secs, step_hz));
        Turning { times_secs, step, now: Sines::default(), turns: 0 }
    }

    /// Moves to the next frequency [Hz].
    fn to(&mut self, frequency_hz: f64) -> &Sines {
        match &self.step {
            Some(step) if !self.turns.is_multiple_of(TURNS) => self.now.turn(step),
            _ => self.now = Sines::of(self.times_secs, frequency_hz),
        }
        self.turns += 1;
        &self.now
    }
}

/// The sines and cosines of each time at a frequency.
#[derive(Default)]
struct Sines {
    sin: Vec<f64>,
    cos: Vec<f64>,
}

impl Sines {
    fn of(times_secs: &[f64], frequency_hz: f64) -> Sines {
        let sines = times_secs.iter().map(|time| (TAU * frequency_hz * time).sin_cos());
        let (sin, cos) = sines.unzip();
        Sines { sin, cos }
    }

    fn turn(&mut self, step: &Sines) {
        let steps = step.sin.iter().zip(&step.cos);
        let now = self.sin.iter_mut().zip(&mut self.cos);
        for ((sin, cos), (step_sin, step_cos)) in now.zip(steps) {
            let turned_sin = *sin * step_cos + *cos * step_sin;
            *cos = *cos * step_cos - *sin * step_sin;
            *sin = turned_sin;
        }
    }
}

/// The spacing of the frequencies [Hz]; `None` when it varies.
fn even_step_hz(frequencies_hz: &[f64]) -> Option<f64> {
    let [first_hz, .., last_hz] = frequencies_hz else { return None };
    let step_hz = (last_hz - first_hz) / (frequencies_hz.len() - 1) as f64;
    let off_hz = |(place, hz): (usize, &f64)| (hz - first_hz - step_hz * place as f64).abs();
    let most_hz = 4.0 * f64::EPSILON * first_hz.abs().max(last_hz.abs());
    frequencies_hz.iter().enumerate().all(|each| off_hz(each) <= most_hz).then_some(step_hz)
}

/// Means of products, as in equations 7 to 15 of Zechmeister & Kürster.
#[derive(Clone, Copy)]
struct Sums {
    cos: f64,
    sin: f64,
    cos_cos: f64,
    cos_sin: f64,
    value: f64,
    value_cos: f64,
    value_sin: f64,
}

impl Sums {
    fn of([cos, sin, cos_cos, cos_sin, value, value_cos, value_sin]: [f64; 7]) -> Sums {
        Sums { cos, sin, cos_cos, cos_sin, value, value_cos, value_sin }
    }

    /// Twice the mean square explained by the sinusoid.
    fn amplitude_squared(self, is_floating: bool) -> f64 {
        let (cos, sin) = if is_floating { (self.cos, self.sin) } else { (0.0, 0.0) };
        let cc = self.cos_cos - cos * cos;
        let ss = 1.0 - self.cos_cos - sin * sin;
        let cs = self.cos_sin - cos * sin;
        let yc = self.value_cos - self.value * cos;
        let ys = self.value_sin - self.value * sin;
        // Rotated by τ, the products of sine and cosine vanish.
        let (sin_tau, cos_tau) = (0.5 * (2.0 * cs).atan2(cc - ss)).sin_cos();
        let (turned_yc, turned_ys) = (yc * cos_tau + ys * sin_tau, ys * cos_tau - yc * sin_tau);
        let cross = 2.0 * cs * sin_tau * cos_tau;
        let turned_cc = cc * cos_tau * cos_tau + ss * sin_tau * sin_tau + cross;
        let turned_ss = cc * sin_tau * sin_tau + ss * cos_tau * cos_tau - cross;
        let least = f64::EPSILON / 2.0;
        2.0 * (turned_yc.powi(2) / turned_cc.max(least) + turned_ys.powi(2) / turned_ss.max(least))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::spectrum::{Rule, Welch};

    #[test]
    fn the_density_of_an_even_series_is_that_of_welch() {
        let times: Vec<f64> = (0..400).map(|k| f64::from(k) / 4.0).collect();
        let values: Vec<f64> = times.iter().map(|t| (TAU * 0.25 * t).sin() + 5.0).collect();
        let frequencies: Vec<f64> = (1..200).map(|k| f64::from(k) / 100.0).collect();
        let settings =
            LombScargle { mean: Mean::Subtracted, normalisation: Normalisation::Density };
        let lomb = settings.of(&times, &values, &frequencies).unwrap();
        let welch = Welch::new(4.0, 400).of(&values).unwrap();
        let powers = [lomb, welch].map(|each| each.band_power(0.15, 0.4, Rule::Sum).unwrap());
        assert!((powers[0] - 0.5).abs() < 1e-3 && (powers[1] - 0.5).abs() < 1e-3, "{powers:?}");
    }

    #[test]
    fn even_frequencies_give_what_each_gives_alone() {
        let times: Vec<f64> = (0..300).map(|k| f64::from(k) + f64::from(k * k % 7) / 9.0).collect();
        let values: Vec<f64> = times.iter().map(|t| (TAU * 0.11 * t).sin() + 800.0).collect();
        let frequencies: Vec<f64> = (1..=120).map(|k| f64::from(k) / 300.0).collect();
        let settings =
            LombScargle { mean: Mean::Subtracted, normalisation: Normalisation::Density };
        let together = settings.of(&times, &values, &frequencies).unwrap().power;
        let largest = together.iter().copied().fold(0.0, f64::max);
        for (&frequency, power) in frequencies.iter().zip(together) {
            let alone = settings.of(&times, &values, &[frequency]).unwrap().power[0];
            assert!((power - alone).abs() < 1e-12 * largest, "{frequency} Hz: {power} {alone}");
        }
    }

    #[test]
    fn a_constant_has_no_shares() {
        let settings =
            LombScargle { mean: Mean::Subtracted, normalisation: Normalisation::Standard };
        let times = [0.0, 1.0, 2.5, 3.0];
        assert_eq!(settings.of(&times, &[7.0; 4], &[0.1]), Err(SignalError::Constant));
        let backwards = settings.of(&[0.0, 2.0, 1.0], &[1.0; 3], &[0.1]);
        assert_eq!(backwards, Err(SignalError::Order { index: 2 }));
    }

    proptest! {
        #[test]
        fn any_points_give_finite_numbers_or_an_error(
            mut times in prop::collection::vec(prop::num::f64::ANY, 0..40),
            values in prop::collection::vec(prop::num::f64::ANY, 40),
            frequencies in prop::collection::vec(-1e3..1e3, 0..5),
        ) {
            times.sort_by(f64::total_cmp);
            for mean in [Mean::Zero, Mean::Subtracted, Mean::Floating] {
                for normalisation in [Normalisation::Power, Normalisation::Standard] {
                    let settings = LombScargle { mean, normalisation };
                    let spectrum = settings.of(&times, &values[..times.len()], &frequencies);
                    if let Ok(spectrum) = spectrum {
                        prop_assert!(spectrum.power.iter().all(|power| power.is_finite()));
                    }
                }
            }
        }

        #[test]
        fn a_share_is_a_share(
            values in prop::collection::vec(-1e3..1e3, 5..40),
            frequency in 0.0..3.0f64,
        ) {
            let times: Vec<f64> = (0..values.len()).map(|k| k as f64 + (k % 3) as f64 / 5.0).collect();
            let settings = LombScargle { mean: Mean::Floating, normalisation: Normalisation::Standard };
            let share = settings.of(&times, &values, &[frequency]).unwrap().power[0];
            prop_assert!((-1e-9..=1.0 + 1e-9).contains(&share), "{share}");
        }
    }
}
