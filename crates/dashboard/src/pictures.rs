//! Pictures of cameras: from ROS messages to the formats that browsers show.

use std::borrow::Cow;
use std::sync::OnceLock;

use axum::body::Bytes;
use jpeg_encoder::{ColorType, Encoder};
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::stream::{Shape, Stream};
use teampulse_messages::pictures::{
    COMPRESSED_IMAGE, Encoding, IMAGE, PictureError, PictureFile, Pixels,
};
use teampulse_messages::video::{Needs, VideoFrame, is_video};
use thiserror::Error;

use crate::wire::pictures::head;

/// The largest picture that is shown [bytes].
const LARGEST_BYTES: usize = 8 << 20;
/// The JPEG quality at which pixels are sent: it takes a fifteenth of their size, and edges stay sharp.
const JPEG_QUALITY: u8 = 80;

/// A picture of a camera.
#[derive(Debug)]
pub struct Picture {
    /// The stream's number.
    pub stream: u32,
    /// When the picture was taken [s].
    pub t: f64,
    /// How the picture depends on others of its stream.
    pub place: Place,
    content: Content,
    encoded: OnceLock<Result<Bytes, Unshown>>,
}

/// How a picture depends on others of its stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A picture that is not part of a video.
    Alone,
    /// A key frame of video: it depends on no other frame.
    First,
    /// A frame of video that depends on all frames since the key frame.
    Next,
}

/// The form in which a picture arrived. Nothing is copied.
#[derive(Debug, PartialEq)]
enum Content {
    /// A file that browsers can show, or a frame of H.264.
    File(Bytes),
    /// Pixels.
    Pixels(Pixels),
}

/// Why a picture is not shown.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum Unshown {
    /// The message has no picture that can be read.
    #[error(transparent)]
    Message(#[from] PictureError),
    /// A format that no browser supports.
    #[error("browsers can't show `{0}`; JPEG, PNG and WebP can be shown")]
    Format(String),
    /// The pixels have an unsupported encoding.
    #[error(
        "pixels of `{0}` can't be shown; rgb8, bgr8, rgba8, bgra8, mono8, mono16, 16UC1, 32FC1 and yuyv can be shown"
    )]
    Encoding(String),
    /// The video has an unsupported format.
    #[error("video in `{0}` can't be shown; only H.264 can")]
    Video(String),
    /// The H.264 has an unsupported form.
    #[error(
        "a message holds no H.264 picture; each must hold one, in Annex B (a start code before each unit)"
    )]
    Units,
    /// The picture is too large.
    #[error("a picture of {0} MiB is too large; the limit is 8 MiB")]
    Large(usize),
    /// The picture has too many pixels for JPEG.
    #[error("failed to encode the picture: {0}")]
    Encode(String),
}

/// The kinds of messages that hold pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Compressed,
    Pixels,
    Video,
}

impl Kind {
    fn of(stream: &Stream) -> Option<Kind> {
        let Shape::Message(schema) = &stream.shape else { return None };
        match &*schema.name {
            COMPRESSED_IMAGE => Some(Kind::Compressed),
            IMAGE => Some(Kind::Pixels),
            name => is_video(name).then_some(Kind::Video),
        }
    }
}

/// Whether a stream holds pictures that can be read.
pub fn has_pictures(stream: &Stream) -> bool {
    Kind::of(stream).is_some()
}

/// Whether a stream holds frames of video, most of which depend on earlier ones.
pub fn has_video(stream: &Stream) -> bool {
    Kind::of(stream) == Some(Kind::Video)
}

/// Returns how the picture in a record depends on others; `None` if the record has none that can be shown.
pub fn place_of(record: &Record) -> Option<Place> {
    let Data::Message(message) = &record.sample.data else { return None };
    Some(Picture::read(&record.stream, 0, 0.0, message).ok()?.place)
}

impl Picture {
    /// Reads a picture, taken at a time [s], from a message of a stream.
    pub fn read(stream: &Stream, id: u32, t: f64, message: &Bytes) -> Result<Picture, Unshown> {
        if message.len() > LARGEST_BYTES {
            return Err(Unshown::Large(message.len() >> 20));
        }
        let (content, place) = match Kind::of(stream) {
            Some(Kind::Compressed) => (file(message)?, Place::Alone),
            Some(Kind::Pixels) => (pixels(message)?, Place::Alone),
            Some(Kind::Video) => frame(stream, message)?,
            None => return Err(Unshown::Format(stream.name.clone())),
        };
        Ok(Picture { stream: id, t, place, content, encoded: OnceLock::new() })
    }

