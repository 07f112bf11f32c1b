use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread;

use jpeg_encoder::{Encoder as Jpeg, ImageBuffer, JpegColorType};
use teampulse_core::fault::{lasting, passing};
use teampulse_core::outlet::Outlet;
use teampulse_core::panics::{at, watched};
use teampulse_core::stream::StreamId;
use teampulse_core::time::Time;

use super::capture::offer;
use super::format::Format;
use super::opened::Opened;
use super::picture;

/// The quality of JPEGs compressed here.
const QUALITY: u8 = 85;
/// The number of frames that may wait to be compressed; more are dropped, so that the camera is never blocked.
const MOST_WAITING: usize = 2;

/// Compresses frames on a separate thread.
pub(super) struct Encoder {
    frames: SyncSender<(Vec<u8>, Option<Time>)>,
    outlet: Outlet,
    stream: StreamId,
}

impl Encoder {
    pub fn start(opened: &Opened, stream: StreamId, outlet: Outlet, label: &str) -> Encoder {
        let (frames, waiting) = sync_channel::<(Vec<u8>, Option<Time>)>(MOST_WAITING);
        let (shape, own, label) = (Shape::of(opened), outlet.clone(), label.to_owned());
        let work = move || {
            let mut is_failing = false;
            for (frame, taken) in waiting {
                match shape.compressed(&frame) {
                    Ok(jpeg) => {
                        is_failing = false;
                        offer(&own, stream, picture::file(&jpeg, taken), taken);
                    }
                    Err(why) => {
                        own.lost(stream, 1);
                        if !is_failing {
                            own.happen(passing(format!(
                                "{label}: failed to compress a frame: {why}"
                            )));
                        }
                        is_failing = true;
                    }
                }
            }
        };
        let reporting = outlet.clone();
        let work = move || {
            if let Err(panic) = watched(work) {
                let place = at(&panic);
                reporting.happen(lasting(format!(
                    "a camera's frames are no longer compressed: {panic}{place}"
                )));
            }
        };
        // Without the thread, each frame is counted as lost.
        drop(thread::Builder::new().name("camera_jpeg".into()).spawn(work));
        Encoder { frames, outlet, stream }
    }

    /// Queues a frame, which is counted as lost if the previous ones are not compressed yet.
    pub fn take(&self, frame: &[u8], taken: Option<Time>) {
        match self.frames.try_send((frame.to_vec(), taken)) {
            Ok(()) => {}
            Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                self.outlet.lost(self.stream, 1);
            }
        }
    }
}

/// The layout of a frame's bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    format: Format,
    width: u16,
    height: u16,
    stride: usize,
    is_full_range: bool,
}

impl Shape {
    fn of(opened: &Opened) -> Shape {
        let side = |side: u32| u16::try_from(side).unwrap_or(u16::MAX);
        // In this format, two pixels share their chroma.
        let is_paired = opened.format == Format::Yuyv;
        let width = side(opened.width);
        Shape {
            format: opened.format,
            width: if is_paired { width & !1 } else { width },
            height: side(opened.height),
            stride: opened.stride,
            is_full_range: opened.is_full_range,
        }
    }

    fn compressed(&self, frame: &[u8]) -> Result<Vec<u8>, jpeg_encoder::EncodingError> {
        let mut jpeg = Vec::with_capacity(frame.len() / 4);
        Jpeg::new(&mut jpeg, QUALITY).encode_image(Rows { shape: self, frame })?;
        Ok(jpeg)
    }
}

/// A frame, as read by the encoder.
struct Rows<'a> {
    shape: &'a Shape,
    frame: &'a [u8],
}

impl ImageBuffer for Rows<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        match self.shape.format {
            Format::Grey => JpegColorType::Luma,
            _ => JpegColorType::Ycbcr,
        }
    }

    fn width(&self) -> u16 {
        self.shape.width
    }

    fn height(&self) -> u16 {
        self.shape.height
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let Shape { format, width, stride, is_full_range, .. } = *self.shape;
        let begin = usize::from(y) * stride;
        let count = usize::from(width) * format.pixel_bytes().unwrap_or(0);
        let row = &self.frame[begin..begin + count];
        match format {
            Format::Grey => buffers[0].extend_from_slice(row),
            Format::Rgb => {
                for pixel in row.chunks_exact(3) {
                    let (y, cb, cr) = jpeg_encoder::rgb_to_ycbcr(pixel[0], pixel[1], pixel[2]);
                    push(buffers, [y, cb, cr]);
                }
            }
            _ => {
                for pair in row.chunks(4) {
                    let &[one, cb, other, cr] = pair else { continue };
                    let [cb, cr] = [cb, cr].map(|each| colour(each, is_full_range));
                    for brightness in [one, other] {
                        push(buffers, [luma(brightness, is_full_range), cb, cr]);
                    }
                }
            }
        }
    }
}

