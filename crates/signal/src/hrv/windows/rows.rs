//! The table of values: their names and requirements.

/// The requirement of a value on its span.
#[derive(Clone, Copy)]
pub(super) enum Need {
    /// Nothing: it is a count.
    Nothing,
    /// At least this many intervals.
    Intervals(usize),
    /// At least this duration [s], with intervals over most of it.
    Secs(u32),
    /// At least this duration [s] as for `Secs`, without holes too long for a spline.
    Bridged(u32),
    /// Two segments.
    Segments,
}

use Need::{Bridged, Intervals, Nothing, Secs, Segments};

/// Intervals for a standard deviation: about ten seconds. Munoz et al. (2015),
/// doi:10.1371/journal.pone.0138921, found RMSSD over 10 s close to that over minutes.
const FEW: usize = 10;
/// Intervals for shares of runs.
const SOME: usize = 50;
/// Intervals for entropies, at least 10 to the power of m = 2 (Richman & Moorman 2000,
/// doi:10.1152/ajpheart.2000.278.6.H2039), and for a histogram.
const MANY: usize = 100;

/// Intervals for entropies at three scales.
const MANY_SCALES: usize = 3 * MANY;

/// Name, unit, recipe and need of each value.
pub(super) type Row = (&'static str, &'static str, &'static str, Need);

/// In the order of [`TimeDomain`](crate::hrv::TimeDomain), [`segments`](crate::hrv::segments), the counts, and
/// the uncorrected values in addition to the corrected ones.
pub(super) const TIME: [Row; 35] = [
    ("HRV_MeanNN", "ms", "mean interval", Intervals(1)),
    ("HRV_MedianNN", "ms", "median interval", Intervals(1)),
    ("HRV_SDNN", "ms", "standard deviation of intervals, n - 1", Intervals(FEW)),
    ("HRV_RMSSD", "ms", "root mean square of successive differences", Intervals(FEW)),
    ("HRV_SDSD", "ms", "standard deviation of successive differences, n - 1", Intervals(FEW)),
    ("HRV_NN50", "1", "successive differences over 50 ms", Intervals(FEW)),
    ("HRV_pNN50", "%", "their share of the successive differences", Intervals(FEW)),
    ("HRV_pNN20", "%", "share of successive differences over 20 ms", Intervals(FEW)),
    ("HRV_CVNN", "1", "SDNN over mean interval", Intervals(FEW)),
    ("HRV_CVSD", "1", "RMSSD over mean interval", Intervals(FEW)),
    ("HRV_SDRMSSD", "1", "SDNN over RMSSD", Intervals(FEW)),
    ("HRV_MadNN", "ms", "1.4826 times the median absolute deviation of intervals", Intervals(FEW)),
    ("HRV_MCVNN", "1", "MadNN over median interval", Intervals(FEW)),
    ("HRV_IQRNN", "ms", "interquartile range of intervals", Intervals(FEW)),
    ("HRV_Prc20NN", "ms", "20th percentile of intervals", Intervals(FEW)),
    ("HRV_Prc80NN", "ms", "80th percentile of intervals", Intervals(FEW)),
    ("HRV_MinNN", "ms", "shortest interval", Intervals(1)),
    ("HRV_MaxNN", "ms", "longest interval", Intervals(1)),
    ("HRV_MeanHR", "bpm", "mean of 60000 over each interval", Intervals(1)),
    ("HRV_StdHR", "bpm", "standard deviation of 60000 over each interval, n - 1", Intervals(FEW)),
    ("HRV_SDANN1", "ms", "standard deviation of the mean intervals of segments of 60 s", Segments),
    ("HRV_SDNNI1", "ms", "mean of the standard deviations of segments of 60 s", Segments),
    ("HRV_SDANN2", "ms", "standard deviation of the mean intervals of segments of 120 s", Segments),
    ("HRV_SDNNI2", "ms", "mean of the standard deviations of segments of 120 s", Segments),
    ("HRV_SDANN5", "ms", "standard deviation of the mean intervals of segments of 300 s", Segments),
    ("HRV_SDNNI5", "ms", "mean of the standard deviations of segments of 300 s", Segments),
    ("HRV_N", "1", "intervals used", Nothing),
    ("HRV_Ectopic", "1", "beats too early or too late, moved", Nothing),
    ("HRV_Missed", "1", "missed beats added", Nothing),
    ("HRV_Extra", "1", "false beats removed", Nothing),
    ("HRV_LongShort", "1", "beats with a too long or too short interval, moved", Nothing),
    ("HRV_Corrected", "%", "the four counts above over the beats detected", Nothing),
    ("HRV_Uncorrected_MeanNN", "ms", "mean interval", Intervals(1)),
    ("HRV_Uncorrected_SDNN", "ms", "standard deviation of intervals, n - 1", Intervals(FEW)),
    ("HRV_Uncorrected_RMSSD", "ms", "root mean square of successive differences", Intervals(FEW)),
];

/// The prefix of values of uncorrected intervals.
pub(super) const UNCORRECTED: &str = "HRV_Uncorrected_";

/// In the order of [`FrequencyDomain`](crate::hrv::FrequencyDomain), and by the other recipes.
pub(super) const FREQUENCY: [Row; 18] = [
    ("HRV_VLF", "ms^2", "power from 0.0033 to 0.04 Hz", Bridged(300)),
    ("HRV_LF", "ms^2", "power from 0.04 to 0.15 Hz", Bridged(120)),
    ("HRV_HF", "ms^2", "power from 0.15 to 0.4 Hz", Bridged(60)),
    ("HRV_TP", "ms^2", "VLF + LF + HF", Bridged(300)),
    ("HRV_LFHF", "1", "LF over HF", Bridged(120)),
    ("HRV_LFn", "1", "LF over VLF + LF + HF", Bridged(300)),
    ("HRV_HFn", "1", "HF over VLF + LF + HF", Bridged(300)),
    ("HRV_LFnu", "1", "LF over LF + HF", Bridged(120)),
    ("HRV_HFnu", "1", "HF over LF + HF", Bridged(120)),
    ("HRV_LnHF", "ln(ms^2)", "natural logarithm of HF", Bridged(60)),
    ("HRV_LF_peak", "Hz", "frequency of the greatest power from 0.04 to 0.15 Hz", Bridged(120)),
    ("HRV_HF_peak", "Hz", "frequency of the greatest power from 0.15 to 0.4 Hz", Bridged(60)),
    ("HRV_LF_AR", "ms^2", "power from 0.04 to 0.15 Hz", Bridged(120)),
    ("HRV_HF_AR", "ms^2", "power from 0.15 to 0.4 Hz", Bridged(60)),
    ("HRV_LFHF_AR", "1", "LF over HF", Bridged(120)),
    ("HRV_LF_Lomb", "ms^2", "power from 0.04 to 0.15 Hz", Secs(120)),
    ("HRV_HF_Lomb", "ms^2", "power from 0.15 to 0.4 Hz", Secs(60)),
    ("HRV_LFHF_Lomb", "1", "LF over HF", Secs(120)),
];

/// In the order of [`Geometric`](crate::hrv::Geometric), [`Poincare`](crate::hrv::Poincare),
/// [`Asymmetry`](crate::hrv::Asymmetry), [`Fragmentation`](crate::hrv::Fragmentation),
/// [`Entropies`](crate::hrv::Entropies) and
/// [`DetrendedFluctuation`](crate::hrv::DetrendedFluctuation). Fluctuation at a scale needs four
/// windows of that length.
pub(super) const NONLINEAR: [Row; 29] = [
    ("HRV_HTI", "1", "intervals over those in the fullest bin of 7.8125 ms", Intervals(MANY)),
    (
        "HRV_TINN",
        "ms",
        "base of the triangle that fits the histogram in bins of 7.8125 ms best",
        Intervals(MANY),
    ),
    ("HRV_SD1", "ms", "root of half the variance of successive differences, n - 1", Intervals(FEW)),
    (
        "HRV_SD2",
        "ms",
        "root of twice the variance of intervals less SD1 squared, n - 1",
        Intervals(FEW),
    ),
    ("HRV_SD1SD2", "1", "SD1 over SD2", Intervals(FEW)),
    ("HRV_S", "ms^2", "pi SD1 SD2", Intervals(FEW)),
    ("HRV_CSI", "1", "SD2 over SD1", Intervals(FEW)),
    ("HRV_CVI", "1", "base-10 logarithm of 16 SD1 SD2", Intervals(FEW)),
    ("HRV_CSI_Modified", "ms", "4 SD2^2 over SD1", Intervals(FEW)),
    (
        "HRV_GI",
        "%",
        "share of decelerations in the distances from the line of identity",
        Intervals(SOME),
    ),
    ("HRV_SI", "%", "share of decelerations in the angles", Intervals(SOME)),
    ("HRV_AI", "%", "share of decelerations in the sector areas", Intervals(SOME)),
    ("HRV_PI", "%", "share of accelerations in all changes", Intervals(SOME)),
    ("HRV_C1d", "1", "share of decelerations in SD1 squared", Intervals(SOME)),
    ("HRV_C1a", "1", "share of accelerations in SD1 squared", Intervals(SOME)),
    ("HRV_C2d", "1", "share of decelerations in SD2 squared", Intervals(SOME)),
    ("HRV_C2a", "1", "share of accelerations in SD2 squared", Intervals(SOME)),
    ("HRV_Cd", "1", "share of decelerations in SDNN squared", Intervals(SOME)),
    ("HRV_Ca", "1", "share of accelerations in SDNN squared", Intervals(SOME)),
    ("HRV_PIP", "1", "share of intervals where the direction changes", Intervals(SOME)),
    ("HRV_IALS", "1", "one over the mean length of runs of one direction", Intervals(SOME)),
    ("HRV_PSS", "1", "share of runs shorter than 3", Intervals(SOME)),
    ("HRV_PAS", "1", "share of runs of alternation of 4 or more", Intervals(SOME)),
    ("HRV_SampEn", "1", "sample entropy, m = 2, r = 0.2 SD (n - 1)", Intervals(MANY)),
    ("HRV_ApEn", "1", "approximate entropy, m = 2, r = 0.2 SD (n - 1)", Intervals(MANY)),
    ("HRV_FuzzyEn", "1", "fuzzy entropy, m = 2, n = 1, r = 0.2 SD (n - 1)", Intervals(MANY)),
    (
        "HRV_MSEn",
        "1",
        "mean (trapezia) of sample entropies at scales up to a twelfth of the intervals",
        Intervals(MANY_SCALES),
    ),
    (
        "HRV_DFA_alpha1",
        "1",
        "detrended fluctuation analysis, scales of 4 to 16 beats, windows overlapping by half",
        Intervals(64),
    ),
    (
        "HRV_DFA_alpha2",
        "1",
        "detrended fluctuation analysis, scales of 16 to 64 beats, windows overlapping by half",
        Intervals(256),
    ),
];
