//! Sound in messages of `audio_common_msgs`: blocks of bytes, and their format.
//!
//! | message | fields |
//! |---|---|
//! | `AudioData` | `uint8[] data`; no stamp, as in REP-155 at `/humans/voices/<id>/audio` |
//! | `AudioDataStamped` | a header, then `AudioData` |
//! | `AudioInfo` | `uint8 channels`, `uint32 sample_rate`, `string sample_format`, `uint32 bitrate`, `string coding_format` |
//!
//! The formats have the names of `GStreamer` (`S16LE`), as published by `audio_capture`. Encoded sound, such as `mp3`,
//! which is that node's default, is not decoded.

use bytes::Bytes;
use teampulse_core::time::Time;
use thiserror::Error;

use crate::cdr::{CdrError, Reader};
use crate::standard::std_msgs::Header;

/// The type of blocks without a stamp.
pub const AUDIO_DATA: &str = "audio_common_msgs/msg/AudioData";
/// The type of blocks with a stamp.
pub const AUDIO_DATA_STAMPED: &str = "audio_common_msgs/msg/AudioDataStamped";
/// The type of messages that state the format of blocks.
pub const AUDIO_INFO: &str = "audio_common_msgs/msg/AudioInfo";

/// The longest name of a format that is repeated in an error [bytes].
const SHOWN_BYTES: usize = 40;

/// A block of sound.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AudioBlock {
    /// The header's stamp, if there is one and it is set.
    pub stamp: Option<Time>,
    /// The samples of the block, in a format that [`AudioInfo`] states.
    pub data: Bytes,
}

impl AudioBlock {
    /// Reads an `AudioData` or an `AudioDataStamped`, by the name of its type; `None` for another type.
    pub fn read(type_name: &str, message: &Bytes) -> Option<Result<AudioBlock, CdrError>> {
        match type_name {
            AUDIO_DATA => Some(AudioBlock::of(message, false)),
            AUDIO_DATA_STAMPED => Some(AudioBlock::of(message, true)),
            _ => None,
        }
    }

    fn of(message: &Bytes, is_stamped: bool) -> Result<AudioBlock, CdrError> {
        let mut reader = Reader::new(message)?;
        let header = if is_stamped { Some(reader.read::<Header>()?) } else { None };
        let stamp = header.map(|header| header.stamp).filter(|stamp| *stamp != Time::EPOCH);
        let count = reader.count(1)?;
        let data = message.slice_ref(reader.bytes(count)?);
        Ok(AudioBlock { stamp, data })
    }
}

/// The format of a publisher's blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AudioInfo {
    /// The sampling rate [Hz].
    pub rate_hz: f64,
    /// The number of channels, which are interleaved.
    pub channels: u8,
    /// The format of a sample.
    pub format: SampleFormat,
}

/// Why the sound of a publisher can't be used. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum AudioError {
    /// The message is truncated, or not of this type.
    #[error("read the format of the sound: {0}")]
    Message(#[from] CdrError),
    /// Samples in an unsupported format.
    #[error(
        "read sound of the format `{0}`; S8, U8, S16LE, S24LE, S32LE and F32LE, and the same in BE, can be read"
    )]
    Format(String),
    /// Encoded sound.
    #[error("read sound that is encoded as `{0}`: have its node publish samples (`format:=wave`)")]
    Encoded(String),
    /// The sound has no channels, or no rate.
    #[error("read sound of {channels} channels at {rate_hz} Hz")]
    Impossible {
        /// The announced channels.
        channels: u8,
        /// The announced rate [Hz].
        rate_hz: u32,
    },
}