fn push(buffers: &mut [Vec<u8>; 4], parts: [u8; 3]) {
    buffers.iter_mut().zip(parts).for_each(|(buffer, part)| buffer.push(part));
}

/// Converts luma from 16–235, the video range, to 0–255, the JPEG range (ITU-R BT.601).
fn luma(number: u8, is_full_range: bool) -> u8 {
    if is_full_range {
        return number;
    }
    let stretched = ((i32::from(number) - 16) * 255 + 109) / 219;
    stretched.clamp(0, 255) as u8
}

/// Converts chroma from 16–240 to 0–255 likewise.
fn colour(number: u8, is_full_range: bool) -> u8 {
    if is_full_range {
        return number;
    }
    let apart = (i32::from(number) - 128) * 255;
    let stretched = 128 + (apart + 112 * apart.signum()) / 224;
    stretched.clamp(0, 255) as u8
}

#[cfg(test)]
mod tests {
    use zune_jpeg::JpegDecoder;
    use zune_jpeg::zune_core::bytestream::ZCursor;

    use super::*;

    /// The pixels of a compressed frame: red, green, blue, or grey.
    fn decoded(shape: Shape, frame: &[u8]) -> Vec<u8> {
        let jpeg = shape.compressed(frame).unwrap();
        JpegDecoder::new(ZCursor::new(&jpeg)).decode().unwrap()
    }

    fn shape(format: Format, stride: usize) -> Shape {
        Shape { format, width: 16, height: 8, stride, is_full_range: false }
    }

    /// Frames of one colour, with rows padded by 4 bytes.
    fn frame(pixels: &[u8]) -> (Vec<u8>, usize) {
        let row =
            [pixels.repeat(16 / (if pixels.len() == 4 { 2 } else { 1 })), vec![7; 4]].concat();
        (row.repeat(8), row.len())
    }

    #[test]
    fn pixels_have_their_colours() {
        // Y, Cb and Cr of the 75 % colour bars of BT.601, and their values in the range 0 to 255.
        for (y, cb, cr, expected) in [
            (180, 128, 128, [191, 191, 191]),
            (65, 100, 212, [191, 0, 0]),
            (112, 72, 58, [0, 191, 0]),
            (35, 212, 114, [0, 0, 191]),
            (16, 128, 128, [0, 0, 0]),
            (235, 128, 128, [255, 255, 255]),
        ] {
            let (pixels, stride) = frame(&[y, cb, y, cr]);
            let seen = decoded(shape(Format::Yuyv, stride), &pixels);
            assert_eq!(seen.len(), 16 * 8 * 3);
            for (is, expected) in seen.iter().zip(expected.iter().cycle()) {
                assert!(is.abs_diff(*expected) <= 3, "{:?} of {expected}", &seen[..3]);
            }
        }
    }

    #[test]
    fn colours_and_greys_stay_as_they_are() {
        let (pixels, stride) = frame(&[200, 100, 50]);
        let seen = decoded(shape(Format::Rgb, stride), &pixels);
        assert!(
            seen.iter().zip([200, 100, 50].iter().cycle()).all(|(is, was)| is.abs_diff(*was) <= 3)
        );
        let (pixels, stride) = frame(&[77]);
        let seen = decoded(shape(Format::Grey, stride), &pixels);
        assert!(seen.iter().all(|is| is.abs_diff(77) <= 1));
    }

    #[test]
    fn all_of_a_full_range_stays() {
        for number in [0, 16, 128, 235, 255] {
            assert_eq!((luma(number, true), colour(number, true)), (number, number));
        }
        assert_eq!([0, 16, 235, 255].map(|number| luma(number, false)), [0, 0, 255, 255]);
        assert_eq!(
            [0, 16, 128, 240, 255].map(|number| colour(number, false)),
            [0, 0, 128, 255, 255]
        );
    }
}
