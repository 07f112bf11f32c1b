//! Troubles: pinned to the top of the screen until they are over.

use teampulse_core::status::{State, StreamStatus};
use teampulse_core::time::Time;

use super::format::for_so_long;
use super::styled_line::{Style, StyledLine};

/// A trouble that somebody should look at.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Trouble {
    /// How urgent the trouble is.
    pub urgency: Urgency,
    /// The subject of the trouble: `robot2`.
    pub subject: String,
    /// The description of the trouble.
    pub what: String,
    /// The start of the trouble, if it is shown.
    pub since: Option<Time>,
}

/// How urgent something is, the most urgent first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Urgency {
    /// A part of the session itself failed.
    Fault,
    /// A robot or a person needs someone now, as the study states.
    NeedNow,
    /// A robot or a person needs someone.
    Need,
    /// A robot or a person needs someone soon, but not at once.
    NeedSoon,
    /// A stream has been silent for a long time.
    Dead,
    /// A stream was never seen.
    Never,
    /// A stream is overdue.
    Stale,
    /// A stream arrives, but not as it should.
    Degraded,
    /// An alert of the lowest tier, which is only noted.
    Note,
}

impl Urgency {
    /// The urgency of a stream's state; `None` if it is fine.
    pub fn of(state: State) -> Option<Urgency> {
        match state {
            State::Ok => None,
            State::Never => Some(Urgency::Never),
            State::Degraded => Some(Urgency::Degraded),
            State::Stale => Some(Urgency::Stale),
            State::Dead => Some(Urgency::Dead),
        }
    }

    /// A distinct sign for each urgency, with a colour that repeats it.
    fn sign(self) -> (&'static str, Style) {
        match self {
            Urgency::Fault => ("■", Style::Alarm),
            Urgency::NeedNow | Urgency::Need => ("▲", Style::Alarm),
            Urgency::NeedSoon => ("▲", Style::Warning),
            Urgency::Note => ("◇", Style::Plain),
            Urgency::Dead => ("☒", Style::Strong),
            Urgency::Never => ("◌", Style::Plain),
            Urgency::Stale => ("◐", Style::Warning),
            Urgency::Degraded => ("△", Style::Warning),
        }
    }
}

impl Trouble {
    /// The trouble of streams of one subject in the same state.
    pub fn of_streams(
        subject: &str,
        urgency: Urgency,
        streams: &[(&str, &StreamStatus)],
    ) -> Trouble {
        let what = match streams {
            [(name, status)] => format!("{name}  {}", state_and_reason(status)),
            streams => {
                let names: Vec<&str> = streams.iter().map(|(name, _)| *name).collect();
                let (_, first) = streams[0];
                let same = streams.iter().all(|(_, each)| each.reason == first.reason);
                let said = if same { state_and_reason(first) } else { first.state.to_string() };
                format!("{} streams {said}: {}", streams.len(), names.join(", "))
            }
        };
        Trouble { urgency, subject: subject.to_owned(), what, since: None }
    }

    /// The line of the trouble, with the subject padded to a width.
    pub fn line(&self, subject_columns: usize, now: Time) -> StyledLine {
        let (sign, style) = self.urgency.sign();
        let line = StyledLine::of(style, sign).with(Style::Plain, " ");
        let line = line.with(Style::Strong, &format!("{:<subject_columns$}  ", self.subject));
        let line = line.with(Style::Plain, &self.what);
        let Some(since) = self.since else { return line };
        let waits = for_so_long(now.secs_since(since));
        let words = match self.urgency {
            Urgency::NeedNow => "  has needed someone now for ",
            Urgency::NeedSoon => "  has needed someone soon for ",
            Urgency::Note => "  has been worth a look for ",
            _ => "  has needed someone for ",
        };
        line.with(Style::Plain, words).with(Style::Strong, &waits)
    }
}

/// The state of a stream with its reason; a silence is fully described by its duration.
fn state_and_reason(status: &StreamStatus) -> String {
    let StreamStatus { state, reason, age_secs, .. } = status;
    match state {
        State::Dead | State::Stale if age_secs.is_finite() => {
            format!("{state}, silent {}", for_so_long(*age_secs))
        }
        State::Never => state.to_string(),
        _ if reason.is_empty() => state.to_string(),
        _ => format!("{state}, {reason}"),
    }
}
