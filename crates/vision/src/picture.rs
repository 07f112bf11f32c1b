//! Decoded pictures.

use bytes::Bytes;
use teampulse_messages::pictures::{
    COMPRESSED_IMAGE, Encoding, IMAGE, PictureError as Unreadable, PictureFile, Pixels,
};
use thiserror::Error;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The largest number of pixels in a picture; a larger one would need more than 120 MB.
pub const MOST_PIXELS: usize = 40_000_000;

/// A picture in red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// Three bytes per pixel, row by row from the top.
    pub rgb: Vec<u8>,
}

/// Why a picture cannot be decoded. The message fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PictureError {
    /// The message contains no readable picture.
    #[error("read a picture: {0}")]
    Message(#[from] Unreadable),
    /// The message has another type.
    #[error("read a picture from a {0}; expected {IMAGE} or {COMPRESSED_IMAGE}")]
    Type(String),
    /// The compressed format is not supported.
    #[error("decode a picture of format `{0}`; only JPEG is supported")]
    Format(String),
    /// The pixels are not colours.
    #[error(
        "use a picture of 16 or 32 bits per pixel: it holds distances, or grey levels without a fixed scale"
    )]
    Deep,
    /// The picture is too large.
    #[error("decode a picture of {width} × {height} pixels; at most {MOST_PIXELS} are supported")]
    Large {
        /// The number of columns.
        width: usize,
        /// The number of rows.
        height: usize,
    },
    /// The JPEG is damaged or truncated.
    #[error("decode a JPEG: {0}")]
    Jpeg(String),
}

impl Picture {
    /// Decodes the picture in a `sensor_msgs/msg/CompressedImage` (JPEG) or a `sensor_msgs/msg/Image`.
    pub fn read(type_name: &str, message: &Bytes) -> Result<Picture, PictureError> {
        match type_name {
            COMPRESSED_IMAGE => {
                let file = PictureFile::read(message)?;
                if !file.bytes.starts_with(&[0xff, 0xd8, 0xff]) {
                    return Err(PictureError::Format(file.format));
                }
                Picture::from_jpeg(&file.bytes)
            }
            IMAGE => Picture::from_pixels(&Pixels::read(message)?),
            other => Err(PictureError::Type(other.to_owned())),
        }
    }

    /// Decodes a JPEG. A truncated one is an error, rather than a picture with a grey lower part.
    pub fn from_jpeg(file: &[u8]) -> Result<Picture, PictureError> {
        let failed = |error: zune_jpeg::errors::DecodeErrors| PictureError::Jpeg(error.to_string());
        let options = DecoderOptions::default()
            .set_strict_mode(true)
            .set_max_width(usize::from(u16::MAX))
            .set_max_height(usize::from(u16::MAX))
            .jpeg_set_out_colorspace(ColorSpace::RGB);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
        decoder.decode_headers().map_err(failed)?;
        let (width, height) = decoder.dimensions().unwrap_or_default();
        if width * height > MOST_PIXELS {
            return Err(PictureError::Large { width, height });
        }
        if !ends(file) {
            return Err(PictureError::Jpeg("it is truncated".to_owned()));
        }
        let rgb = decoder.decode().map_err(failed)?;
        if rgb.len() != width * height * 3 {
            let message = format!("{width} × {height} pixels became {} bytes", rgb.len());
            return Err(PictureError::Jpeg(message));
        }
        Ok(Picture { width: width as u32, height: height as u32, rgb })
    }