impl AudioInfo {
    /// Reads an `audio_common_msgs/msg/AudioInfo`.
    pub fn read(message: &[u8]) -> Result<AudioInfo, AudioError> {
        let mut reader = Reader::new(message)?;
        let (channels, rate_hz): (u8, u32) = (reader.read()?, reader.read()?);
        let format = reader.text()?.to_vec();
        let _bits: u32 = reader.read()?;
        let coding = reader.text()?;
        if !coding.is_empty()
            && !coding.eq_ignore_ascii_case(b"wave")
            && !coding.eq_ignore_ascii_case(b"pcm")
        {
            return Err(AudioError::Encoded(shown(coding)));
        }
        if channels == 0 || rate_hz == 0 {
            return Err(AudioError::Impossible { channels, rate_hz });
        }
        let format =
            SampleFormat::named(&format).ok_or_else(|| AudioError::Format(shown(&format)))?;
        Ok(AudioInfo { rate_hz: f64::from(rate_hz), channels, format })
    }

    /// The length of one sample of all channels [bytes].
    pub fn frame_bytes(&self) -> usize {
        usize::from(self.channels) * self.format.bytes()
    }

    /// The first channel's samples in a block [full scale]. An incomplete sample at its end, as in a truncated block,
    /// is ignored.
    pub fn first_channel(self, data: &[u8]) -> impl Iterator<Item = f64> {
        data.chunks_exact(self.frame_bytes()).map(move |frame| self.format.sample(frame))
    }
}

/// The format of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleFormat {
    kind: Kind,
    is_big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Unsigned8,
    Signed8,
    Signed16,
    Signed24,
    Signed32,
    Float32,
}

impl SampleFormat {
    /// Signed 16 bits, little-endian: used by most microphones.
    pub const S16LE: SampleFormat = SampleFormat { kind: Kind::Signed16, is_big_endian: false };

    /// 32-bit floats, little-endian: used by sound servers.
    pub const F32LE: SampleFormat = SampleFormat { kind: Kind::Float32, is_big_endian: false };

    /// The format with a name such as `S16LE`.
    pub fn named(name: &[u8]) -> Option<SampleFormat> {
        let name = name.to_ascii_uppercase();
        let (word, is_big_endian) = match name.strip_suffix(b"LE") {
            Some(word) => (word, false),
            None => name.strip_suffix(b"BE").map_or((&name[..], false), |word| (word, true)),
        };
        let kind = match word {
            b"U8" => Kind::Unsigned8,
            b"S8" => Kind::Signed8,
            b"S16" => Kind::Signed16,
            b"S24" => Kind::Signed24,
            b"S32" => Kind::Signed32,
            b"F32" => Kind::Float32,
            _ => return None,
        };
        Some(SampleFormat { kind, is_big_endian })
    }

    /// The length of a sample [bytes].
    pub fn bytes(self) -> usize {
        match self.kind {
            Kind::Unsigned8 | Kind::Signed8 => 1,
            Kind::Signed16 => 2,
            Kind::Signed24 => 3,
            Kind::Signed32 | Kind::Float32 => 4,
        }
    }

    /// The sample at the start of these bytes [full scale]; NaN if there are too few.
    fn sample(self, bytes: &[u8]) -> f64 {
        let mut word = [0; 4];
        let Some(bytes) = bytes.get(..self.bytes()) else { return f64::NAN };
        // Aligned at the high end, so that the sign is at the same position as in a 32-bit integer.
        let places = word[4 - bytes.len()..].iter_mut();
        if self.is_big_endian {
            places.zip(bytes.iter().rev()).for_each(|(to, byte)| *to = *byte);
        } else {
            places.zip(bytes).for_each(|(to, byte)| *to = *byte);
        }
        let number = i32::from_le_bytes(word);
        match self.kind {
            Kind::Float32 => f64::from(f32::from_le_bytes(word)),
            Kind::Unsigned8 => f64::from(number ^ i32::MIN) / -f64::from(i32::MIN),
            _ => f64::from(number) / -f64::from(i32::MIN),
        }
    }
}

