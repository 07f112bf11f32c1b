//! Results for windows of a synthetic signal, with their truth.

use teampulse_signal::analysis::{Causal, Event, Recording, Span, Windows};
use teampulse_signal::error::SignalError;
use teampulse_signal::{ecg, ppg};

use super::Unkind;
use super::heart::SECS;

/// The length of a window, and its distance from the next [s].
const WINDOW_SECS: f64 = 30.0;
const HOP_SECS: f64 = 10.0;
/// The relative error above which a rate is wrong.
const TOLERANCE: f64 = 0.1;

/// How a signal is analysed.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum How {
    Whole,
    Causal,
}

/// The result for one window, with its truth.
pub struct Window {
    /// Whether a rate was reported, rather than a reason for its absence.
    pub has_value: bool,
    pub quality: f64,
    /// Whether the reported rate, or else the rate of the beats, is within 10 %.
    pub is_right: bool,
    pub rate_per_min: f64,
    pub true_per_min: f64,
    pub begin_secs: f64,
}

/// Returns the windows of a signal, and the times of the beats found [s].
pub fn windows(made: &Unkind, how: How) -> Result<(Vec<Window>, Vec<f64>), SignalError> {
    let channels = [made.signal.clone()];
    let recording = Recording { rate_hz: made.rate_hz, begin_ns: 0, channels: &channels };
    let (events, analysed): (Vec<Event>, Box<dyn Windows>) = match how {
        How::Whole => {
            let whole = whole(made.is_ppg, &recording)?;
            (whole.events, whole.windows)
        }
        How::Causal => {
            let mut causal = causal(made)?;
            let mut events = Vec::new();
            for (place, &sample) in made.signal.iter().enumerate() {
                causal.push(recording.time_ns(place as f64), &[sample]);
                events.extend(std::iter::from_fn(|| causal.next_event()));
            }
            (events, Box::new(Asked(causal)))
        }
    };
    let found_secs: Vec<f64> = events.iter().map(|event| event.at_ns as f64 / 1e9).collect();
    let name = if made.is_ppg { "PPG_Rate_Mean" } else { "ECG_Rate_Mean" };
    let place = analysed.values().iter().position(|value| value.name == name).unwrap_or(0);
    let begins = (0..).map(|k| f64::from(k) * HOP_SECS).take_while(|b| b + WINDOW_SECS <= SECS);
    let window = |begin_secs: f64| {
        let ns = |secs: f64| (secs * 1e9) as i64;
        let end_secs = begin_secs + WINDOW_SECS;
        let span = Span { begin_ns: ns(begin_secs), end_ns: ns(end_secs) };
        let measured = analysed.measure(span);
        let value = measured.values[place].ok();
        let true_per_min = rate_per_min(&made.beats_secs, begin_secs, end_secs);
        let rate = value.unwrap_or_else(|| rate_per_min(&found_secs, begin_secs, end_secs));
        Window {
            has_value: value.is_some(),
            quality: measured.quality,
            is_right: (rate - true_per_min).abs() <= TOLERANCE * true_per_min && rate > 0.0,
            rate_per_min: rate,
            true_per_min,
            begin_secs,
        }
    };
    Ok((begins.map(window).collect(), found_secs))
}

/// Returns the rate of the beats in a window; 0 with fewer than two.
pub fn rate_per_min(beats_secs: &[f64], begin_secs: f64, end_secs: f64) -> f64 {
    let inside = beats_secs.iter().filter(|at| (begin_secs..end_secs).contains(*at));
    let inside: Vec<f64> = inside.copied().collect();
    match inside[..] {
        [first, .., last] if last > first => 60.0 * (inside.len() - 1) as f64 / (last - first),
        _ => 0.0,
    }
}

fn whole(
    is_ppg: bool,
    recording: &Recording<'_>,
) -> Result<teampulse_signal::analysis::Whole, SignalError> {
    if is_ppg {
        let settings = ppg::analysis::Settings { domains: vec![], ..Default::default() };
        ppg::analysis::whole(&settings, recording)
    } else {
        let settings = ecg::analysis::Settings { domains: vec![], ..Default::default() };
        ecg::analysis::whole(&settings, recording)
    }
}

fn causal(made: &Unkind) -> Result<Box<dyn Causal + Send>, SignalError> {
    if made.is_ppg {
        let settings = ppg::analysis::Settings { domains: vec![], ..Default::default() };
        ppg::analysis::causal(&settings, made.rate_hz)
    } else {
        let settings = ecg::analysis::Settings { domains: vec![], ..Default::default() };
        ecg::analysis::causal(&settings, made.rate_hz)
    }
}

/// A causal analysis that is only queried for windows.
struct Asked(Box<dyn Causal + Send>);

impl Windows for Asked {
    fn values(&self) -> &[teampulse_signal::analysis::Value] {
        self.0.values()
    }

    fn measure(&self, span: Span) -> teampulse_signal::analysis::Measured {
        self.0.measure(span)
    }
}