    fn from_pixels(pixels: &Pixels) -> Result<Picture, PictureError> {
        let (width, height) = (usize::from(pixels.width), usize::from(pixels.height));
        if width * height > MOST_PIXELS {
            return Err(PictureError::Large { width, height });
        }
        let mut rgb = Vec::with_capacity(width * height * 3);
        for row in pixels.rows() {
            match pixels.encoding {
                Encoding::Rgb8 => rgb.extend_from_slice(row),
                Encoding::Bgr8 => {
                    rgb.extend(row.as_chunks().0.iter().flat_map(|[b, g, r]| [r, g, b]));
                }
                Encoding::Rgba8 => {
                    rgb.extend(row.as_chunks().0.iter().flat_map(|[r, g, b, _]| [r, g, b]));
                }
                Encoding::Bgra8 => {
                    rgb.extend(row.as_chunks().0.iter().flat_map(|[b, g, r, _]| [r, g, b]));
                }
                Encoding::Mono8 => rgb.extend(row.iter().flat_map(|grey| [grey; 3])),
                Encoding::Yuyv => yuyv(row, &mut rgb),
                Encoding::Mono16 { .. } | Encoding::Float32 { .. } => {
                    return Err(PictureError::Deep);
                }
            }
        }
        Ok(Picture { width: width as u32, height: height as u32, rgb })
    }

    /// Returns the red, green and blue of a pixel; `None` outside the picture.
    pub fn at(&self, column: u32, row: u32) -> Option<[u8; 3]> {
        if column >= self.width || row >= self.height {
            return None;
        }
        let place = row as usize * self.width as usize + column as usize;
        self.rgb.as_chunks().0.get(place).copied()
    }
}

/// Whether a JPEG has its end marker; some cameras fill the rest of their buffer with zeros.
fn ends(file: &[u8]) -> bool {
    let filled = file.iter().rev().take_while(|byte| **byte == 0).count();
    file[..file.len() - filled].ends_with(&[0xff, 0xd9])
}

/// Converts a row of pixel pairs that share their chroma.
fn yuyv(row: &[u8], rgb: &mut Vec<u8>) {
    let (pairs, odd) = row.as_chunks::<4>();
    for [first, blue, second, red] in pairs {
        rgb.extend(of_video(*first, *blue, *red));
        rgb.extend(of_video(*second, *blue, *red));
    }
    // The last pixel of an odd row has no chroma.
    if let [grey, ..] = odd {
        rgb.extend(of_video(*grey, 128, 128));
    }
}

/// Converts Y, Cb and Cr of cameras (ITU-R BT.601, limited range) to RGB, in 16.16 fixed point.
fn of_video(y: u8, blue: u8, red: u8) -> [u8; 3] {
    let (y, blue, red) = (i32::from(y) - 16, i32::from(blue) - 128, i32::from(red) - 128);
    let byte = |sum: i32| ((sum + 0x8000) >> 16).clamp(0, 255) as u8;
    let y = 76_309 * y;
    [byte(y + 104_597 * red), byte(y - 25_675 * blue - 53_279 * red), byte(y + 132_201 * blue)]
}

#[cfg(test)]
mod tests {
    use jpeg_encoder::{ColorType, Encoder};
    use proptest::prelude::*;
    use teampulse_messages::cdr::Writer;
    use teampulse_messages::standard::Message as _;
    use teampulse_messages::standard::sensor_msgs::Image;
    use teampulse_messages::standard::std_msgs::Header;

    use super::*;

    fn jpeg(width: u16, height: u16, colour: [u8; 3]) -> Vec<u8> {
        let mut file = Vec::new();
        let rgb = colour.repeat(usize::from(width) * usize::from(height));
        Encoder::new(&mut file, 95).encode(&rgb, width, height, ColorType::Rgb).unwrap();
        file
    }

    fn compressed(file: &[u8]) -> Bytes {
        let mut writer = Writer::new();
        writer.write(&Header::default());
        writer.text("jpeg");
        writer.sequence(file);
        writer.finish()
    }

    fn image(encoding: &str, width: u32, step: u32, data: Vec<u8>) -> Bytes {
        let (encoding, height) = (encoding.to_owned(), 1);
        Image { height, width, encoding, step, data, ..Image::default() }.encode()
    }