    /// Returns the message to send; pixels are converted to JPEG once for all viewers, which takes milliseconds.
    pub fn encode(&self) -> Result<Bytes, Unshown> {
        let encoded = self.encoded.get_or_init(|| encode(self.stream, self.t, &self.content));
        encoded.clone()
    }

    /// The memory used by the picture as it arrived [bytes].
    pub fn held_bytes(&self) -> usize {
        match &self.content {
            Content::File(file) => file.len(),
            Content::Pixels(pixels) => pixels.size(),
        }
    }

    /// The approximate number of bytes that sending the picture takes.
    pub fn size(&self) -> usize {
        match (self.encoded.get(), &self.content) {
            (Some(Ok(encoded)), _) => encoded.len(),
            (_, Content::File(file)) => file.len(),
            (_, Content::Pixels(pixels)) => pixels.size() / 8,
        }
    }
}

/// Reads the file in a `sensor_msgs/CompressedImage`.
fn file(message: &Bytes) -> Result<Content, Unshown> {
    let PictureFile { format, bytes: file } = PictureFile::read(message)?;
    let is_shown = file.starts_with(&[0xff, 0xd8, 0xff])
        || file.starts_with(b"\x89PNG\r\n\x1a\n")
        || (file.starts_with(b"RIFF") && file.get(8..12) == Some(b"WEBP"));
    if is_shown { Ok(Content::File(file)) } else { Err(Unshown::Format(format)) }
}

/// Reads the frame in a message of video.
fn frame(stream: &Stream, message: &Bytes) -> Result<(Content, Place), Unshown> {
    let Shape::Message(schema) = &stream.shape else {
        return Err(Unshown::Format(stream.name.clone()));
    };
    let frame = VideoFrame::read(&schema.name, message).map_err(PictureError::from)?;
    if !frame.is_h264() {
        return Err(Unshown::Video(frame.format));
    }
    let place = match frame.needs().ok_or(Unshown::Units)? {
        Needs::Nothing => Place::First,
        Needs::Before => Place::Next,
    };
    Ok((Content::File(frame.bytes), place))
}

/// Reads the pixels in a `sensor_msgs/Image`.
fn pixels(message: &Bytes) -> Result<Content, Unshown> {
    match Pixels::read(message) {
        Ok(pixels) => Ok(Content::Pixels(pixels)),
        Err(PictureError::Encoding(encoding)) => Err(Unshown::Encoding(encoding)),
        Err(error) => Err(error.into()),
    }
}

fn encode(stream: u32, t: f64, content: &Content) -> Result<Bytes, Unshown> {
    let mut message = head(stream, t);
    match content {
        Content::File(file) => message.extend_from_slice(file),
        Content::Pixels(pixels) => write_jpeg(pixels, &mut message)?,
    }
    Ok(message.into())
}

fn write_jpeg(pixels: &Pixels, out: &mut Vec<u8>) -> Result<(), Unshown> {
    let as_they_are = || match pixels.unpadded() {
        Some(bytes) => Cow::Borrowed(bytes),
        None => pixels.rows().flatten().copied().collect(),
    };
    let (bytes, colours) = match pixels.encoding {
        Encoding::Rgb8 => (as_they_are(), ColorType::Rgb),
        Encoding::Bgr8 => (as_they_are(), ColorType::Bgr),
        Encoding::Rgba8 => (as_they_are(), ColorType::Rgba),
        Encoding::Bgra8 => (as_they_are(), ColorType::Bgra),
        Encoding::Mono8 => (as_they_are(), ColorType::Luma),
        Encoding::Mono16 { is_big_endian: true } => {
            (greys(pixels, |bytes| u16::from_be_bytes(bytes).into()).into(), ColorType::Luma)
        }
        Encoding::Mono16 { is_big_endian: false } => {
            (greys(pixels, |bytes| u16::from_le_bytes(bytes).into()).into(), ColorType::Luma)
        }
        Encoding::Float32 { is_big_endian: true } => {
            (greys(pixels, f32::from_be_bytes).into(), ColorType::Luma)
        }
        Encoding::Float32 { is_big_endian: false } => {
            (greys(pixels, f32::from_le_bytes).into(), ColorType::Luma)
        }
        Encoding::Yuyv => (ycbcr(pixels).into(), ColorType::Ycbcr),
    };
    let encoder = Encoder::new(out, JPEG_QUALITY);
    let encoded = encoder.encode(&bytes, pixels.width, pixels.height, colours);
    encoded.map_err(|error| Unshown::Encode(error.to_string()))
}

