//! Skin conductance as events and values of windows.
//!
//! Channel 0 is the skin conductance [µS]; channel 1, if present, the skin temperature below the device
//! [°C], which is used to assess quality. Events are of kind `response`, placed at the peak, with
//! `amplitude_us`, `rise_secs`, `half_recovery_secs` and `onset_sample`.

use super::causal::CausalEda;
use super::contact::glitches;
use super::store::{Placed, Store};
use super::{
    Split, Threshold, checked_rate, clean, cvx_eda, find_responses, high_pass_split, thinned,
    values,
};
use crate::analysis::{Causal, Recording, Track, Whole};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// cvxEDA runs at this rate [Hz] or above, but below twice that.
const CVX_HZ: f64 = 4.0;
/// A response next to a gap longer than this [s] is dropped: interpolation caused it.
pub(super) const LONGEST_GAP_SECS: f64 = 1.0;

/// Settings of the skin conductance analysis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// The separation of tonic and phasic parts of a whole recording; a causal analysis always uses its own
    /// causal filter.
    pub phasic: Phasic,
    /// The amplitude threshold of a response; the causal analysis takes an absolute one only.
    pub threshold: Threshold,
}

/// The separation of tonic and phasic parts of a whole recording.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Phasic {
    /// By a [high-pass](high_pass_split) at 0.05 Hz.
    #[default]
    HighPass,
    /// By [cvxEDA](cvx_eda), at 4 to 8 Hz.
    CvxEda,
}

/// A causal analysis of skin conductance at `rate_hz` [Hz], 1 to 2000.
///
/// Samples are averaged in groups down to 32 Hz or a little more; from 7 Hz on, frequencies above 3 Hz are
/// removed (Butterworth of order 4, whose delay of 0.14 s is subtracted from the times of events). The phasic
/// part is the output of a causal Butterworth high-pass of order 2 at 0.01 Hz, the tonic part the rest: it
/// follows a steady drift without delay and a jump within 18 s, overshoots it by a fifth, and settles after
/// a minute and a half. From 4 Hz on, samples are delayed by 0.6 s to remove contact glitches; so a response
/// is reported 1.1 s after its peak, and counts in windows from then on. It loses about 5 % of its amplitude.
/// After a gap of more than a second the analysis restarts. Returns an error for a relative threshold.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(CausalEda::new(settings, rate_hz)?))
}

/// An analysis of a whole recording at 1 to 2000 Hz, with contact glitches removed.
///
/// Returns an error when it is too short (below 16 samples), has no usable sample or cannot be split.
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let signal = recording.channels.first().map_or(&[][..], |signal| &signal[..recording.len()]);
    let touched = without_glitches(signal, recording.rate_hz)?;
    let clean = clean(&touched, recording.rate_hz)?;
    let mut store = Store::new(recording.rate_hz, settings.threshold, values::of_whole(settings))?;
    store.take_recording(recording, &clean);
    let (split, every) = match settings.phasic {
        Phasic::HighPass => (high_pass_split(&clean, recording.rate_hz)?, 1),
        Phasic::CvxEda => cvx_split(&touched, recording.rate_hz)?,
    };
    let rate_hz = recording.rate_hz / every as f64;
    let responses = find_responses(&split.phasic, rate_hz, settings.threshold)?;
    let gaps = long_gaps(signal, recording.rate_hz);
    let at_ns = |sample: f64| recording.time_ns(sample);
    let placed = responses.iter().map(|response| Placed::new(response, every as f64, at_ns));
    let is_real = |placed: &Placed| {
        !gaps.iter().any(|gap| placed.touches(gap)) && !placed.is_step(&touched, recording.rate_hz)
    };
    store.responses = placed.filter(is_real).collect();
    store.tonic = Track::of(&Recording { rate_hz, ..*recording }, split.tonic);
    store.phasic = split.phasic.into();
    let events = store.responses.iter().map(Placed::event).collect();
    Ok(Whole { events, windows: Box::new(store) })
}

/// The signal without contact glitches.
fn without_glitches(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    checked_rate(rate_hz)?;
    let glitches = glitches(signal, rate_hz);
    let each = signal.iter().zip(glitches);
    Ok(each.map(|(&value, is_glitch)| if is_glitch { f64::NAN } else { value }).collect())
}

/// The cvxEDA split, and the decimation factor at which it runs.
fn cvx_split(signal: &[f64], rate_hz: f64) -> Result<(Split, usize), SignalError> {
    let mut few = thinned(signal, rate_hz, CVX_HZ)?;
    // Missing samples must stay missing, or the fit would follow the interpolation.
    for (value, raw) in few.values.iter_mut().zip(signal.chunks(few.every)) {
        if !raw.iter().any(|&each| is_usable(each)) {
            *value = f64::NAN;
        }
    }
    Ok((cvx_eda(&few.values, few.rate_hz)?, few.every))
}

/// The gaps next to which responses are not credible.
fn long_gaps(signal: &[f64], rate_hz: f64) -> Vec<std::ops::Range<f64>> {
    let longest = (LONGEST_GAP_SECS * rate_hz) as usize;
    let mut gaps = Vec::new();
    let mut begin = 0;
    for run in signal.chunk_by(|&a, &b| is_usable(a) == is_usable(b)) {
        let end = begin + run.len();
        if run.len() > longest && !is_usable(run[0]) {
            gaps.push(begin as f64 - 1.0..end as f64 + 1.0);
        }
        begin = end;
    }
    gaps
}
