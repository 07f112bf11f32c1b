//! cvxEDA: separates tonic and phasic skin conductance with the sparsest driver.

mod factor;
mod interior;
mod model;

use interior::Interior;
use model::Model;

use super::{Split, checked_rate};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// The rise time constant of the Bateman function [s].
const FAST_SECS: f64 = 0.7;
/// The decay time constant of the Bateman function [s].
const SLOW_SECS: f64 = 2.0;
/// The distance between knots of the tonic splines [s].
const KNOT_SECS: f64 = 10.0;
/// The weight of the sum of the driver.
const DRIVER_PENALTY: f64 = 8e-4;
/// The weight of the squared spline coefficients.
const LEVEL_PENALTY: f64 = 1e-2;
/// The smallest standard deviation by which the equations are scaled [µS].
const LEAST_SCALE_US: f64 = 1e-3;
/// The fewest samples that can be separated.
const LEAST_SAMPLES: usize = 16;

/// Separates the tonic and phasic parts of a whole recording [µS] by cvxEDA.
///
/// Greco et al. (2016), doi:10.1109/TBME.2015.2474131: the phasic part is a non-negative driver convolved
/// with a Bateman function with time constants of 0.7 and 2 s; the tonic part is a cubic spline with a knot
/// every 10 s, plus a line; errors are normal. It minimises half the squared errors, plus 8e-4 times the sum
/// of the driver, plus 0.005 times the squared coefficients of the spline; constants and result are those of
/// NeuroKit2 and of the authors. The signal is not standardised, so the penalty is in its unit. Samples that
/// are [not usable](crate::gaps::is_usable) are left out of the fit.
///
/// Whole recordings only. Time and memory are linear, about 3 µs and 200 bytes a sample; decimate signals
/// faster than about 10 Hz. Returns an error for a rate outside 1 to 2000 Hz, for fewer than 16 samples,
/// without a usable one, and for values of too different magnitudes.
pub fn cvx_eda(signal: &[f64], rate_hz: f64) -> Result<Split, SignalError> {
    checked_rate(rate_hz)?;
    if signal.len() < LEAST_SAMPLES {
        return Err(SignalError::TooShort { count: signal.len(), least: LEAST_SAMPLES });
    }
    let usable: Vec<f64> = signal.iter().copied().filter(|&each| is_usable(each)).collect();
    if usable.is_empty() {
        return Err(SignalError::NothingFinite);
    }
    let count = usable.len() as f64;
    let mean = usable.iter().map(|each| each / count).sum::<f64>();
    let deviation = usable.iter().map(|each| (each - mean).powi(2) / count).sum::<f64>().sqrt();
    // A nearly constant signal is not amplified: its driver is zero.
    let deviation = deviation.max(LEAST_SCALE_US);
    let fit: Vec<f64> = signal.iter().map(|&each| f64::from(u8::from(is_usable(each)))).collect();
    let scaled = |&each: &f64| if is_usable(each) { (each - mean) / deviation } else { 0.0 };
    let normal: Vec<f64> = signal.iter().map(scaled).collect();
    let model = Model::new(signal.len(), rate_hz);
    let unknowns = Interior::new(&model, &normal, &fit, deviation).solve()?;
    let mut split = Split { tonic: vec![0.0; signal.len()], phasic: vec![0.0; signal.len()] };
    Model::responses(&unknowns.states, &mut split.phasic);
    model.levels(&unknowns, &mut split.tonic);
    split.phasic.iter_mut().for_each(|each| *each *= deviation);
    split.tonic.iter_mut().for_each(|each| *each = *each * deviation + mean);
    let is_finite = split.tonic.iter().chain(&split.phasic).all(|each| each.is_finite());
    if is_finite { Ok(split) } else { Err(SignalError::Overflow) }
}
