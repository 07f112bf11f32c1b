use std::fmt;

use super::autoregressive::burg;
use super::measure::Measure;
use crate::cubic::{CubicSpline, Ends};
use crate::error::SignalError;
use crate::spectrum::{LombScargle, Mean, Normalisation, Rule, Spectrum, Transforms, Welch};

/// Very low, low and high frequency [Hz], each without its upper limit. Task Force (1996).
const BANDS_HZ: [(f64, f64); 3] = [(0.0033, 0.04), (0.04, 0.15), (0.15, 0.4)];
/// The shortest recordings for each band [s]. The first is from Task Force (1996); ten periods of the
/// lowest frequency are desirable, the other two contain five and nine.
const LEAST_SECS: [f64; 3] = [300.0, 120.0, 60.0];
/// The upper limit of all bands [Hz].
const HIGHEST_HZ: f64 = BANDS_HZ[2].1;
/// The finest step of the Lomb–Scargle periodogram [Hz].
const LEAST_STEP_HZ: f64 = 1e-4;

/// How the spectrum of unevenly spaced intervals is computed. Print its `Display` next to the values: LF/HF
/// of the same beats differs by a factor of four between recipes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Recipe {
    /// A cubic spline through the intervals at their ends, and its Welch spectrum.
    Welch {
        /// Rate of the spline [Hz]: 4.
        rate_hz: f64,
        /// Length of a segment [s]: 128. A shorter recording is one segment.
        segment_secs: f64,
    },
    /// The same spline, and its autoregressive spectrum by Burg's method: smooth, for short series and for
    /// peaks. Boardman et al. (2002), doi:10.1088/0967-3334/23/2/308, recommend an order of at least 16.
    Autoregressive {
        /// Rate of the spline [Hz]: 4.
        rate_hz: f64,
        /// Order of the model: 16 at 4 Hz.
        order: usize,
    },
    /// The Lomb–Scargle periodogram of the uneven intervals: for series with gaps.
    LombScargle,
}

impl Default for Recipe {
    fn default() -> Recipe {
        Recipe::Welch { rate_hz: 4.0, segment_secs: 128.0 }
    }
}

impl fmt::Display for Recipe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Recipe::Welch { rate_hz, segment_secs } => write!(
                f,
                "cubic spline at {rate_hz} Hz, Welch with Hann segments of {segment_secs} s \
                 (or a single one of shorter recordings), 50 % overlap, \
                 means removed, bins summed"
            ),
            Recipe::Autoregressive { rate_hz, order } => write!(
                f,
                "cubic spline at {rate_hz} Hz, mean removed, autoregressive model of order \
                 {order} by Burg, bins summed"
            ),
            Recipe::LombScargle => {
                write!(f, "Lomb-Scargle at steps of one over the span, mean removed, bins summed")
            }
        }
    }
}

/// Frequency-domain features; NaN where the recording is too short for a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrequencyDomain {
    /// Very low frequency, 0.0033 to 0.04 Hz [ms²]; NaN below 300 s.
    pub vlf_ms2: f64,
    /// Low frequency, 0.04 to 0.15 Hz [ms²]; NaN below 120 s.
    pub lf_ms2: f64,
    /// High frequency, 0.15 to 0.4 Hz [ms²]; NaN below 60 s.
    pub hf_ms2: f64,
    /// The sum of all three [ms²]; NaN below 120 s, without VLF below 300 s.
    pub total_ms2: f64,
    /// The peak frequency of LF [Hz].
    pub lf_peak_hz: f64,
    /// The peak frequency of HF [Hz].
    pub hf_peak_hz: f64,
    /// The time from the end of the first interval to that of the last [s].
    pub span_secs: f64,
}

/// Frequency-domain features of intervals [ms] that end at `ends_secs` [s, ascending].
///
/// Powers [ms²] in the bands of the Task Force (1996), doi:10.1161/01.CIR.93.5.1043, computed as by SciPy
/// (`interpolate.CubicSpline` and `signal.welch`, or `signal.lombscargle`) or by Burg's method. Missing intervals are
/// left out; with long gaps use [`Recipe::LombScargle`]. Window: 5 minutes by convention. Returns an error with fewer
/// than four intervals. Limits: LF/HF does not measure autonomic balance; HF reflects breathing only above 9 breaths
/// per minute; the spline attenuates oscillations with periods of fewer than five beats. NeuroKit2's powers have no unit
/// by default.
///
/// ```
/// use teampulse_signal::hrv::{Recipe, frequency_domain};
/// // Breathing at 0.2 Hz: a sine with an amplitude of 30 ms, so its power is 30²/2.
/// let ends_secs: Vec<f64> = (0..400).map(|k| 0.8 * f64::from(k)).collect();
/// let wave = |time: &f64| 800.0 + 30.0 * (std::f64::consts::TAU * 0.2 * time).sin();
/// let intervals_ms: Vec<f64> = ends_secs.iter().map(wave).collect();
/// let hrv = frequency_domain(&ends_secs, &intervals_ms, &Recipe::default())?;
/// assert!((hrv.hf_ms2 / 450.0 - 1.0).abs() < 0.05 && hrv.lf_ms2 < 1.0);
/// # Ok::<(), teampulse_signal::error::SignalError>(())
/// ```
pub fn frequency_domain(
    ends_secs: &[f64],
    intervals_ms: &[f64],
    recipe: &Recipe,
) -> Result<FrequencyDomain, SignalError> {
    let kept = Transforms::default();
    let (spectrum, span_secs) = spectrum(ends_secs, intervals_ms, recipe, &kept)?;
    Ok(FrequencyDomain::of(&spectrum, span_secs))
}

