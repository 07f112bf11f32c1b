//! Pictures in messages: files (`sensor_msgs/CompressedImage`) and pixels (`sensor_msgs/Image`), without a copy.

use bytes::Bytes;
use thiserror::Error;

use crate::cdr::{CdrError, Reader};
use crate::standard::std_msgs::Header;

/// The type of messages with files of pictures.
pub const COMPRESSED_IMAGE: &str = "sensor_msgs/msg/CompressedImage";
/// The type of messages with pixels.
pub const IMAGE: &str = "sensor_msgs/msg/Image";

/// The longest name of a format that is repeated in an error [bytes].
const SHOWN_BYTES: usize = 60;

/// A file with a picture, such as a JPEG.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFile {
    /// The sender's description of the file: `jpeg`, or `rgb8; jpeg compressed bgr8`.
    pub format: String,
    /// The file.
    pub bytes: Bytes,
}

/// Pixels, row by row from the top. All rows are present.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// The number of columns.
    pub width: u16,
    /// The number of rows.
    pub height: u16,
    /// The encoding of a pixel.
    pub encoding: Encoding,
    /// The length of the part of a row that holds pixels [bytes].
    row_bytes: usize,
    /// The length of a row [bytes].
    step: usize,
    rows: Bytes,
}

/// The encodings of a pixel, by the names of `sensor_msgs/image_encodings.hpp`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Red, green, blue: `rgb8`.
    Rgb8,
    /// Blue, green, red: `bgr8`, `8UC3`.
    Bgr8,
    /// Red, green, blue, opacity: `rgba8`.
    Rgba8,
    /// Blue, green, red, opacity: `bgra8`, `8UC4`.
    Bgra8,
    /// Grey: `mono8`, `8UC1`.
    Mono8,
    /// 16-bit grey or depth: `mono16`, `16UC1`.
    Mono16 {
        /// Whether the higher byte comes first.
        is_big_endian: bool,
    },
    /// Depth as 32-bit floats [m]: `32FC1`.
    Float32 {
        /// Whether the highest byte comes first.
        is_big_endian: bool,
    },
    /// Two pixels in four bytes, Y U Y V: `yuyv`, `yuv422_yuy2`.
    Yuyv,
}

/// Why a message has no readable picture.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PictureError {
    /// The message is truncated, or not of this type.
    #[error("the message can't be read: {0}")]
    Message(#[from] CdrError),
    /// Pixels in an unsupported encoding.
    #[error("pixels in the encoding `{0}` can't be read")]
    Encoding(String),
    /// Fewer pixels than announced, or none.
    #[error(
        "{width} × {height} pixels were announced, in rows of {step} bytes; {bytes} bytes arrived"
    )]
    Rows {
        /// The announced columns.
        width: u32,
        /// The announced rows.
        height: u32,
        /// The announced length of a row [bytes].
        step: u32,
        /// The number of bytes received.
        bytes: usize,
    },
}

impl PictureFile {
    /// Reads a `sensor_msgs/CompressedImage`.
    pub fn read(message: &Bytes) -> Result<PictureFile, PictureError> {
        let mut reader = Reader::new(message)?;
        reader.read::<Header>()?;
        let format = shown(reader.text()?);
        let count = reader.count(1)?;
        let bytes = message.slice_ref(reader.bytes(count)?);
        Ok(PictureFile { format, bytes })
    }
}

impl Encoding {
    fn named(name: &[u8], is_big_endian: bool) -> Option<Encoding> {
        Some(match name {
            b"rgb8" => Encoding::Rgb8,
            // The names of OpenCV's types do not state the order of colours; OpenCV uses this one.
            b"bgr8" | b"8UC3" => Encoding::Bgr8,
            b"rgba8" => Encoding::Rgba8,
            b"bgra8" | b"8UC4" => Encoding::Bgra8,
            b"mono8" | b"8UC1" => Encoding::Mono8,
            b"mono16" | b"16UC1" => Encoding::Mono16 { is_big_endian },
            b"32FC1" => Encoding::Float32 { is_big_endian },
            b"yuyv" | b"yuv422_yuy2" => Encoding::Yuyv,
            _ => return None,
        })
    }

    /// The ROS name of the encoding; if it has several, the usual one.
    pub fn name(self) -> &'static str {
        match self {
            Encoding::Rgb8 => "rgb8",
            Encoding::Bgr8 => "bgr8",
            Encoding::Rgba8 => "rgba8",
            Encoding::Bgra8 => "bgra8",
            Encoding::Mono8 => "mono8",
            Encoding::Mono16 { .. } => "mono16",
            Encoding::Float32 { .. } => "32FC1",
            Encoding::Yuyv => "yuyv",
        }
    }

    /// The length of a pixel [bytes].
    pub fn pixel_bytes(self) -> usize {
        match self {
            Encoding::Mono8 => 1,
            Encoding::Mono16 { .. } | Encoding::Yuyv => 2,
            Encoding::Rgb8 | Encoding::Bgr8 => 3,
            Encoding::Rgba8 | Encoding::Bgra8 | Encoding::Float32 { .. } => 4,
        }
    }
}

