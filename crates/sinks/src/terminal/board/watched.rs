//! A stream on the board: its last status, and when to show it.

use teampulse_core::status::{State, StreamStatus};

/// The number of statuses after which a stream's rate has settled, as its window is full.
const SETTLED: u32 = 3;
/// The number of statuses after which a stream is reported as never seen.
const AWAITED: u32 = 10;

/// A stream with its last status.
#[derive(Debug)]
pub(super) struct Watched {
    pub(super) status: StreamStatus,
    /// The number of statuses since the stream was first seen, and the number before that.
    statuses: u32,
    awaited: u32,
    /// The state that was shown last.
    shown: Option<State>,
}

impl Watched {
    pub(super) fn new(status: &StreamStatus) -> Watched {
        // A stream is declared a moment before its first sample.
        Watched { status: status.clone(), statuses: 0, awaited: 0, shown: None }
    }

    /// Takes the newest status; returns whether to show it.
    pub(super) fn take(&mut self, status: &StreamStatus, is_happening: bool) -> bool {
        self.status.clone_from(status);
        let is_never = status.state == State::Never;
        self.statuses = self.statuses.saturating_add(u32::from(!is_never));
        self.awaited = self.awaited.saturating_add(u32::from(is_never && !is_happening));
        let settled = match status.state {
            State::Ok => self.statuses >= SETTLED,
            State::Never => self.awaited >= AWAITED,
            _ => true,
        };
        let is_news = settled && self.shown != Some(status.state);
        if is_news {
            self.shown = Some(status.state);
        }
        is_news
    }
}

/// The line of a stream: its full name, state, rate, age and losses.
pub(super) fn full_line(status: &StreamStatus) -> String {
    let StreamStatus { name, state, rate_hz, reason, .. } = status;
    let (age, lost) = (age(status), lost(status));
    let line = format!(
        "{name:<34} {state:<10} {rate_hz:>7.1} Hz  age {age:>5} s  lost {lost:>4}  {reason}"
    );
    line.trim_end().to_owned()
}

/// The age of a stream's last sample [s].
fn age(status: &StreamStatus) -> String {
    if status.age_secs.is_nan() { "-".into() } else { format!("{:.1}", status.age_secs) }
}

/// How many samples were lost.
fn lost(status: &StreamStatus) -> String {
    let lost = status.lost_source.map(|lost| lost + status.lost_queue);
    lost.map_or("?".into(), |lost| lost.to_string())
}
