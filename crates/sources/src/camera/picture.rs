//! Pictures as messages, each copied out of the driver's memory only once.

use bytes::Bytes;
use teampulse_core::time::Time;
use teampulse_messages::cdr::Writer;
use teampulse_messages::standard::std_msgs::Header;

/// The size of a picture message without its pixel data [bytes].
const AROUND_BYTES: usize = 128;

/// A JPEG file as `sensor_msgs/CompressedImage`.
pub(super) fn file(jpeg: &[u8], taken: Option<Time>) -> Bytes {
    let mut writer = begin(jpeg.len(), taken);
    writer.text("jpeg");
    writer.byte_sequence(&[jpeg]);
    writer.finish()
}

/// Distances as `sensor_msgs/Image`, with rows of this length [bytes].
pub(super) fn distances(
    rows: &[u8],
    (width, height): (u32, u32),
    stride: usize,
    taken: Option<Time>,
) -> Bytes {
    let step = 2 * width as usize;
    let mut writer = begin(step * height as usize, taken);
    writer.write(&height);
    writer.write(&width);
    writer.text("16UC1");
    writer.write(&0_u8);
    writer.write(&(2 * width));
    let rows: Vec<&[u8]> =
        rows.chunks(stride).take(height as usize).map(|row| &row[..step]).collect();
    writer.byte_sequence(&rows);
    writer.finish()
}

fn begin(bytes: usize, taken: Option<Time>) -> Writer {
    let mut writer = Writer::with_room(bytes + AROUND_BYTES);
    writer.write(&Header::at(taken.unwrap_or(Time::EPOCH)));
    writer
}

#[cfg(test)]
mod tests {
    use super::*;
    use teampulse_messages::pictures::{Encoding, PictureFile, Pixels};

    const TAKEN: Time = Time::from_nanos(1_700_000_000_123_456_789);

    #[test]
    fn a_file_is_in_its_message_byte_for_byte() {
        let jpeg: Vec<u8> = (0..=255).collect();
        let read = PictureFile::read(&file(&jpeg, Some(TAKEN))).unwrap();
        assert_eq!((read.format.as_str(), &read.bytes[..]), ("jpeg", &jpeg[..]));
    }

    #[test]
    fn distances_are_in_rows_without_what_fills_them() {
        let rows = [1, 0, 2, 0, 99, 99, 3, 0, 4, 1];
        let message = distances(&rows, (2, 2), 6, Some(TAKEN));
        let read = Pixels::read(&message).unwrap();
        assert_eq!((read.width, read.height), (2, 2));
        assert_eq!(read.encoding, Encoding::Mono16 { is_big_endian: false });
        let read: Vec<&[u8]> = read.rows().collect();
        assert_eq!(read, [&[1, 0, 2, 0], &[3, 0, 4, 1]]);
    }
}