/// Expands pairs of pixels that share their colour into separate pixels.
fn ycbcr(pixels: &Pixels) -> Vec<u8> {
    let mut out = Vec::with_capacity(pixels.size() / 2 * 3);
    for row in pixels.rows() {
        let (pairs, odd) = row.as_chunks::<4>();
        for [first, blue, second, red] in pairs {
            out.extend([*first, *blue, *red, *second, *blue, *red]);
        }
        // The last pixel of an odd row has no colour of its own.
        if let [grey, ..] = odd {
            out.extend([*grey, 128, 128]);
        }
    }
    out
}

/// Converts numbers to 8-bit grey levels, with the largest as white. Values that are not finite become black, like
/// holes.
fn greys<const BYTES: usize>(pixels: &Pixels, number: impl Fn([u8; BYTES]) -> f32) -> Vec<u8> {
    let bytes = pixels.rows().flat_map(|row| row.as_chunks().0);
    let numbers: Vec<f32> = bytes.map(|bytes| number(*bytes)).collect();
    let finite = numbers.iter().copied().filter(|number| number.is_finite());
    let largest = finite.fold(f32::MIN_POSITIVE, f32::max);
    let grey = |number: f32| if number.is_finite() { (number / largest * 255.0) as u8 } else { 0 };
    numbers.into_iter().map(grey).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;
    use teampulse_core::stream::{Schema, Subject};
    use teampulse_messages::cdr::Writer;
    use teampulse_messages::standard::Message as _;
    use teampulse_messages::standard::sensor_msgs::Image;
    use teampulse_messages::standard::std_msgs::Header;

    use super::*;
    use crate::wire::pictures::HEAD_BYTES;

    /// A picture of this size [bytes].
    pub(crate) fn picture(stream: u32, t: f64, size: usize) -> Picture {
        frame_of_video(stream, t, size, Place::Alone)
    }

    /// A frame of this size [bytes].
    pub(crate) fn frame_of_video(stream: u32, t: f64, size: usize, place: Place) -> Picture {
        let content = Content::File(vec![0; size].into());
        Picture { stream, t, place, content, encoded: OnceLock::new() }
    }

    fn stream(type_name: &str) -> Stream {
        let (name, encoding) = (type_name.into(), "ros2msg".into());
        let schema = Schema { name, encoding, text: String::new(), hash: String::new() };
        Stream::raw("/robot1/camera", Subject::robot("robot1"), Shape::Message(schema.into()))
    }

    fn image(encoding: &str, width: u32, height: u32, step: u32, data: Vec<u8>) -> Bytes {
        let encoding = encoding.to_owned();
        Image { encoding, width, height, step, data, ..Image::default() }.encode()
    }

    fn compressed(format: &str, data: &[u8]) -> Bytes {
        let mut writer = Writer::new();
        writer.write(&Header::default());
        writer.text(format);
        writer.sequence(data);
        writer.finish()
    }

    #[test]
    fn floats_of_depth_are_greys_and_holes_are_black() {
        let data = [1.0_f32, f32::NAN, 4.0, f32::INFINITY].map(f32::to_le_bytes).concat();
        let message = image("32FC1", 2, 2, 8, data);
        let pixels = Pixels::read(&message).unwrap();
        assert_eq!(greys(&pixels, f32::from_le_bytes), [63, 0, 255, 0]);
    }

    #[test]
    fn a_file_is_sent_as_it_came() {
        let jpeg = [&[0xff, 0xd8, 0xff, 0xe0][..], &[7; 100]].concat();
        let stream = stream("sensor_msgs/msg/CompressedImage");
        let message = compressed("rgb8; jpeg compressed bgr8", &jpeg);
        let picture = Picture::read(&stream, 3, 1.5, &message).unwrap();
        let sent = picture.encode().unwrap();
        assert_eq!(sent[HEAD_BYTES..], jpeg);
        assert_eq!(sent[..4], 3_u32.to_le_bytes());
        let depth = compressed("16UC1; compressedDepth png", &[0; 100]);
        let error = Picture::read(&stream, 3, 1.5, &depth).unwrap_err();
        assert!(error.to_string().contains("compressedDepth"), "{error}");
    }

    #[test]
    fn pixels_become_jpeg_with_or_without_padding_of_rows() {
        let stream = stream("sensor_msgs/msg/Image");
        let plain = image("rgb8", 16, 8, 48, vec![200; 48 * 8]);
        let padded = image("rgb8", 16, 8, 64, {
            let row = [vec![200; 48], vec![1; 16]].concat();
            row.repeat(8)
        });
        let [plain, padded] = [plain, padded]
            .map(|message| Picture::read(&stream, 1, 0.0, &message).unwrap().encode().unwrap());
        assert_eq!(plain, padded);
        assert_eq!(plain[HEAD_BYTES..HEAD_BYTES + 3], [0xff, 0xd8, 0xff]);
        for encoding in ["bgr8", "mono8", "rgba8", "bgra8"] {
            let message = image(encoding, 16, 8, 64, vec![9; 64 * 8]);
            Picture::read(&stream, 1, 0.0, &message).unwrap().encode().unwrap();
        }
    }

    #[test]
    fn two_pixels_share_their_colour() {
        let message = image("yuv422_yuy2", 3, 1, 6, vec![10, 100, 20, 200, 30, 90]);
        let picture = Picture::read(&stream("sensor_msgs/msg/Image"), 1, 0.0, &message).unwrap();
        let Content::Pixels(pixels) = &picture.content else { panic!() };
        assert_eq!(ycbcr(pixels), [10, 100, 200, 20, 100, 200, 30, 128, 128]);
        picture.encode().unwrap();
    }

    #[test]
    fn distances_are_greys_up_to_the_largest() {
        let stream = stream("sensor_msgs/msg/Image");
        let data = [500_u16, 0, 2000, 1000].iter().flat_map(|mm| mm.to_le_bytes()).collect();
        let message = image("16UC1", 2, 2, 4, data);
        let picture = Picture::read(&stream, 1, 0.0, &message).unwrap();
        let Content::Pixels(pixels) = &picture.content else { panic!() };
        assert_eq!(greys(pixels, |bytes| u16::from_le_bytes(bytes).into()), [63, 0, 255, 127]);
        picture.encode().unwrap();
    }

    #[test]
    fn what_is_not_whole_or_unknown_is_named() {
        let stream = stream("sensor_msgs/msg/Image");
        let read = |message: &Bytes| Picture::read(&stream, 1, 0.0, message).unwrap_err();
        let short = read(&image("rgb8", 640, 480, 1920, vec![0; 1000]));
        assert!(matches!(short, Unshown::Message(PictureError::Rows { .. })), "{short}");
        assert_eq!(read(&image("64FC1", 1, 1, 8, vec![0; 8])), Unshown::Encoding("64FC1".into()));
        assert!(matches!(read(&Bytes::from_static(b"\0\x01\0\0\x01")), Unshown::Message(_)));
        assert_eq!(read(&vec![0; 9 << 20].into()), Unshown::Large(9));
    }

    #[test]
    fn a_frame_of_video_is_sent_as_it_came_and_other_video_is_named() {
        let stream = stream("foxglove_msgs/msg/CompressedVideo");
        assert!(has_pictures(&stream) && has_video(&stream));
        let message = |format: &str, data: &[u8]| {
            let mut writer = Writer::new();
            writer.write(&Header::default());
            writer.sequence(data);
            writer.text(format);
            writer.finish()
        };
        let read = |format, data| Picture::read(&stream, 3, 1.5, &message(format, data));
        let [idr, next] = [&[0, 0, 0, 1, 0x67, 1, 0, 0, 1, 0x65, 1][..], &[0, 0, 1, 0x41, 1]];
        let first = read("h264", idr).unwrap();
        assert_eq!((&first.encode().unwrap()[HEAD_BYTES..], first.place), (idr, Place::First));
        assert_eq!(read("h264", next).unwrap().place, Place::Next);
        assert_eq!(read("h265", idr).unwrap_err(), Unshown::Video("h265".into()));
        assert_eq!(read("h264", b"avcC").unwrap_err(), Unshown::Units);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes: Vec<u8>, kind in 0..3_usize) {
            let names = [IMAGE, COMPRESSED_IMAGE, "foxglove_msgs/msg/CompressedVideo"];
            let name = names[kind];
            let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
            if let Ok(picture) = Picture::read(&stream(name), 1, 0.0, &message) {
                drop(picture.encode());
            }
        }
    }
}