/// The name that a sender gave its format, shortened for display.
fn shown(name: &[u8]) -> String {
    String::from_utf8_lossy(&name[..name.len().min(SHOWN_BYTES)]).into_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::cdr::Writer;

    fn info(channels: u8, rate: u32, format: &str, coding: &str) -> Vec<u8> {
        let mut writer = Writer::new();
        writer.write(&channels);
        writer.write(&rate);
        writer.text(format);
        writer.write(&256_000_u32);
        writer.text(coding);
        writer.finish().to_vec()
    }

    fn samples(format: &str, bytes: &[u8]) -> Vec<f64> {
        let format = SampleFormat::named(format.as_bytes()).unwrap();
        AudioInfo { rate_hz: 16_000.0, channels: 1, format }.first_channel(bytes).collect()
    }

    #[test]
    fn samples_of_every_format_are_of_full_scale() {
        assert_eq!(
            samples("S16LE", &[0, 0x40, 0, 0x80, 0xff, 0x7f]),
            [0.5, -1.0, 32_767.0 / 32_768.0]
        );
        assert_eq!(samples("S16BE", &[0x40, 0]), [0.5]);
        assert_eq!(samples("U8", &[128, 192, 0]), [0.0, 0.5, -1.0]);
        assert_eq!(samples("S8", &[0x40, 0x80]), [0.5, -1.0]);
        assert_eq!(samples("S24LE", &[0, 0, 0xc0]), [-0.5]);
        assert_eq!(samples("s32le", &[0, 0, 0, 0x20]), [0.25]);
        assert_eq!(samples("F32LE", &0.125_f32.to_le_bytes()), [0.125]);
        assert_eq!(samples("F32BE", &0.125_f32.to_be_bytes()), [0.125]);
    }

    #[test]
    fn the_first_channel_is_heard_and_half_a_sample_is_not() {
        let info = AudioInfo { rate_hz: 8_000.0, channels: 2, format: SampleFormat::S16LE };
        let data = [0, 0x40, 1, 1, 0, 0x20, 2, 2, 9];
        assert_eq!(info.first_channel(&data).collect::<Vec<_>>(), [0.5, 0.25]);
    }

    #[test]
    fn what_sound_is_can_be_read_or_is_named() {
        let read = AudioInfo::read(&info(1, 16_000, "S16LE", "wave")).unwrap();
        assert_eq!(read, AudioInfo { rate_hz: 16_000.0, channels: 1, format: SampleFormat::S16LE });
        for (message, words) in [
            (info(1, 16_000, "S16LE", "mp3"), "encoded as `mp3`"),
            (info(1, 16_000, "Q7", "wave"), "format `Q7`"),
            (info(0, 16_000, "S16LE", "wave"), "0 channels at 16000 Hz"),
            (vec![0, 1], "read the format of the sound"),
        ] {
            let error = AudioInfo::read(&message).unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }

    #[test]
    fn a_block_is_a_part_of_its_message_with_or_without_a_stamp() {
        let mut writer = Writer::new();
        writer.sequence(&[1_u8, 2, 3]);
        let block = AudioBlock::read(AUDIO_DATA, &writer.finish()).unwrap().unwrap();
        assert_eq!((block.stamp, &block.data[..]), (None, &[1, 2, 3][..]));
        let mut writer = Writer::new();
        let stamp = Time::from_stamp(7, 0);
        writer.write(&Header { stamp, ..Header::default() });
        writer.sequence(&[4_u8]);
        let block = AudioBlock::read(AUDIO_DATA_STAMPED, &writer.finish()).unwrap().unwrap();
        assert_eq!((block.stamp, &block.data[..]), (Some(stamp), &[4][..]));
        assert!(AudioBlock::read("std_msgs/msg/String", &Bytes::new()).is_none());
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes: Vec<u8>, format in "[SUF](8|16|24|32)(LE|BE)?", channels in 1_u8..4) {
            let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
            drop(AudioInfo::read(&message));
            for type_name in [AUDIO_DATA, AUDIO_DATA_STAMPED] {
                drop(AudioBlock::read(type_name, &message));
            }
            if let Some(format) = SampleFormat::named(format.as_bytes()) {
                let info = AudioInfo { rate_hz: 8_000.0, channels, format };
                prop_assert_eq!(info.first_channel(&bytes).count(), bytes.len() / info.frame_bytes());
            }
        }
    }
}
