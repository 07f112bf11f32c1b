//! The summary of one stream over a session.

use std::collections::BTreeMap;

use teampulse_core::status::{State, StreamStatus};

use super::rates::Rates;

/// The share of the session that phases must cover to represent it.
const COVERED: f64 = 0.95;
/// The maximum number of reasons kept separately for one stream.
const MOST_REASONS: usize = 16;

/// The summary of one stream over a session.
#[derive(Debug, Default)]
pub(super) struct StreamSummary {
    /// The last status of the stream.
    pub(super) last: Option<StreamStatus>,
    /// The rates in the seconds in which samples arrived.
    rates: Rates,
    /// Whether a state before the first sample has already been ignored.
    was_awaited: bool,
    /// The shares of seconds in which the stream was fine.
    fine: Shares,
    /// The share of seconds in which samples arrived, however many.
    arriving: Share,
    /// The usable shares of windows; for a phase, of the windows within it.
    windows: Shares,
    /// The usable shares of whole phases, weighted by length.
    phases: Shares,
    /// The shares of whole phases with data, of whatever quality.
    covered: Shares,
    /// The number of seconds in which the stream was not fine.
    pub(super) not_fine_secs: u32,
    /// The complaints of those seconds, by state and by text without its numbers.
    complaints: BTreeMap<(State, String), Complaint>,
}

/// A complaint about a stream.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Complaint {
    pub(super) state: State,
    /// The text in the last second of the complaint.
    pub(super) reason: String,
    /// The duration of the complaint [s].
    pub(super) secs: u32,
}

/// Mean shares in all, and within each phase.
#[derive(Debug, Default)]
pub(super) struct Shares {
    all: Share,
    phases: BTreeMap<String, Share>,
}

/// A weighted mean of shares.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    worth: f64,
    of: f64,
}

/// The usable share of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Usable {
    /// The share [0..1].
    pub(super) share: f64,
    /// Whether the stream is judged by its state alone, for lack of features.
    pub(super) is_by_state: bool,
}

impl StreamSummary {
    pub(super) fn take_status(&mut self, status: &StreamStatus) {
        self.last = Some(status.clone());
        if matches!(status.state, State::Ok | State::Degraded) && status.rate_hz > 0.0 {
            self.rates.take(status.rate_hz);
        }
        // A stream is declared a moment before its first sample.
        if !matches!(status.state, State::Ok | State::Never) {
            self.not_fine_secs += 1;
            self.complain(status);
        }
    }

    /// Takes the stream's state in one second, with the current phase if there is one; only for streams whose silence
    /// would be a fault.
    pub(super) fn take_state(&mut self, state: State, phase: Option<&str>) {
        // A stream is declared a moment before its first sample.
        if state == State::Never && !std::mem::replace(&mut self.was_awaited, true) {
            return;
        }
        let is_fine = f64::from(u8::from(state == State::Ok));
        self.fine.take(is_fine, 1.0, phase);
        let is_arriving = matches!(state, State::Ok | State::Degraded);
        self.arriving.take(f64::from(u8::from(is_arriving)), 1.0);
    }

    fn complain(&mut self, status: &StreamStatus) {
        let key = (status.state, status.reason.replace(|each: char| each.is_ascii_digit(), ""));
        if self.complaints.len() == MOST_REASONS && !self.complaints.contains_key(&key) {
            return;
        }
        let (state, reason) = (status.state, status.reason.clone());
        let of_key = self.complaints.entry(key);
        let complaint = of_key.or_insert(Complaint { state, reason: String::new(), secs: 0 });
        (complaint.reason, complaint.secs) = (reason, complaint.secs + 1);
    }

    /// The complaints, the longest first.
    pub(super) fn complaints(&self) -> Vec<&Complaint> {
        let mut complaints: Vec<&Complaint> = self.complaints.values().collect();
        complaints.sort_by_key(|complaint| std::cmp::Reverse(complaint.secs));
        complaints
    }

    /// Takes the usable share of a window [0..1], with the phase that contains it if there is one.
    pub(super) fn take_window(&mut self, worth: f64, phase: Option<&str>) {
        self.windows.take(worth, 1.0, phase);
    }

