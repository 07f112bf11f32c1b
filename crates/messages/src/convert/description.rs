use std::iter::repeat;

use teampulse_core::stream::{About, Audience, Channel, Origin, Signal, Stream, Window};

use super::DecodeError;
use super::decode::{expect_length, unknown_word};
use super::schema::{named, shape_of, type_name};
use crate::standard::std_msgs::Header;
use crate::standard::teampulse_msgs::StreamDescription;

const ABOUT: [About; 4] = [About::Person, About::Robot, About::Team, About::Session];
const ORIGINS: [Origin; 2] = [Origin::Raw, Origin::Derived];

/// The most channels of an external stream.
pub const MOST_CHANNELS: usize = 1024;

/// The most channels of a stream derived from such streams, and the most inputs that it can have.
const MOST_DERIVED: usize = 16 * MOST_CHANNELS;

impl StreamDescription {
    /// The description of a stream. It does not include the quality of service and the publisher: bags
    /// store them with their channels, and the bus with its endpoints.
    pub fn of(stream: &Stream, header: Header) -> StreamDescription {
        StreamDescription {
            header,
            name: stream.name.clone(),
            r#type: type_name(&stream.shape).to_owned(),
            signal: stream.signal.word().to_owned(),
            about: code(&ABOUT, &stream.about),
            id: stream.id.clone(),
            device: stream.device.clone(),
            origin: code(&ORIGINS, &stream.origin),
            inputs: stream.inputs.clone(),
            method: stream.method.clone(),
            channels: stream.channels.iter().map(|channel| channel.name.clone()).collect(),
            units: stream.channels.iter().map(|channel| channel.unit.clone()).collect(),
            rate_hz: stream.rate_hz,
            scales: scales(&stream.channels),
            doc: stream.doc.clone(),
            family: stream.family.clone(),
            window_secs: match stream.window {
                None => 0.0,
                Some(Window::Of(length)) => length.as_secs_f64(),
                Some(Window::Phases) => StreamDescription::PHASES,
            },
            beside: stream.beside.clone(),
        }
    }

    /// The described stream. The schema of an external message type has a definition and a hash only if
    /// they are [shipped](crate::catalogue::shipped). Texts are cut and cleaned.
    pub fn stream(&self) -> Result<Stream, DecodeError> {
        expect_length("units", self.units.len(), self.channels.len())?;
        let origin = coded("origin", &ORIGINS, self.origin)?;
        let most = match origin {
            Origin::Raw => MOST_CHANNELS,
            Origin::Derived => MOST_DERIVED,
        };
        expect_at_most("channels", self.channels.len(), most)?;
        expect_at_most("inputs", self.inputs.len(), MOST_DERIVED)?;
        let signal = Signal::from_word(&self.signal);
        if !self.scales.is_empty() {
            expect_length("scales", self.scales.len(), self.channels.len())?;
        }
        let scales = self.scales.iter().copied().chain(repeat(1.0));
        let channel = |((name, unit), scale): ((&String, &String), f64)| Channel {
            name: name.clone(),
            unit: unit.clone(),
            // A publisher that sets no scale may send 0, which would turn every number into 0.
            scale: if scale == 0.0 { 1.0 } else { scale },
        };
        let channels = self.channels.iter().zip(&self.units).zip(scales);
        let stream = Stream {
            name: self.name.clone(),
            signal: signal.ok_or_else(|| unknown_word("signal", &self.signal, Signal::ALL))?,
            about: coded("about", &ABOUT, self.about)?,
            id: self.id.clone(),
            device: self.device.clone(),
            origin,
            shape: shape_of(&named(&self.r#type)),
            channels: channels.map(channel).collect(),
            rate_hz: self.rate_hz,
            inputs: self.inputs.clone(),
            method: self.method.clone(),
            doc: self.doc.clone(),
            family: self.family.clone(),
            window: match self.window_secs {
                StreamDescription::PHASES => Some(Window::Phases),
                secs if secs > 0.0 => Some(Window::of_secs(secs)),
                _ => None,
            },
            beside: self.beside.clone(),
            publisher: String::new(),
            qos: Vec::new(),
            audience: Audience::Everybody,
        };
        Ok(stream.cleaned())
    }
}

/// The scale of each channel; empty if all are 1.
fn scales(channels: &[Channel]) -> Vec<f64> {
    let is_plain = channels.iter().all(|channel| channel.scale.total_cmp(&1.0).is_eq());
    if is_plain { Vec::new() } else { channels.iter().map(|channel| channel.scale).collect() }
}

/// The index of a value in the list of its codes.
fn code<T: PartialEq>(all: &[T], value: &T) -> u8 {
    let place = all.iter().position(|each| each == value);
    place.expect("the list has every value") as u8
}

fn expect_at_most(field: &'static str, length: usize, most: usize) -> Result<(), DecodeError> {
    let expected = if length <= most { return Ok(()) } else { format!("at most {most}") };
    Err(DecodeError::Length { field, length, expected })
}

fn coded<T: Copy>(field: &'static str, all: &[T], code: u8) -> Result<T, DecodeError> {
    all.get(usize::from(code)).copied().ok_or(DecodeError::Code { field, code })
}
