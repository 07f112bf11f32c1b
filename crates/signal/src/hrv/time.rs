use super::measure::Measure;
use super::series::{differences, present};
use crate::moments::{mean, sample_sd};
use crate::robust::{mad, median, quantile_of_sorted};

/// Standard deviation over median absolute deviation, rounded as in R and NeuroKit2.
const MAD_SCALE: f64 = 1.4826;

/// Time-domain features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeDomain {
    /// The number of intervals.
    pub n: usize,
    /// Mean interval [ms].
    pub mean_nn_ms: f64,
    /// Median interval [ms].
    pub median_nn_ms: f64,
    /// Standard deviation of intervals (n − 1) [ms].
    pub sdnn_ms: f64,
    /// Root mean square of successive differences [ms].
    pub rmssd_ms: f64,
    /// Standard deviation of successive differences (n − 1) [ms].
    pub sdsd_ms: f64,
    /// The number of successive differences over 50 ms.
    pub nn50: usize,
    /// The share of differences over 50 ms [%]. NeuroKit2 divides by the number of intervals, which is one more.
    pub pnn50_percent: f64,
    /// Share of successive differences over 20 ms [%].
    pub pnn20_percent: f64,
    /// SDNN over mean interval.
    pub cvnn: f64,
    /// RMSSD over mean interval.
    pub cvsd: f64,
    /// SDNN over RMSSD.
    pub sd_rmssd: f64,
    /// Median absolute deviation times 1.4826 [ms].
    pub mad_nn_ms: f64,
    /// `mad_nn_ms` over the median interval.
    pub mcv_nn: f64,
    /// Interquartile range [ms].
    pub iqr_nn_ms: f64,
    /// 20th percentile [ms].
    pub prc20_nn_ms: f64,
    /// 80th percentile [ms].
    pub prc80_nn_ms: f64,
    /// Shortest interval [ms].
    pub min_nn_ms: f64,
    /// Longest interval [ms].
    pub max_nn_ms: f64,
    /// Mean of the momentary heart rates, 60 000 over each interval [bpm].
    pub mean_hr_bpm: f64,
    /// Standard deviation of the momentary heart rates (n − 1) [bpm].
    pub std_hr_bpm: f64,
    /// Heart rate of the mean interval [bpm], lower than the mean rate: beats over time.
    pub hr_of_mean_nn_bpm: f64,
}

/// Time-domain features of intervals [ms].
///
/// Task Force (1996), doi:10.1161/01.CIR.93.5.1043. Window: 5 minutes by convention, at least 60 s for
/// RMSSD; SDNN grows with the window. `None` without a finite positive interval; individual features are
/// NaN if they need more intervals. Limits: one missed beat can double SDNN and RMSSD.
///
/// ```
/// use teampulse_signal::hrv::time_domain;
/// let hrv = time_domain(&[800.0, 860.0, 820.0, f64::NAN, 900.0]).expect("there are intervals");
/// assert_eq!(hrv.nn50, 1);
/// assert_eq!(hrv.rmssd_ms, 2600f64.sqrt());
/// ```
pub fn time_domain(intervals_ms: &[f64]) -> Option<TimeDomain> {
    let positive = |&each: &f64| if each > 0.0 { each } else { f64::NAN };
    let intervals_ms: Vec<f64> = intervals_ms.iter().map(positive).collect();
    let (mut nn, steps) = (present(&intervals_ms), differences(&intervals_ms));
    nn.sort_unstable_by(f64::total_cmp);
    let (median_nn_ms, mad_nn_ms) = (median(&nn)?, MAD_SCALE * mad(&nn)?);
    let rates: Vec<f64> = nn.iter().map(|each| 60_000.0 / each).collect();
    let squares: Vec<f64> = steps.iter().map(|each| each * each).collect();
    let over = |limit: f64| steps.iter().filter(|each| each.abs() > limit).count();
    let percent = |count: usize| 100.0 * count as f64 / steps.len() as f64;
    let (mean_nn_ms, sdnn_ms, rmssd_ms) = (mean(&nn), sample_sd(&nn), mean(&squares).sqrt());
    Some(TimeDomain {
        n: nn.len(),
        mean_nn_ms,
        median_nn_ms,
        sdnn_ms,
        rmssd_ms,
        sdsd_ms: sample_sd(&steps),
        nn50: over(50.0),
        pnn50_percent: percent(over(50.0)),
        pnn20_percent: percent(over(20.0)),
        cvnn: sdnn_ms / mean_nn_ms,
        cvsd: rmssd_ms / mean_nn_ms,
        sd_rmssd: sdnn_ms / rmssd_ms,
        mad_nn_ms,
        mcv_nn: mad_nn_ms / median_nn_ms,
        iqr_nn_ms: quantile_of_sorted(&nn, 0.75) - quantile_of_sorted(&nn, 0.25),
        prc20_nn_ms: quantile_of_sorted(&nn, 0.2),
        prc80_nn_ms: quantile_of_sorted(&nn, 0.8),
        min_nn_ms: quantile_of_sorted(&nn, 0.0),
        max_nn_ms: quantile_of_sorted(&nn, 1.0),
        mean_hr_bpm: mean(&rates),
        std_hr_bpm: sample_sd(&rates),
        hr_of_mean_nn_bpm: 60_000.0 / mean_nn_ms,
    })
}

impl TimeDomain {
    /// The features by name.
    pub fn measures(&self) -> Vec<Measure> {
        Measure::all([
            ("HRV_MeanNN", "ms", self.mean_nn_ms),
            ("HRV_MedianNN", "ms", self.median_nn_ms),
            ("HRV_SDNN", "ms", self.sdnn_ms),
            ("HRV_RMSSD", "ms", self.rmssd_ms),
            ("HRV_SDSD", "ms", self.sdsd_ms),
            ("HRV_NN50", "1", self.nn50 as f64),
            ("HRV_pNN50", "%", self.pnn50_percent),
            ("HRV_pNN20", "%", self.pnn20_percent),
            ("HRV_CVNN", "1", self.cvnn),
            ("HRV_CVSD", "1", self.cvsd),
            ("HRV_SDRMSSD", "1", self.sd_rmssd),
            ("HRV_MadNN", "ms", self.mad_nn_ms),
            ("HRV_MCVNN", "1", self.mcv_nn),
            ("HRV_IQRNN", "ms", self.iqr_nn_ms),
            ("HRV_Prc20NN", "ms", self.prc20_nn_ms),
            ("HRV_Prc80NN", "ms", self.prc80_nn_ms),
            ("HRV_MinNN", "ms", self.min_nn_ms),
            ("HRV_MaxNN", "ms", self.max_nn_ms),
            ("HRV_MeanHR", "bpm", self.mean_hr_bpm),
            ("HRV_StdHR", "bpm", self.std_hr_bpm),
        ])
    }
}
