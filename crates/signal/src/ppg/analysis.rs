//! The PPG behind the common analysis interface: pulses as events; pulse rate, pulse shape, breathing, quality and
//! pulse rate variability for any span ([`HeartWindows`](crate::hrv::HeartWindows) of good pulses only, so that motion
//! is not mistaken for variability). A pulse's [time](Pulse::time) there is midway between its peak and the middle of
//! its rise; if the variability may be due to noise, only means and counts of intervals are reported.
//!
//! Quality, and which pulses are good, are judged including the minute before the span. If more than half of the span
//! is flagged, no pulse values are reported.
//!
//! A span queried right after its end lacks the pulses of the last 0.4 s or so.

use std::borrow::Cow;
use std::collections::VecDeque;

use super::causal::PulseDetector;
use super::pulse::Pulse;
use super::store::PpgWindows;
use super::whole::pulses_of;
use super::working::Grouping;
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::{SignalError, checked};
use crate::hrv::Domain;

/// Settings of the PPG analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The unit of the signal; `1` if unknown.
    pub unit: Cow<'static, str>,
    /// For a second channel with the strength of the sensor's motion (such as the magnitude of acceleration
    /// minus gravity [g]), at the same rate: cycles that exceed this limit, in that channel's unit, are
    /// motion. `None` without such a channel.
    pub motion_limit: Option<f64>,
    /// The domains of pulse rate variability to compute; all by default.
    pub domains: Vec<Domain>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { unit: Cow::Borrowed("1"), motion_limit: None, domains: Domain::ALL.to_vec() }
    }
}

/// A causal analysis of a PPG at `rate_hz`, 20 to 2000 Hz: channel 0 is the PPG, and channel 1 motion if
/// [configured](Settings::motion_limit).
///
/// Returns an error for another rate or invalid settings.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    let how = "causal, Elgendi 2013 on 0.7-8 Hz (Butterworth, 1st and 2nd order, forwards), known 0.4 s later";
    check(settings)?;
    let intake = Intake::new(rate_hz)?;
    let windows = PpgWindows::new(intake.rate_hz(), settings, how);
    let detector = PulseDetector::new(rate_hz)?;
    Ok(Box::new(CausalPpg { intake, detector, windows, events: VecDeque::new() }))
}

/// An analysis of a whole PPG at 20 to 2000 Hz, with channels as for [`causal`].
///
/// Returns an error for another rate or invalid settings. A recording without a usable sample has no pulses.
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let how = "whole recording, Elgendi 2013 on 0.5-8 Hz (Butterworth, 2nd order, zero phase)";
    check(settings)?;
    let mut intake = Intake::new(recording.rate_hz)?;
    let mut windows = PpgWindows::new(intake.rate_hz(), settings, how);
    let mut working = Vec::with_capacity(recording.len() / intake.signal.group() + 1);
    let at = |channel: usize, place: usize| {
        recording.channels.get(channel).map_or(f64::NAN, |channel| channel[place])
    };
    for place in 0..recording.len() {
        let at_ns = recording.time_ns(place as f64);
        if let Some(taken) = intake.push(at_ns, at(0, place), at(1, place)) {
            working.push(taken.value);
            windows.push(taken.at_ns, taken.value, taken.motion);
        }
    }
    let pulses = pulses_of(&working, intake.rate_hz());
    let report = |pulse: Pulse| event(&mut windows, pulse, intake.signal.group());
    let events = pulses.into_iter().map(report).collect();
    Ok(Whole { events, windows: Box::new(windows) })
}

fn check(settings: &Settings) -> Result<(), SignalError> {
    let limit = settings.motion_limit.unwrap_or(0.0);
    checked("the motion limit", limit, (0.0, 1e9)).map(|_| ())
}

struct CausalPpg {
    intake: Intake,
    detector: PulseDetector,
    windows: PpgWindows,
    events: VecDeque<Event>,
}

impl Windows for CausalPpg {
    fn values(&self) -> &[Value] {
        self.windows.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.windows.measure(span)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.windows.measure_again(span, last)
    }
}

impl Causal for CausalPpg {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let at = |channel: usize| channels.get(channel).copied().unwrap_or(f64::NAN);
        let Some(taken) = self.intake.push(at_ns, at(0), at(1)) else { return };
        self.windows.push(taken.at_ns, taken.value, taken.motion);
        if let Some(pulse) = self.detector.take(taken.value) {
            self.events.push_back(event(&mut self.windows, pulse, self.intake.signal.group()));
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.windows.forget(before_ns);
    }

    /// The second 1, so that an ECG of the same person is not analysed in the same second.
    fn turn_secs(&self) -> i64 {
        1
    }
}

/// Adds a pulse at the working rate to the windows, and returns its event.
fn event(windows: &mut PpgWindows, pulse: Pulse, group: usize) -> Event {
    let (at_ns, pp_ms) = windows.push_pulse(pulse);
    let pulse = pulse.in_groups_of(group);
    let details = vec![
        ("onset_sample", pulse.onset),
        ("amplitude", pulse.amplitude),
        ("rise_ms", pulse.rise_ms),
        ("width_ms", pulse.width_ms),
        ("pp_ms", pp_ms),
    ];
    Event { kind: "pulse", sample: pulse.sample, at_ns, details }
}

/// Converts samples to means of groups of samples.
struct Intake {
    signal: Grouping,
    motion: Grouping,
    begin_ns: Option<i64>,
}

struct Taken {
    at_ns: i64,
    value: f64,
    motion: f64,
}

impl Intake {
    fn new(rate_hz: f64) -> Result<Intake, SignalError> {
        let signal = Grouping::new(rate_hz)?;
        Ok(Intake { motion: signal.clone(), signal, begin_ns: None })
    }

    fn rate_hz(&self) -> f64 {
        self.signal.rate_hz()
    }

    fn push(&mut self, at_ns: i64, sample: f64, motion: f64) -> Option<Taken> {
        let begin_ns = *self.begin_ns.get_or_insert(at_ns);
        let (value, motion) = (self.signal.push(sample), self.motion.push(motion));
        let (value, motion) = (value?, motion?);
        self.begin_ns = None;
        Some(Taken { at_ns: begin_ns.midpoint(at_ns), value, motion })
    }
}