/// The spectrum of intervals, and the time from the end of the first to that of the last [s]; `kept` caches
/// FFT plans.
pub(super) fn spectrum(
    ends_secs: &[f64],
    intervals_ms: &[f64],
    recipe: &Recipe,
    kept: &Transforms,
) -> Result<(Spectrum, f64), SignalError> {
    let (left, right) = (ends_secs.len(), intervals_ms.len());
    if left != right {
        return Err(SignalError::Lengths { left, right });
    }
    let points = ends_secs.iter().copied().zip(intervals_ms.iter().copied());
    let (ends_secs, intervals_ms): (Vec<f64>, Vec<f64>) =
        points.filter(|(end, interval)| end.is_finite() && interval.is_finite()).unzip();
    let [first_secs, _, _, .., last_secs] = ends_secs[..] else {
        return Err(SignalError::TooShort { count: ends_secs.len(), least: 4 });
    };
    let span_secs = last_secs - first_secs;
    let even = |rate_hz: f64| {
        CubicSpline::new(&ends_secs, &intervals_ms, Ends::NotAKnot)?.resampled(first_secs, rate_hz)
    };
    let spectrum = match *recipe {
        Recipe::Autoregressive { rate_hz, order } => {
            burg(&even(rate_hz)?, rate_hz, order, HIGHEST_HZ)?
        }
        Recipe::Welch { rate_hz, segment_secs } => {
            let even = even(rate_hz)?;
            let segment = (rate_hz * segment_secs).round().max(0.0) as usize;
            Welch::new(rate_hz, segment.min(even.len())).of_next(&even, kept)?
        }
        Recipe::LombScargle => periodogram(&ends_secs, &intervals_ms, span_secs)?,
    };
    Ok((spectrum, span_secs))
}

fn periodogram(
    ends_secs: &[f64],
    intervals_ms: &[f64],
    span_secs: f64,
) -> Result<Spectrum, SignalError> {
    let step_hz = (1.0 / span_secs).max(LEAST_STEP_HZ);
    let highest = (HIGHEST_HZ / step_hz).min(HIGHEST_HZ / LEAST_STEP_HZ) as usize;
    let frequencies_hz: Vec<f64> = (1..=highest.max(2)).map(|k| k as f64 * step_hz).collect();
    LombScargle { mean: Mean::Subtracted, normalisation: Normalisation::Density }.of(
        ends_secs,
        intervals_ms,
        &frequencies_hz,
    )
}

impl FrequencyDomain {
    /// Features from a spectrum of intervals over `span_secs` [s].
    pub(super) fn of(spectrum: &Spectrum, span_secs: f64) -> FrequencyDomain {
        let long_enough = |band: usize| span_secs >= LEAST_SECS[band];
        let power = |band: usize| {
            let (low_hz, high_hz) = BANDS_HZ[band];
            let power = spectrum.band_power(low_hz, high_hz, Rule::Sum);
            power.filter(|_| long_enough(band)).unwrap_or(f64::NAN)
        };
        let peak_hz = |band: usize| {
            let (low_hz, high_hz) = BANDS_HZ[band];
            let peak = spectrum.peak(low_hz, high_hz).filter(|_| long_enough(band));
            peak.map_or(f64::NAN, |peak| peak.frequency_hz)
        };
        let [vlf_ms2, lf_ms2, hf_ms2] = [power(0), power(1), power(2)];
        let slow_ms2 = if vlf_ms2.is_nan() { 0.0 } else { vlf_ms2 };
        FrequencyDomain {
            vlf_ms2,
            lf_ms2,
            hf_ms2,
            total_ms2: slow_ms2 + lf_ms2 + hf_ms2,
            lf_peak_hz: peak_hz(1),
            hf_peak_hz: peak_hz(2),
            span_secs,
        }
    }

    /// LF over HF.
    pub fn lf_hf(&self) -> f64 {
        self.lf_ms2 / self.hf_ms2
    }

    /// The features by name. `HRV_LFn` and `HRV_HFn` are shares of the total power, as in NeuroKit2;
    /// `HRV_LFnu` and `HRV_HFnu` are the Task Force's normalised units, shares of LF + HF.
    pub fn measures(&self) -> Vec<Measure> {
        let both_ms2 = self.lf_ms2 + self.hf_ms2;
        Measure::all([
            ("HRV_VLF", "ms^2", self.vlf_ms2),
            ("HRV_LF", "ms^2", self.lf_ms2),
            ("HRV_HF", "ms^2", self.hf_ms2),
            ("HRV_TP", "ms^2", self.total_ms2),
            ("HRV_LFHF", "1", self.lf_hf()),
            ("HRV_LFn", "1", self.lf_ms2 / self.total_ms2),
            ("HRV_HFn", "1", self.hf_ms2 / self.total_ms2),
            ("HRV_LFnu", "1", self.lf_ms2 / both_ms2),
            ("HRV_HFnu", "1", self.hf_ms2 / both_ms2),
            ("HRV_LnHF", "ln(ms^2)", self.hf_ms2.ln()),
            ("HRV_LF_peak", "Hz", self.lf_peak_hz),
            ("HRV_HF_peak", "Hz", self.hf_peak_hz),
        ])
    }
}
