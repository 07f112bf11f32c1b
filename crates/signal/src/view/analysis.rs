//! Values of camera images in windows: pulse, presence and movement.
//!
//! There are no events. Causal and whole analysis agree: filtering over time is limited to 1.6 s.

use super::pulse_wave::PulseWave;
use super::spectra::Spectra;
use super::store::Store;
use super::values::{VALUES, measure};
use super::{CHANNELS, Frame};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};

/// A causal analysis of frames whose numbers have these names, including [`CHANNELS`]; the missing channels are
/// unknown.
pub fn causal(names: &[String]) -> Box<dyn Causal + Send> {
    Box::new(Seen::new(names))
}

/// An analysis of a whole recording of such numbers.
pub fn whole(names: &[String], recording: &Recording<'_>) -> Whole {
    let mut seen = Seen::new(names);
    let mut numbers = vec![f64::NAN; recording.channels.len()];
    for place in 0..recording.len() {
        numbers.iter_mut().zip(recording.channels).for_each(|(to, from)| *to = from[place]);
        seen.push(recording.time_ns(place as f64), &numbers);
    }
    Whole { events: Vec::new(), windows: Box::new(seen) }
}

struct Seen {
    /// The index of each of [`CHANNELS`] among the numbers.
    places: [Option<usize>; CHANNELS.len()],
    wave: PulseWave,
    spectra: Spectra,
    store: Store,
}

impl Seen {
    fn new(names: &[String]) -> Seen {
        Seen {
            places: CHANNELS.map(|channel| names.iter().position(|name| name == channel)),
            wave: PulseWave::default(),
            spectra: Spectra::default(),
            store: Store::default(),
        }
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
        let number = |place: Option<usize>| place.and_then(|place| channels.get(place).copied());
        let numbers = self.places.map(|place| number(place).unwrap_or(f64::NAN));
        let [brightness, moving, presence, skin, red, green, blue] = numbers;
        let colour = [red, green, blue];
        let frame = Frame { at_ns, brightness, moving, presence, skin, colour };
        self.store.push(frame);
        let Seen { wave, spectra, store, .. } = self;
        wave.push(frame, |sample| match sample.map(|sample| spectra.push(sample)) {
            Some(Some(spectrum)) => store.add(spectrum),
            Some(None) => {}
            None => spectra.pause(),
        });
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.store.forget(before_ns);
    }
}

#[cfg(test)]
mod tests;
