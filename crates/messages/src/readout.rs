//! The numbers of a sample, in the units of its stream.

use teampulse_core::data::Data;
use teampulse_core::stream::{Channel, Schema, Shape, Stream};

use crate::catalogue::shipped;
use crate::definition::Definition;
use crate::fields::Fields;

/// Reads the numbers of a stream's channels out of its samples.
#[derive(Debug)]
pub struct Readout {
    layout: Layout,
    /// The factor of each channel.
    scales: Vec<f64>,
    numbers: Vec<f64>,
}

/// The location of the numbers.
#[derive(Debug)]
enum Layout {
    /// All numbers of the data, `width` of them in a sample, in each sample of a wave, or in a feature.
    Plain { width: usize },
    /// Fields of a message.
    Fields(Fields),
}

impl Readout {
    /// Reads every declared channel of the stream; `None` if the definition of its messages is unknown or
    /// lacks such fields.
    pub fn of(stream: &Stream) -> Option<Readout> {
        Readout::of_channels(stream, &stream.channels)
    }

    /// Reads these channels, regardless of those that the stream declares.
    pub fn of_channels(stream: &Stream, channels: &[Channel]) -> Option<Readout> {
        let layout = match &stream.shape {
            Shape::Sample | Shape::Wave | Shape::Feature => Layout::Plain { width: channels.len() },
            Shape::Message(schema) => {
                let paths: Vec<&str> = channels.iter().map(|channel| &*channel.name).collect();
                Layout::Fields(Fields::compile(&definition(schema)?, &paths).ok()?)
            }
            _ => return None,
        };
        let scales = channels.iter().map(|channel| channel.scale).collect();
        Some(Readout { layout, scales, numbers: Vec::new() })
    }

    /// Returns a number for each channel, NaN for those missing in the message; for a wave, the numbers of all samples
    /// in sequence. `None` if the sample can't be read at all.
    pub fn read(&mut self, data: &Data) -> Option<&[f64]> {
        match (&self.layout, data) {
            (Layout::Plain { width }, Data::Sample(numbers)) if numbers.len() == *width => {
                self.numbers.clear();
                self.numbers.extend_from_slice(numbers);
            }
            (Layout::Plain { width }, Data::Wave(wave)) if wave.channels as usize == *width => {
                self.numbers.clear();
                self.numbers.extend_from_slice(&wave.samples);
            }
            (Layout::Plain { width }, Data::Feature(feature)) if feature.values.len() == *width => {
                self.numbers.clear();
                self.numbers.extend_from_slice(&feature.values);
            }
            (Layout::Fields(fields), Data::Message(cdr)) => {
                fields.read(cdr, &mut self.numbers).ok()?;
            }
            _ => return None,
        }
        for (number, scale) in self.numbers.iter_mut().zip(self.scales.iter().cycle()) {
            *number *= scale;
        }
        Some(&self.numbers)
    }
}

/// The definition in the schema, or else the shipped definition.
pub fn definition(schema: &Schema) -> Option<Definition> {
    let own = Definition::of(schema).ok();
    own.or_else(|| Definition::of(&*shipped(&schema.name)?).ok())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytes::Bytes;
    use proptest::prelude::*;
    use teampulse_core::data::Wave;
    use teampulse_core::stream::Subject;

    use super::*;
    use crate::standard::Message;
    use crate::standard::sensor_msgs::BatteryState;

    fn stream(channel: &str) -> Stream {
        let shape = Shape::Message(shipped(BatteryState::NAME).unwrap());
        let stream = Stream::raw("/r1/battery_state", Subject::robot("r1"), shape);
        stream.with_channels(&[(channel, "V")])
    }

    fn plain(shape: Shape) -> Stream {
        Stream::raw("/r1/x", Subject::robot("r1"), shape).with_channels(&[("x", "m")])
    }

    #[test]
    fn a_definition_that_did_not_come_is_the_shipped_one() {
        let schema = Schema {
            name: BatteryState::NAME.to_owned(),
            encoding: String::new(),
            text: String::new(),
            hash: String::new(),
        };
        let stream = Stream { shape: Shape::Message(Arc::new(schema)), ..stream("voltage") };
        let message = BatteryState { voltage: 12.5, ..BatteryState::default() }.encode();
        let mut readout = Readout::of(&stream).unwrap();
        assert_eq!(readout.read(&Data::Message(message)), Some(&[12.5][..]));
    }

    #[test]
    fn a_field_that_there_is_not_has_no_readout() {
        assert!(Readout::of(&stream("volume")).is_none());
    }

    #[test]
    fn a_sample_of_another_width_is_not_read() {
        let mut readout = Readout::of(&plain(Shape::Sample)).unwrap();
        assert_eq!(readout.read(&Data::Sample([1.0].into())), Some(&[1.0][..]));
        assert_eq!(readout.read(&Data::Sample([1.0, 2.0].into())), None);
    }

    #[test]
    fn of_a_wave_every_sample_is_read() {
        let mut readout = Readout::of(&plain(Shape::Wave)).unwrap();
        let wave = Wave { period_ns: 1e6, channels: 1, samples: [1.0, 2.0].into() };
        assert_eq!(readout.read(&Data::Wave(wave)), Some(&[1.0, 2.0][..]));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut readout = Readout::of(&stream("serial_number")).unwrap();
            if let Some(numbers) = readout.read(&Data::Message(Bytes::from(bytes))) {
                prop_assert_eq!(numbers.len(), 1);
            }
        }
    }
}
