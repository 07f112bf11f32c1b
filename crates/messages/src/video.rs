//! Frames of video in messages (`foxglove_msgs/CompressedVideo`, `ffmpeg_image_transport_msgs/FFMPEGPacket`), without a
//! copy, and what is needed to decode a frame of H.264.

use bytes::Bytes;

use crate::cdr::{CdrError, Reader};
use crate::standard::std_msgs::Header;

/// The type of Foxglove's messages with a frame of video each.
pub const COMPRESSED_VIDEO: &str = "foxglove_msgs/msg/CompressedVideo";
/// The type of messages with a frame of video each from ROS's `ffmpeg_image_transport`.
pub const FFMPEG_PACKET: &str = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket";

/// The longest name of a format that is kept [bytes].
const FORMAT_BYTES: usize = 60;

/// Types of NAL units (ITU-T H.264, table 7-1): a slice of a picture, and a slice of a picture that stands alone (IDR).
const PART: u8 = 1;
const PART_OF_IDR: u8 = 5;

/// A frame of video.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VideoFrame {
    /// The format as stated by the sender: `h264`, or `h264;yuv420p;bgr8;bgr8`.
    pub format: String,
    /// The encoded frame.
    pub bytes: Bytes,
}

/// What is needed to decode a frame of H.264.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing: the frame stands alone.
    Nothing,
    /// All frames since the last frame that stands alone.
    Before,
}

/// Whether messages of a type have a frame of video each.
pub fn is_video(type_name: &str) -> bool {
    [COMPRESSED_VIDEO, FFMPEG_PACKET].contains(&type_name)
}

impl VideoFrame {
    /// Reads a message of either type.
    pub fn read(type_name: &str, message: &Bytes) -> Result<VideoFrame, CdrError> {
        let mut reader = Reader::new(message)?;
        // A time and the name of a frame are laid out like a header.
        reader.read::<Header>()?;
        let of = |format: &[u8]| {
            String::from_utf8_lossy(&format[..format.len().min(FORMAT_BYTES)]).into_owned()
        };
        if type_name == FFMPEG_PACKET {
            let _: (u32, u32) = (reader.read()?, reader.read()?);
            let format = of(reader.text()?);
            let _: (u64, u8, u8) = (reader.read()?, reader.read()?, reader.read()?);
            return Ok(VideoFrame { format, bytes: data(&mut reader, message)? });
        }
        let bytes = data(&mut reader, message)?;
        Ok(VideoFrame { format: of(reader.text()?), bytes })
    }

    /// Whether the frame is H.264, as stated by the sender: `h264`, `avc1`, or an encoder of ffmpeg such as `libx264`.
    pub fn is_h264(&self) -> bool {
        let codec = self.format.split(';').next().unwrap_or_default().to_ascii_lowercase();
        codec.contains("264") || codec.starts_with("avc")
    }

    /// What is needed to decode the frame; `None` if the bytes are not a picture of H.264 in Annex B format, with a
    /// start code before each unit.
    pub fn needs(&self) -> Option<Needs> {
        let is_started =
            self.bytes.starts_with(&[0, 0, 1]) || self.bytes.starts_with(&[0, 0, 0, 1]);
        is_started.then_some(())?;
        // All slices of a picture are of the same kind.
        let mut units = units(&self.bytes);
        units.find_map(|kind| match kind {
            PART_OF_IDR => Some(Needs::Nothing),
            PART => Some(Needs::Before),
            _ => None,
        })
    }
}

fn data(reader: &mut Reader<'_>, message: &Bytes) -> Result<Bytes, CdrError> {
    let count = reader.count(1)?;
    Ok(message.slice_ref(reader.bytes(count)?))
}

/// The types of the NAL units of a frame, in their order.
fn units(bytes: &[u8]) -> impl Iterator<Item = u8> {
    let is_start = |window: &&[u8]| window.starts_with(&[0, 0, 1]);
    bytes.windows(4).filter(is_start).map(|window| window[3] & 0x1f)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::cdr::Writer;

    /// The units of a picture that stands alone: parameters of the sequence and of pictures, and a part of a picture.
    const IDR: &[u8] =
        &[0, 0, 0, 1, 0x67, 0x42, 0, 0x1e, 0, 0, 0, 1, 0x68, 0xce, 0, 0, 1, 0x65, 0x88];
    const NEXT: &[u8] = &[0, 0, 0, 1, 0x09, 0xf0, 0, 0, 0, 1, 0x41, 0x9a];

    fn compressed(format: &str, data: &[u8]) -> Bytes {
        let mut writer = Writer::new();
        writer.write(&Header::default());
        writer.sequence(data);
        writer.text(format);
        writer.finish()
    }

    fn packet(encoding: &str, data: &[u8]) -> Bytes {
        let mut writer = Writer::new();
        writer.write(&Header::default());
        writer.write(&640_u32);
        writer.write(&480_u32);
        writer.text(encoding);
        writer.write(&77_u64);
        writer.write(&1_u8);
        writer.write(&0_u8);
        writer.sequence(data);
        writer.finish()
    }

    #[test]
    fn a_frame_is_a_part_of_its_message_in_either_type() {
        let of_foxglove = compressed("h264", IDR);
        let frame = VideoFrame::read(COMPRESSED_VIDEO, &of_foxglove).unwrap();
        assert_eq!((frame.format.as_str(), &frame.bytes[..]), ("h264", IDR));
        assert!(of_foxglove.as_ptr_range().contains(&frame.bytes.as_ptr()));
        let of_ffmpeg = packet("libx264;yuv420p;bgr8;bgr8", NEXT);
        let frame = VideoFrame::read(FFMPEG_PACKET, &of_ffmpeg).unwrap();
        assert_eq!((frame.is_h264(), &frame.bytes[..]), (true, NEXT));
        assert!(is_video(COMPRESSED_VIDEO) && !is_video("sensor_msgs/msg/Image"));
        // Later versions of the type have more fields at its end.
        let longer = [&of_foxglove[..], &[0, 0, 0, 0, 1, 0, 0, 0, 0]].concat().into();
        assert_eq!(VideoFrame::read(COMPRESSED_VIDEO, &longer).unwrap().bytes, IDR);
    }

    #[test]
    fn a_frame_stands_alone_or_needs_those_before() {
        let of = |format: &str, bytes: &[u8]| {
            VideoFrame::read(COMPRESSED_VIDEO, &compressed(format, bytes)).unwrap()
        };
        assert_eq!(of("h264", IDR).needs(), Some(Needs::Nothing));
        assert_eq!(of("h264", NEXT).needs(), Some(Needs::Before));
        for no_picture in [&b""[..], &[0, 0, 1], &[0, 0, 0, 1, 0x67, 1], &[0, 0, 0, 9, 0x65]] {
            assert_eq!(of("h264", no_picture).needs(), None);
        }
        let is_h264 = ["h264", "H264", "h264_nvenc;nv12", "avc1"].map(|it| of(it, IDR).is_h264());
        assert_eq!(is_h264, [true; 4]);
        assert!(!of("h265", IDR).is_h264() && !of("hevc;h264", IDR).is_h264());
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes: Vec<u8>, is_packet: bool) {
            let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
            let type_name = if is_packet { FFMPEG_PACKET } else { COMPRESSED_VIDEO };
            if let Ok(frame) = VideoFrame::read(type_name, &message) {
                let _: Option<Needs> = frame.needs();
            }
        }
    }
}
