//! What is known of one stream over a session.

use std::collections::BTreeMap;

use teampulse_core::status::{State, StreamStatus};

/// A status tells the rate over so many seconds; before, it is told over fewer and less surely [s].
const SETTLING_SECS: u32 = 10;

/// What is known of one stream over a session.
#[derive(Debug, Default)]
pub(super) struct Watched {
    /// Its last status.
    pub(super) last: Option<StreamStatus>,
    /// For how many seconds it came.
    came_secs: u32,
    /// Its rate in those [Hz], added up once a whole window of it was counted.
    rates_hz: f64,
    /// The seconds in which it came as it should.
    fine: Shares,
    /// The windows of which enough was worth something.
    usable: Shares,
    /// The worst that was said of it, and for how many seconds it was not fine.
    pub(super) worst: Option<(State, String)>,
    pub(super) not_fine_secs: u32,
}

/// Shares of something: in all, and within each phase.
#[derive(Debug, Default)]
pub(super) struct Shares {
    all: Share,
    phases: BTreeMap<String, Share>,
}

/// So many of so many.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    good: u32,
    of: u32,
}

impl Watched {
    pub(super) fn take_status(&mut self, status: &StreamStatus, phase: Option<&str>) {
        self.last = Some(status.clone());
        if matches!(status.state, State::Ok | State::Degraded) && status.rate_hz > 0.0 {
            self.came_secs += 1;
            if self.came_secs > SETTLING_SECS {
                self.rates_hz += status.rate_hz;
            }
        }
        self.fine.take(status.state == State::Ok, phase);
        // A stream is declared a moment before its first sample.
        if !matches!(status.state, State::Ok | State::Never) {
            self.not_fine_secs += 1;
            if self.worst.as_ref().is_none_or(|(worst, _)| *worst <= status.state) {
                self.worst = Some((status.state, status.reason.clone()));
            }
        }
    }

    pub(super) fn take_window(&mut self, is_usable: bool, phase: Option<&str>) {
        self.usable.take(is_usable, phase);
    }

    /// Its mean rate while it came [Hz].
    pub(super) fn rate_hz(&self) -> Option<f64> {
        match self.came_secs.checked_sub(SETTLING_SECS) {
            Some(counted @ 1..) => Some(self.rates_hz / f64::from(counted)),
            _ => self.last.as_ref().map(|last| last.rate_hz).filter(|rate_hz| *rate_hz > 0.0),
        }
    }

    /// Whether it is judged by the windows of a feature, and not by its state alone.
    pub(super) fn has_windows(&self) -> bool {
        self.usable.all.of > 0
    }

    /// How much of it is usable.
    pub(super) fn shares(&self) -> &Shares {
        if self.has_windows() { &self.usable } else { &self.fine }
    }
}

impl Shares {
    fn take(&mut self, is_good: bool, phase: Option<&str>) {
        self.all.take(is_good);
        if let Some(phase) = phase {
            if !self.phases.contains_key(phase) {
                self.phases.insert(phase.to_owned(), Share::default());
            }
            self.phases.get_mut(phase).into_iter().for_each(|share| share.take(is_good));
        }
    }

    /// The share of all [%]; `None` of nothing.
    pub(super) fn percent(&self) -> Option<f64> {
        self.all.percent()
    }

    /// The share within a phase [%]; `None` where nothing was told in it.
    pub(super) fn percent_in(&self, phase: &str) -> Option<f64> {
        self.phases.get(phase)?.percent()
    }
}

impl Share {
    fn take(&mut self, is_good: bool) {
        self.good += u32::from(is_good);
        self.of += 1;
    }

    fn percent(self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * f64::from(self.good) / f64::from(self.of))
    }
}
