//! The numbers of a sample, in the units of its stream.

use teampulse_core::data::Data;
use teampulse_core::stream::{Shape, Stream};

/// Reads the numbers of a stream's channels out of its samples.
#[derive(Debug)]
pub(crate) struct Readout {
    scale: f64,
    width: usize,
    numbers: Vec<f64>,
}

impl Readout {
    /// Reads every channel that the stream declares; `None` while the definition of its messages is
    /// not known, or where it has no such fields.
    pub(crate) fn of(stream: &Stream) -> Option<Readout> {
        Readout::of_channels(stream, &stream.channels)
    }

    /// Reads these fields, whatever the stream declares; of a sample, all of its numbers.
    pub(crate) fn of_channels(stream: &Stream, channels: &[String]) -> Option<Readout> {
        let width = channels.len();
        match &stream.shape {
            Shape::Sample => Some(Readout { scale: stream.scale, width, numbers: Vec::new() }),
            _ => None,
        }
    }

    /// A number for each channel, NaN where the message has none; `None` when the sample can't be
    /// read at all.
    pub(crate) fn read(&mut self, data: &Data) -> Option<&[f64]> {
        self.numbers.clear();
        match data {
            Data::Sample(numbers) if numbers.len() == self.width => self.numbers.extend(&**numbers),
            _ => return None,
        }
        self.numbers.iter_mut().for_each(|number| *number *= self.scale);
        Some(&self.numbers)
    }
}
