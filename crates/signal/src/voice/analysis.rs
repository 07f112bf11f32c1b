//! The values of a voice in windows: level, activity, pitch, rate, pauses, jitter, shimmer and tilt.
//!
//! There are no events. Causal and whole analysis have the same frames; the causal one lags by 0.3 s. The
//! input is either the samples of a microphone ([`causal`]) or [frames](super::Frame) computed from them at
//! the source ([`of_frames`]).

use super::frame::Frame;
use super::framer::Framer;
use super::settings::Settings;
use super::store::Store;
use super::values::{VALUES, measure};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::SignalError;

/// A causal analysis of samples (1 is full scale) at 8 to 96 kHz; only the first channel is used.
///
/// No sample allocates in steady state. Returns an error for another rate, or settings out of range.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Heard { framer: Framer::new(settings, rate_hz)?, store: Store::default() }))
}

/// A causal analysis of frames given as numbers, as from [`Frame::numbers`].
pub fn of_frames() -> Box<dyn Causal + Send> {
    Box::new(Framed(Store::default()))
}

/// An analysis of a whole recording of samples. Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let framer = Framer::new(settings, recording.rate_hz)?;
    let later = (framer.delay_secs() * recording.rate_hz).ceil() as usize + 1;
    let mut heard = Heard { framer, store: Store::default() };
    let samples = recording.channels.first().map_or(&[][..], Vec::as_slice);
    // Missing samples after the end complete the pending frames.
    let samples = samples.iter().copied().chain(std::iter::repeat_n(f64::NAN, later));
    for (number, sample) in samples.enumerate() {
        heard.push(recording.time_ns(number as f64), &[sample]);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(heard.store) })
}

/// An analysis of a whole recording of frames given as numbers.
pub fn whole_of_frames(recording: &Recording<'_>) -> Whole {
    let mut store = Store::default();
    let mut numbers = vec![f64::NAN; recording.channels.len()];
    for place in 0..recording.len() {
        numbers.iter_mut().zip(recording.channels).for_each(|(to, from)| *to = from[place]);
        store.push(Frame::of_numbers(recording.time_ns(place as f64), &numbers));
    }
    Whole { events: Vec::new(), windows: Box::new(store) }
}

impl Windows for Store {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        measure(self, span)
    }
}

struct Heard {
    framer: Framer,
    store: Store,
}

impl Windows for Heard {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        measure(&self.store, span)
    }
}

impl Causal for Heard {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let sample = channels.first().copied().unwrap_or(f64::NAN);
        if let Some(frame) = self.framer.push(at_ns, sample) {
            self.store.push(frame);
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.store.forget(before_ns);
    }
}

struct Framed(Store);

impl Windows for Framed {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        measure(&self.0, span)
    }
}

impl Causal for Framed {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        self.0.push(Frame::of_numbers(at_ns, channels));
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.0.forget(before_ns);
    }
}