impl Pixels {
    /// Reads a `sensor_msgs/Image`.
    pub fn read(message: &Bytes) -> Result<Pixels, PictureError> {
        let mut reader = Reader::new(message)?;
        reader.read::<Header>()?;
        let (height, width): (u32, u32) = (reader.read()?, reader.read()?);
        let name = reader.text()?;
        let is_big_endian = reader.read::<u8>()? != 0;
        let step: u32 = reader.read()?;
        let count = reader.count(1)?;
        let rows = reader.bytes(count)?;
        let encoding = Encoding::named(name, is_big_endian)
            .ok_or_else(|| PictureError::Encoding(shown(name)))?;
        let unfit = || PictureError::Rows { width, height, step, bytes: rows.len() };
        let (Ok(columns), Ok(lines)) = (u16::try_from(width), u16::try_from(height)) else {
            return Err(unfit());
        };
        let row_bytes = usize::from(columns) * encoding.pixel_bytes();
        let is_whole = row_bytes > 0
            && lines > 0
            && step as usize >= row_bytes
            && rows.len() as u64 >= u64::from(step) * u64::from(height);
        if !is_whole {
            return Err(unfit());
        }
        let (rows, step) = (message.slice_ref(rows), step as usize);
        Ok(Pixels { width: columns, height: lines, encoding, row_bytes, step, rows })
    }

    /// The length of all pixels without padding [bytes].
    pub fn size(&self) -> usize {
        self.row_bytes * usize::from(self.height)
    }

    /// All pixels in one piece, if rows are not padded.
    pub fn unpadded(&self) -> Option<&[u8]> {
        (self.step == self.row_bytes).then(|| &self.rows[..self.size()])
    }

    /// The bytes of a pixel; `None` outside of the picture.
    pub fn pixel(&self, column: usize, row: usize) -> Option<&[u8]> {
        let bytes = self.encoding.pixel_bytes();
        let is_inside = column < usize::from(self.width) && row < usize::from(self.height);
        let begin = row * self.step + column * bytes;
        is_inside.then(|| self.rows.get(begin..begin + bytes)).flatten()
    }

    /// The rows without their padding.
    pub fn rows(&self) -> impl Iterator<Item = &[u8]> {
        let rows = self.rows.chunks(self.step).take(usize::from(self.height));
        rows.map(|row| &row[..self.row_bytes])
    }
}

/// The name that a sender gave its format, shortened for display.
fn shown(format: &[u8]) -> String {
    String::from_utf8_lossy(&format[..format.len().min(SHOWN_BYTES)]).into_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::cdr::Writer;
    use crate::standard::Message as _;
    use crate::standard::sensor_msgs::Image;

    fn image(encoding: &str, width: u32, height: u32, step: u32, data: Vec<u8>) -> Bytes {
        let encoding = encoding.to_owned();
        Image { height, width, encoding, step, data, ..Image::default() }.encode()
    }

    #[test]
    fn a_file_is_a_part_of_its_message() {
        let mut writer = Writer::new();
        writer.write(&Header::default());
        writer.text("jpeg");
        writer.sequence(&[1_u8, 2, 3]);
        let message = writer.finish();
        let file = PictureFile::read(&message).unwrap();
        assert_eq!((file.format.as_str(), &file.bytes[..]), ("jpeg", &[1, 2, 3][..]));
        assert!(message.as_ptr_range().contains(&file.bytes.as_ptr()));
    }

    #[test]
    fn rows_come_without_their_padding() {
        let pixels = Pixels::read(&image("mono8", 2, 2, 3, vec![1, 2, 9, 3, 4, 9])).unwrap();
        assert_eq!(pixels.rows().collect::<Vec<_>>(), [[1, 2], [3, 4]]);
        assert_eq!((pixels.unpadded(), pixels.size()), (None, 4));
        let pixels = Pixels::read(&image("mono8", 2, 2, 2, vec![1, 2, 3, 4])).unwrap();
        assert_eq!(pixels.unpadded(), Some(&[1, 2, 3, 4][..]));
    }

    #[test]
    fn what_is_not_whole_or_unknown_is_named() {
        let read = |message: &Bytes| Pixels::read(message).unwrap_err();
        assert_eq!(
            read(&image("rgb8", 640, 480, 1920, vec![0; 1000])).to_string(),
            "640 × 480 pixels were announced, in rows of 1920 bytes; 1000 bytes arrived"
        );
        for (width, height, step, bytes) in [
            (100_000, 1, 300_000, 300_000),
            (0, 0, 0, 0),
            (16, 8, 10, 400),
            (2, 70_000, 6, 420_000),
        ] {
            let error = read(&image("rgb8", width, height, step, vec![0; bytes]));
            assert!(matches!(error, PictureError::Rows { .. }), "{error}");
        }
        assert_eq!(
            read(&image("64FC1", 1, 1, 8, vec![0; 8])),
            PictureError::Encoding("64FC1".into())
        );
        assert!(matches!(read(&Bytes::from_static(b"\0\x01\0\0\x01")), PictureError::Message(_)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes: Vec<u8>) {
            let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
            drop(PictureFile::read(&message));
            if let Ok(pixels) = Pixels::read(&message) {
                prop_assert_eq!(pixels.rows().map(<[u8]>::len).sum::<usize>(), pixels.size());
            }
        }
    }
}