    #[test]
    fn a_jpeg_has_its_colours() {
        let picture = Picture::read(COMPRESSED_IMAGE, &compressed(&jpeg(40, 30, [200, 100, 50])));
        let picture = picture.unwrap();
        assert_eq!((picture.width, picture.height, picture.rgb.len()), (40, 30, 3600));
        for (is, was) in picture.at(39, 29).unwrap().into_iter().zip([200_u8, 100, 50]) {
            assert!(is.abs_diff(was) <= 3, "{is} {was}");
        }
        assert_eq!((picture.at(40, 0), picture.at(0, 30)), (None, None));
    }

    #[test]
    fn a_truncated_jpeg_is_refused_wherever_it_ends() {
        let file = jpeg(64, 64, [1, 2, 3]);
        for end in 3..file.len() - 1 {
            let error = Picture::from_jpeg(&file[..end]).unwrap_err();
            assert!(matches!(error, PictureError::Jpeg(_)), "{error}");
        }
        let padded = [&file[..], &[0; 100]].concat();
        Picture::from_jpeg(&padded).unwrap();
    }

    #[test]
    fn a_huge_jpeg_is_refused_before_it_takes_memory() {
        let mut file = jpeg(16, 16, [0; 3]);
        let frame = file.windows(2).position(|marker| marker == [0xff, 0xc0]).unwrap();
        file[frame + 5..frame + 9].copy_from_slice(&[0x27, 0x10, 0x27, 0x10]);
        let error = Picture::from_jpeg(&file).unwrap_err();
        assert_eq!(error, PictureError::Large { width: 10_000, height: 10_000 });
    }

    #[test]
    fn pixels_of_every_order_are_red_green_and_blue() {
        for (encoding, bytes, expected) in [
            ("rgb8", vec![1, 2, 3], [1, 2, 3]),
            ("bgr8", vec![3, 2, 1], [1, 2, 3]),
            ("rgba8", vec![1, 2, 3, 255], [1, 2, 3]),
            ("bgra8", vec![3, 2, 1, 255], [1, 2, 3]),
            ("mono8", vec![7], [7, 7, 7]),
            ("yuyv", vec![235, 128], [255, 255, 255]),
        ] {
            let step = bytes.len() as u32;
            let picture = Picture::read(IMAGE, &image(encoding, 1, step, bytes)).unwrap();
            assert_eq!(picture.at(0, 0), Some(expected), "{encoding}");
        }
        // Red of BT.601: Y 81, Cb 90, Cr 240.
        let picture = Picture::read(IMAGE, &image("yuyv", 2, 4, vec![81, 90, 81, 240])).unwrap();
        assert_eq!(picture.at(1, 0), Some([254, 0, 0]));
        let deep = Picture::read(IMAGE, &image("16UC1", 1, 2, vec![0, 1]));
        assert_eq!(deep, Err(PictureError::Deep));
    }

    #[test]
    fn what_holds_no_picture_is_named() {
        let error = Picture::read("std_msgs/msg/String", &Bytes::new()).unwrap_err();
        assert!(error.to_string().contains("std_msgs/msg/String"), "{error}");
        let error = Picture::read(COMPRESSED_IMAGE, &compressed(b"no picture")).unwrap_err();
        assert_eq!(error, PictureError::Format("jpeg".to_owned()));
        let error = Picture::read(COMPRESSED_IMAGE, &compressed(&[])).unwrap_err();
        assert_eq!(error, PictureError::Format("jpeg".to_owned()));
    }

    proptest! {
        #[test]
        fn any_bytes_are_decoded_or_refused(bytes: Vec<u8>, at: prop::sample::Index) {
            let mut file = jpeg(24, 24, [9, 99, 199]);
            let at = at.index(file.len());
            file.splice(at..(at + bytes.len()).min(file.len()), bytes.iter().copied());
            drop(Picture::from_jpeg(&file));
            drop(Picture::from_jpeg(&bytes));
            let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
            drop(Picture::read(IMAGE, &message));
            drop(Picture::read(COMPRESSED_IMAGE, &message));
        }
    }
}
