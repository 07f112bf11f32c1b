//! The numbers inside ROS messages.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::Data;
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Channel, Origin, Shape, Signal, Stream, StreamId};
use teampulse_messages::readout::Readout;

use crate::context::FeatureContext;

/// The numbers inside ROS messages: one reading for each message, in the units of its stream.
///
/// - Measures: the unchanged numbers in messages about the battery, the link, temperatures and every other topic for
///   which the study names fields. Odometry and diagnostics are not repeated.
/// - Formula: field × scale.
/// - Unit: as declared for each channel.
/// - Window: none; each message at its own time, late ones too.
/// - Reference: the message's definition.
/// - Limits: a field that a message does not have is NaN. A topic whose definition is not known
///   has no numbers.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Numbers {}

impl Component<dyn Feature, FeatureContext> for Numbers {
    const EXAMPLE: &'static str = "";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        Ok(Box::new(self))
    }
}

impl Feature for Numbers {
    fn accepts(&self, stream: &Stream) -> bool {
        let signals = [Signal::Battery, Signal::Link, Signal::Temperature, Signal::Other];
        stream.origin == Origin::Raw
            && matches!(stream.shape, Shape::Message(_))
            && signals.contains(&stream.signal)
            && !stream.channels.is_empty()
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Reader { readout: None, output: None })
    }
}

struct Reader {
    readout: Option<Readout>,
    output: Option<OutputId>,
}

impl Extractor for Reader {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.readout = Readout::of(stream);
        if self.readout.is_some() {
            self.output = Some(out.declare(output(stream)));
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let numbers = self.readout.as_mut().and_then(|readout| readout.read(&sample.data));
        if let (Some(numbers), Some(output)) = (numbers, self.output) {
            out.emit(output, sample.measured, Data::Sample(Arc::from(numbers)));
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }
}

fn output(input: &Stream) -> Stream {
    Stream {
        signal: input.signal,
        device: input.device.clone(),
        channels: input
            .channels
            .iter()
            .map(|each| Channel::new(&*each.name, &*each.unit))
            .collect(),
        rate_hz: input.rate_hz,
        method: "fields of the message times their scale".to_owned(),
        doc: format!("The numbers inside the messages of {}.", input.name),
        ..Stream::derived(input, "numbers", Shape::Sample)
    }
}

#[cfg(test)]
mod tests {
    use teampulse_messages::standard::Message;
    use teampulse_messages::standard::sensor_msgs::BatteryState;

    use super::*;
    use crate::drive::{Drive, built, messages, plain};

    fn battery(scale: f64) -> Stream {
        let channels = [("voltage", "V"), ("percentage", "1")];
        let mut stream = messages::<BatteryState>("/r1/battery_state", Signal::Battery, &channels);
        stream.channels.iter_mut().for_each(|channel| channel.scale = scale);
        stream
    }

    fn message(voltage: f32, percentage: f32) -> Data {
        Data::Message(BatteryState { voltage, percentage, ..BatteryState::default() }.encode())
    }

    fn read(stream: &Stream, data: Data) -> Vec<Arc<[f64]>> {
        let mut drive = Drive::new(built::<Numbers>("").as_ref(), stream);
        drive.take(1.5, data);
        let numbers = |data| if let Data::Sample(numbers) = data { numbers } else { panic!() };
        let samples = drive.data("/r1/battery_state/numbers").into_iter();
        samples
            .map(|(secs, data)| (secs, numbers(data)))
            .map(|(secs, numbers)| {
                assert_eq!(secs, 1.5);
                numbers
            })
            .collect()
    }

    #[test]
    fn a_message_s_fields_are_a_sample_at_its_time() {
        assert_eq!(read(&battery(1.0), message(12.5, 0.75)), [Arc::from([12.5, 0.75])]);
    }

    #[test]
    fn numbers_come_in_the_units_of_the_stream() {
        assert_eq!(read(&battery(2.0), message(12.5, 0.75)), [Arc::from([25.0, 1.5])]);
    }

    #[test]
    fn a_torn_message_has_no_numbers() {
        let Data::Message(whole) = message(12.5, 0.75) else { panic!() };
        assert!(read(&battery(1.0), Data::Message(whole.slice(..20))).is_empty());
    }

    #[test]
    fn plain_numbers_are_not_repeated() {
        let stream = plain("/r1/battery_state", Signal::Battery, &[("voltage", "V")]);
        assert!(!built::<Numbers>("").accepts(&stream));
    }
}
