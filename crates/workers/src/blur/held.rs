//! Frames that are held until the faces in the frames shortly after them are known.

use std::collections::VecDeque;

use bytes::Bytes;
use jpeg_encoder::{ColorType, Encoder};
use teampulse_core::time::Time;
use teampulse_messages::cdr::{Reader, Writer};
use teampulse_messages::pictures::COMPRESSED_IMAGE;
use teampulse_messages::standard::std_msgs::Header;
use teampulse_vision::hide::hide;
use teampulse_vision::model::decode::Detection;
use teampulse_vision::picture::Picture;

/// The JPEG quality of pictures in which a face is hidden.
const QUALITY: u8 = 85;
/// The most data held per camera [bytes]. Beyond this limit, the oldest frames are dropped.
const MOST_BYTES: usize = 256 << 20;

/// A processed frame.
pub(super) struct Picked {
    /// The type of the frame's message.
    pub type_name: &'static str,
    /// The frame's message.
    pub message: Bytes,
    /// When the frame was taken.
    pub taken: Time,
}

/// The held frames of a camera, and the faces in these and slightly earlier frames.
pub(super) struct Held {
    hold_secs: f64,
    margin: f64,
    frames: VecDeque<Picked>,
    bytes: usize,
    /// The detected faces: left, top, width and height [px], each with its time.
    faces: VecDeque<(Time, [f32; 4])>,
}

impl Held {
    /// Creates an empty queue; hidden parts extend beyond each side of a face by `margin`, as a share of its sides.
    pub fn new(hold_secs: f64, margin: f64) -> Held {
        Held { hold_secs, margin, frames: VecDeque::new(), bytes: 0, faces: VecDeque::new() }
    }

    /// The number of held frames.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Holds a frame with the faces found in it. Returns the number of frames dropped for lack of room.
    pub fn push(&mut self, frame: Picked, faces: &[[f32; 4]]) -> usize {
        self.faces.extend(faces.iter().map(|face| (frame.taken, *face)));
        self.bytes += frame.message.len();
        self.frames.push_back(frame);
        let mut left_out = 0;
        while self.bytes > MOST_BYTES && self.take().is_some() {
            left_out += 1;
        }
        left_out
    }

    /// The next frame whose holding time has ended by `now`: its time, and its message with hidden faces or the reason
    /// why there is none.
    pub fn next(&mut self, now: Time) -> Option<(Time, Result<Bytes, String>)> {
        let taken = self.frames.front()?.taken;
        if now.secs_since(taken) < self.hold_secs {
            return None;
        }
        let old = |(found, _): &(Time, _)| taken.secs_since(*found) > self.hold_secs;
        let count = self.faces.iter().take_while(|face| old(face)).count();
        self.faces.drain(..count);
        let frame = self.take()?;
        Some((taken, self.hidden(&frame)))
    }

    fn take(&mut self) -> Option<Picked> {
        let frame = self.frames.pop_front()?;
        self.bytes -= frame.message.len();
        Some(frame)
    }

    fn hidden(&self, frame: &Picked) -> Result<Bytes, String> {
        let near = |found: &Time| found.secs_since(frame.taken).abs() <= self.hold_secs;
        let mut faces = self.faces.iter().filter(|(found, _)| near(found)).peekable();
        if faces.peek().is_none() && frame.type_name == COMPRESSED_IMAGE {
            return Ok(frame.message.clone());
        }
        let mut picture =
            Picture::read(frame.type_name, &frame.message).map_err(|error| error.to_string())?;
        for (_, [left, top, width, height]) in faces {
            let [left, top, width, height] = [*left, *top, *width, *height];
            let face = Detection { left, top, width, height, score: 1.0, points: Vec::new() };
            hide(&mut picture, &face, self.margin);
        }
        compressed(&frame.message, &picture)
    }
}

/// Encodes a picture as `sensor_msgs/CompressedImage`, with the header of its original message.
fn compressed(original: &Bytes, picture: &Picture) -> Result<Bytes, String> {
    let failed = |error: &dyn std::fmt::Display| format!("compress a picture: {error}");
    let header = Reader::new(original).and_then(|mut reader| reader.read::<Header>());
    let header = header.map_err(|error| failed(&error))?;
    let sides = u16::try_from(picture.width)
        .and_then(|width| u16::try_from(picture.height).map(|height| (width, height)));
    let (width, height) = sides.map_err(|error| failed(&error))?;
    let mut jpeg = Vec::new();
    Encoder::new(&mut jpeg, QUALITY)
        .encode(&picture.rgb, width, height, ColorType::Rgb)
        .map_err(|error| failed(&error))?;
    let mut writer = Writer::with_room(jpeg.len() + original.len().min(1024));
    writer.write(&header);
    writer.text("jpeg");
    writer.byte_sequence(&[&jpeg]);
    Ok(writer.finish())
}
