//! Imported signals as a source: in the order of their times on the session's clock.

use std::sync::Arc;

use async_trait::async_trait;
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::Stream;
use teampulse_core::time::Time;
use teampulse_formats::{Content, Run};

use super::imported::Imported;

/// Samples within this time are sent together [s]: the stamp of the first is within one second of its arrival, and so
/// is trusted.
const PIECE_SECS: f64 = 0.9;

/// Converts a device's time [ns] to the session's.
pub type SessionFromDevice = Box<dyn Fn(i64) -> i64 + Send + Sync>;

/// Signals placed on the session's clock.
pub struct Placed {
    streams: Vec<Stream>,
    /// Pieces of the signals, in the order of their last samples.
    pieces: Vec<Piece>,
}

/// Samples that are sent together.
struct Piece {
    stream: usize,
    first_ns: i64,
    last_ns: i64,
    data: Data,
}

impl Placed {
    /// Starts without signals.
    pub fn new() -> Placed {
        Placed { streams: Vec::new(), pieces: Vec::new() }
    }

    /// Adds a signal.
    pub fn add(&mut self, signal: Imported, session_from_device: &SessionFromDevice) {
        let stream = self.streams.len();
        let width = signal.stream.channels.len().max(1);
        let mut add =
            |first_ns, last_ns, data| self.pieces.push(Piece { stream, first_ns, last_ns, data });
        match signal.content {
            Content::Even(runs) => {
                for run in &runs {
                    waves(run, width, session_from_device, &mut add);
                }
            }
            Content::Uneven { at_ns, values } => {
                for (at_ns, numbers) in at_ns.iter().zip(values.chunks_exact(width)) {
                    let at_ns = session_from_device(*at_ns);
                    add(at_ns, at_ns, Data::Sample(Arc::from(numbers)));
                }
            }
            Content::Marks(marks) => {
                for mark in marks {
                    let at_ns = session_from_device(mark.at_ns);
                    let (kind, label) = (EventKind::Marker, mark.label);
                    let end_ns = session_from_device(mark.at_ns.saturating_add(mark.duration_ns));
                    let duration_secs = end_ns.saturating_sub(at_ns) as f64 / 1e9;
                    let event = Event { kind, label, value: f64::NAN, duration_secs };
                    add(at_ns, at_ns, Data::Event(Arc::new(event)));
                }
            }
        }
        self.streams.push(signal.stream);
    }

    /// When the first and the last sample were measured [ns].
    pub fn span_ns(&self) -> Option<(i64, i64)> {
        let first = self.pieces.iter().map(|piece| piece.first_ns).min()?;
        Some((first, self.pieces.iter().map(|piece| piece.last_ns).max()?))
    }
}

/// Splits a run into pieces.
fn waves(
    run: &Run,
    width: usize,
    session_from_device: &SessionFromDevice,
    add: &mut impl FnMut(i64, i64, Data),
) {
    let count = ((PIECE_SECS * 1e9 / run.period_ns) as usize).max(1);
    let at = |place: usize| {
        session_from_device(
            run.start_ns.saturating_add((place as f64 * run.period_ns).round() as i64),
        )
    };
    let samples = run.samples.len() / width;
    // The period on the session's clock, over the whole run: in a single piece, rounding to nanoseconds would show.
    let last = samples.saturating_sub(1).max(1);
    let span_ns = at(last).saturating_sub(at(0)) as f64;
    let period_ns = span_ns / last as f64;
    for (piece, numbers) in run.samples.chunks(count * width).enumerate() {
        let first = piece * count;
        let last = first + (numbers.len() / width).saturating_sub(1);
        let wave = Wave { period_ns, channels: width as u32, samples: numbers.into() };
        add(at(first), at(last), Data::Wave(wave));
    }
}

#[async_trait]
impl Source for Placed {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        self.pieces.sort_by_key(|piece| piece.last_ns);
        let Some((begin_ns, _)) = self.span_ns() else { return Ok(()) };
        let begin = Time::from_nanos(begin_ns);
        let ids: Vec<_> =
            self.streams.iter().map(|stream| outlet.declare_at(stream.clone(), begin)).collect();
        for Piece { stream, first_ns, last_ns, data } in self.pieces.drain(..) {
            let source_time = Some(Time::from_nanos(first_ns));
            let reading =
                Reading { stream: ids[stream], index: None, device_time: None, source_time, data };
            // The arrival is just after the last sample was measured.
            let arrival = Time::from_nanos(last_ns.saturating_add(1));
            if outlet.send(reading, arrival).await.is_err() {
                return Ok(());
            }
        }
        Ok(())
    }
}
