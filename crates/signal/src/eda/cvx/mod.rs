//! cvxEDA: the level and the responses that explain a skin conductance with the sparsest driver.

mod factor;
mod interior;
mod model;

use interior::Interior;
use model::Model;

use super::{Split, checked_rate};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// How long a response takes to rise [s]: the faster time constant of the Bateman function.
const FAST_SECS: f64 = 0.7;
/// How long it takes to fall [s]: the slower one.
const SLOW_SECS: f64 = 2.0;
/// From one knot of the level's splines to the next [s].
const KNOT_SECS: f64 = 10.0;
/// What the sum of the driver costs.
const DRIVER_PENALTY: f64 = 8e-4;
/// What the squares of the splines' heights cost.
const LEVEL_PENALTY: f64 = 1e-2;
/// The equations are scaled by the signal's standard deviation, but by no less than this [µS].
const LEAST_SCALE_US: f64 = 1e-3;
/// Fewest samples that can be separated into both.
const LEAST_SAMPLES: usize = 16;

/// The level and the responses of a whole recording [µS] by cvxEDA.
///
/// Greco et al. (2016), doi:10.1109/TBME.2015.2474131: the responses are those of a driver that is
/// never negative, each a Bateman function with time constants of 0.7 and 2 s; the level is a cubic
/// spline with a knot each 10 s, and a line; errors are normal. The least of half the squared
/// errors, 8e-4 times the sum of the driver, and 0.005 times the squared heights of the spline:
/// constants and result are those of NeuroKit2 and of the authors. The signal is not standardised,
/// so that the penalty is in its unit. What is [not usable](crate::gaps::is_usable) is left out of
/// the fit.
///
/// Whole recordings only. Time and memory grow with the samples alone: about 3 µs and 200 bytes
/// each; thin out what is faster than about 10 Hz. An error for a rate outside of 1 to 2000 Hz, for
/// fewer than 16 samples, without a usable one, and where numbers are too far apart.
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
    // What hardly moves is not blown up: its driver is zero.
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
