//! The values of a face in windows: blinks, closed eyes, and movement of the head; each blink is also an
//! event.
//!
//! Causal and whole analysis agree.

use std::collections::VecDeque;

use super::Frame;
use super::blinks::Blinks;
use super::level::Level;
use super::points::Points;
use super::store::Store;
use super::values::{VALUES, measure};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::SignalError;
use crate::points::{between, middle, tilt};

/// A causal analysis of face landmarks in channels with these names: those of `hri_msgs/FacialLandmarks` in
/// lower case, such as `right_eye_outside_x`.
pub fn causal(names: &[&str]) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Seen::new(names)?))
}

/// An analysis of a whole recording of face landmarks.
pub fn whole(names: &[&str], recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut seen = Seen::new(names)?;
    let mut numbers = vec![f64::NAN; recording.channels.len()];
    let mut events = Vec::new();
    for place in 0..recording.len() {
        numbers.iter_mut().zip(recording.channels).for_each(|(to, from)| *to = from[place]);
        seen.push(recording.time_ns(place as f64), &numbers);
        events.extend(seen.next_event());
    }
    Ok(Whole { events, windows: Box::new(seen) })
}

struct Seen {
    points: Points,
    level: Level,
    blinks: Blinks,
    store: Store,
    count: usize,
    events: VecDeque<Event>,
}

impl Seen {
    fn new(names: &[&str]) -> Result<Seen, SignalError> {
        let lacking = SignalError::Channels { lacking: "an eye, such as right_eye_outside_x" };
        Ok(Seen {
            points: Points::of(names).ok_or(lacking)?,
            level: Level::default(),
            blinks: Blinks::default(),
            store: Store::default(),
            count: 0,
            events: VecDeque::new(),
        })
    }
}

impl Windows for Seen {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        measure(&self.store, span)
    }
}

impl Causal for Seen {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let eyes = self.points.eyes(channels);
        let (open, noise) = self.level.push(at_ns, eyes.opening);
        let [right, left] = eyes.centres;
        self.store.push(Frame {
            at_ns,
            open,
            noise,
            place: middle(left, right),
            apart: between(left, right),
            tilt: tilt([right, left]),
        });
        if let Some(closure) = self.blinks.push(self.count, at_ns, open, noise) {
            self.store.add(closure);
            if closure.is_blink() {
                let details = vec![("amplitude", closure.depth), ("duration_secs", closure.secs)];
                let (at_ns, sample) = (closure.at_ns, closure.frame as f64);
                self.events.push_back(Event { kind: "blink", sample, at_ns, details });
            }
        }
        self.count += 1;
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.store.forget(before_ns);
    }
}

#[cfg(test)]
mod tests;
