//! Calibration: the lag between two streams that recorded the same events.
//!
//! Someone taps a sensor next to a button, or switches a light in front of a camera, a few times. Each
//! stream is reduced to its onsets (the moments at which it leaves its quiet level); their
//! cross-correlation shows which onsets match, and each pair gives a lag.
//!
//! **Meaning of the lag.** It is how much later stream B shows the event than stream A, by their corrected
//! times. If A's times are right, the latency of B's device is its present value plus the lag, with the
//! uncertainty stated here.

mod onset;
mod correlate;
mod error;

pub use error::{CalibrationError, Which};

use correlate::{Peaks, correlate, pairs};
use onset::Onset;

/// The longest lag that can be searched [s].
pub const LONGEST_LAG_SECS: f64 = 60.0;

/// The correlation of the second best lag, relative to the best one, above which the result is ambiguous.
const AMBIGUOUS_SHARE: f64 = 0.75;

/// The data of a stream.
#[derive(Clone, Copy, Debug)]
pub enum Seen<'a> {
    /// Samples of one or more channels, in any order and at any rate.
    Samples {
        /// The time of measurement of each sample [ns].
        times: &'a [i64],
        /// The values sample by sample, all channels of a sample together. A sample with a value that is
        /// not finite is ignored.
        values: &'a [f64],
    },
    /// The times of discrete events [ns].
    Events(&'a [i64]),
}

/// The lag of a stream behind its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// The lag by corrected times [s]; negative if the stream is earlier.
    pub lag_secs: f64,
    /// Half the width of the 95 % interval of the lag [s].
    ///
    /// It covers the scatter of the events' lags (Student's t), and at least half the rise time of the
    /// streams plus a quarter of their sampling periods, regardless of the number of events: it is unknown
    /// which part of its period a sensor timestamps.
    pub uncertainty_secs: f64,
    /// The number of events in both streams.
    pub events: usize,
    /// The cross-correlation of the onsets at the best lag [0..1].
    pub correlation: f64,
    /// The cross-correlation at the second best lag [0..1]; 0 if there is none.
    pub next_correlation: f64,
}

impl Calibration {
    /// Whether the result is good enough to be saved: most onsets of both streams are paired.
    pub fn is_trustworthy(&self) -> bool {
        self.correlation >= 0.4
    }
}

/// Finds how much later `stream` shows the events in `reference`, for lags of up to `max_lag_secs` [s, at
/// most [`LONGEST_LAG_SECS`]] either way.
pub fn calibrate(
    reference: Seen<'_>,
    stream: Seen<'_>,
    max_lag_secs: f64,
) -> Result<Calibration, CalibrationError> {
    let max_lag_secs = if max_lag_secs.is_nan() { 0.0 } else { max_lag_secs.abs() };
    let max_lag_secs = max_lag_secs.min(LONGEST_LAG_SECS);
    let origin = reference.first().ok_or(CalibrationError::Short(Which::Reference))?;
    let reference = reference.onsets(origin).map_err(|kind| kind.of(Which::Reference))?;
    let stream = stream.onsets(origin).map_err(|kind| kind.of(Which::Stream))?;
    let peaks = correlate(&reference, &stream, max_lag_secs);
    let Some(Peaks { lag_secs, correlation, next }) = peaks else {
        return Err(CalibrationError::Apart { max_lag_secs });
    };
    if let Some((next_lag_secs, _)) = next.filter(|next| next.1 > AMBIGUOUS_SHARE * correlation) {
        return Err(CalibrationError::Ambiguous { lag_secs, next_lag_secs });
    }
    let pairs = pairs(&reference, &stream, lag_secs);
    let lags: Vec<f64> = pairs.iter().map(|(a, b)| b.at_secs - a.at_secs).collect();
    let (lag_secs, scatter_secs) = mean(&lags);
    let resolution_secs = resolution(&pairs);
    Ok(Calibration {
        lag_secs,
        uncertainty_secs: scatter_secs.max(resolution_secs),
        events: lags.len(),
        correlation,
        next_correlation: next.map_or(0.0, |next| next.1),
    })
}

impl Seen<'_> {
    /// The time of the earliest sample or event [ns].
    fn first(&self) -> Option<i64> {
        match self {
            Seen::Samples { times, .. } | Seen::Events(times) => times.iter().min().copied(),
        }
    }

    /// The onsets in order, in seconds since `origin`.
    fn onsets(&self, origin: i64) -> Result<Vec<Onset>, onset::Missing> {
        match self {
            Seen::Samples { times, values } => onset::of_samples(times, values, origin),
            Seen::Events(times) => onset::of_events(times, origin),
        }
    }
}

/// The mean of the events' lags and half the width of its 95 % interval [s]; 0 for a single event.
fn mean(lags: &[f64]) -> (f64, f64) {
    let count = lags.len().max(1) as f64;
    let mean = lags.iter().sum::<f64>() / count;
    if lags.len() < 2 {
        return (mean, 0.0);
    }
    let squares: f64 = lags.iter().map(|lag| (lag - mean).powi(2)).sum();
    (mean, student_t(lags.len() - 1) * (squares / (count - 1.0) / count).sqrt())
}

/// The time resolution of the onsets of both streams together [s].
fn resolution(pairs: &[(Onset, Onset)]) -> f64 {
    let squares = pairs.iter().map(|(a, b)| a.half_span_secs.powi(2) + b.half_span_secs.powi(2));
    (squares.sum::<f64>() / pairs.len().max(1) as f64).sqrt()
}

/// The 97.5 % quantile of Student's t; from ten degrees of freedom on, an expansion around the normal quantile,
/// accurate to 0.1 %.
fn student_t(freedom: usize) -> f64 {
    const FIRST: [f64; 9] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262];
    const NORMAL: f64 = 1.959_964;
    let of_many = || {
        let (n, z) = (freedom as f64, NORMAL);
        z + (z.powi(3) + z) / (4.0 * n)
            + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n)
    };
    FIRST.get(freedom.saturating_sub(1)).copied().unwrap_or_else(of_many)
}

#[cfg(test)]
mod tests;
