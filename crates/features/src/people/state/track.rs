//! One measure in one stream of windows.

use std::collections::VecDeque;

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::stream::{Stream, StreamId};
use teampulse_core::time::Time;

use super::baseline::Held;
use super::measures::MEASURES;

/// The most windows of a baseline that are held: those of an hour.
const MOST_HELD: usize = 3600;
/// The number of newest values that are held, for slightly later requests.
const MOST_VALUES: usize = 8;

/// One measure in one stream of windows, or of phases.
pub(super) struct Track {
    /// The index of the measure in the table.
    pub(super) measure: usize,
    /// The rank of the stream's family for the measure, 0 for the best.
    pub(super) rank: usize,
    /// The stream.
    pub(super) id: StreamId,
    /// The name of the stream.
    pub(super) stream: String,
    /// The name of the stream without its window: the same for windows and phases of one family on one input.
    pub(super) family: String,
    channel: usize,
    values: VecDeque<WindowValue>,
    held: Vec<Held>,
}

/// The value of one window.
#[derive(Clone, Copy, Debug)]
pub(super) struct WindowValue {
    /// When the window ended.
    pub(super) end: Time,
    /// The measure, in its unit.
    pub(super) value: Result<f64, Reason>,
    /// The quality of the data [0..1].
    pub(super) quality: f32,
}

/// The start and end of a phase; an unknown end is later than all times.
pub(super) type Span = (Time, Option<Time>);

impl Track {
    /// The tracks of a stream: one for each measure that it holds.
    pub(super) fn all(id: StreamId, stream: &Stream) -> Vec<Track> {
        let track = |measure: usize| {
            let (rank, channel) = MEASURES[measure].place_in(stream)?;
            let (values, held) = (VecDeque::new(), Vec::new());
            let family = stream.windowless_name().to_owned();
            let stream = stream.name.clone();
            Some(Track { measure, rank, id, stream, family, channel, values, held })
        };
        (0..MEASURES.len()).filter_map(track).collect()
    }

    /// Takes in a window that ended; it is held if it lies in the baseline.
    pub(super) fn take(&mut self, end: Time, window: &FeatureValues, baseline: Option<Span>) {
        let value = window.values.get(self.channel).copied().unwrap_or(f64::NAN);
        let reason = window.reasons.get(self.channel).copied().unwrap_or(Reason::Ok);
        let value = match reason {
            Reason::Ok => known((MEASURES[self.measure].read)(value)),
            reason => Err(reason),
        };
        let of_window = WindowValue { end, value, quality: window.quality };
        self.values.push_back(of_window);
        if self.values.len() > MOST_VALUES {
            self.values.pop_front();
        }
        let begin_ns = end.nanos().saturating_sub((window.window_secs * 1e9) as i64);
        let is_inside =
            |(from, to): Span| begin_ns >= from.nanos() && to.is_none_or(|to| end <= to);
        if let (Ok(value), true) = (value, baseline.is_some_and(is_inside))
            && self.held.len() < MOST_HELD
        {
            let FeatureValues { coverage, quality, .. } = *window;
            self.held.push(Held { end_ns: end.nanos(), value, coverage, quality });
        }
    }

    /// Starts another baseline.
    pub(super) fn begin_anew(&mut self) {
        self.held.clear();
    }

    /// The windows of the baseline until its end.
    pub(super) fn held(&mut self, end: Time) -> &[Held] {
        self.held.retain(|held| held.end_ns <= end.nanos());
        &self.held
    }

    /// Whether there are windows of the baseline.
    pub(super) fn is_held(&self) -> bool {
        !self.held.is_empty()
    }

    /// The newest value.
    pub(super) fn newest(&self) -> Option<WindowValue> {
        self.values.back().copied()
    }

    /// The value of the window that ended at this time.
    pub(super) fn value_at(&self, end: Time) -> Option<WindowValue> {
        self.values.iter().rfind(|each| each.end == end).copied()
    }
}

fn known(value: f64) -> Result<f64, Reason> {
    if value.is_finite() { Ok(value) } else { Err(Reason::Undefined) }
}