    /// Takes the usable share of a whole phase, with its length.
    pub(super) fn take_phase(&mut self, worth: f64, length_secs: f64, phase: &str) {
        self.phases.take(worth, length_secs, Some(phase));
    }

    /// Takes the share of a whole phase with data, with its length.
    pub(super) fn take_coverage(&mut self, coverage: f64, length_secs: f64, phase: &str) {
        self.covered.take(coverage, length_secs, Some(phase));
    }

    /// The usual rate of the stream while samples arrived [Hz].
    pub(super) fn rate_hz(&self) -> Option<f64> {
        self.rates.usual_hz()
    }

    /// The usable share of the session: from whole phases if they cover the session, otherwise from windows. In a long
    /// silence no windows are reported, so it is at most the share of time in which samples arrived.
    pub(super) fn usable(&self) -> Option<Usable> {
        let is_covered = self.phases.all.of >= COVERED * self.fine.all.of;
        let arriving = self.arriving.mean().unwrap_or(1.0);
        let windows = self.windows.mean().map(|share| share.min(arriving));
        let phases = self.phases.mean();
        let computed = if is_covered { phases.or(windows) } else { windows.or(phases) };
        Usable::computed(computed, self.fine.mean())
    }

    /// The usable share of a phase: from the phase as a whole, otherwise from the windows in it; `None` without values
    /// in it. Windows do not show data that is missing at an end of the phase, so it is at most the share with data.
    pub(super) fn usable_in(&self, phase: &str) -> Option<Usable> {
        let covered = self.covered.mean_in(phase).unwrap_or(1.0);
        let windows = self.windows.mean_in(phase).map(|share| share.min(covered));
        let computed = self.phases.mean_in(phase).or(windows);
        Usable::computed(computed, self.fine.mean_in(phase))
    }
}

impl Usable {
    /// The computed share, or else the share by the stream's state.
    fn computed(computed: Option<f64>, by_state: Option<f64>) -> Option<Usable> {
        let computed = computed.map(|share| Usable { share, is_by_state: false });
        computed.or_else(|| Some(Usable { share: by_state?, is_by_state: true }))
    }
}

impl Shares {
    fn take(&mut self, worth: f64, weight: f64, phase: Option<&str>) {
        self.all.take(worth, weight);
        if let Some(phase) = phase {
            if !self.phases.contains_key(phase) {
                self.phases.insert(phase.to_owned(), Share::default());
            }
            self.phases.get_mut(phase).into_iter().for_each(|share| share.take(worth, weight));
        }
    }

    fn mean(&self) -> Option<f64> {
        self.all.mean()
    }

    fn mean_in(&self, phase: &str) -> Option<f64> {
        self.phases.get(phase)?.mean()
    }
}

impl Share {
    /// A share that is not a number counts as 0.
    fn take(&mut self, worth: f64, weight: f64) {
        self.worth += weight * if worth.is_finite() { worth.clamp(0.0, 1.0) } else { 0.0 };
        self.of += weight;
    }

    fn mean(self) -> Option<f64> {
        (self.of > 0.0).then(|| self.worth / self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Summarises a minute with a silence from 30 to 40 s, in which no windows are reported.
    fn silent_for_a_while() -> StreamSummary {
        let mut summary = StreamSummary::default();
        for end in 1..=60 {
            let state = if (32..=40).contains(&end) { State::Stale } else { State::Ok };
            summary.take_state(state, Some("task"));
            if !(31..=44).contains(&end) {
                summary.take_window(1.0, Some("task"));
            }
        }
        summary
    }

    #[test]
    fn a_silence_without_windows_is_not_usable() {
        let share = silent_for_a_while().usable().map_or(0.0, |usable| usable.share);
        assert!((share - 51.0 / 60.0).abs() < 1e-9, "{share}");
    }

    #[test]
    fn no_more_of_a_phase_is_usable_than_has_data() {
        let mut summary = silent_for_a_while();
        let share = |summary: &StreamSummary| summary.usable_in("task").map_or(0.0, |it| it.share);
        assert!(share(&summary) > 0.95);
        summary.take_coverage(0.83, 60.0, "task");
        assert!((share(&summary) - 0.83).abs() < 1e-9);
    }
}
