use super::layout::Layout;
use crate::DecodeError;
use crate::cursor::{Cursor, signed};

/// Decompresses the samples of a payload, channel by channel: a whole sample, then blocks of a bit width, a count and
/// that many samples as differences from the previous one, packed from the lowest bit up.
pub(super) fn decompress(payload: &[u8], layout: &Layout) -> Result<Vec<i32>, DecodeError> {
    let truncated =
        |expected, got| DecodeError::Truncated { what: "a compressed payload", expected, got };
    let channels = layout.channels.len();
    let Some((reference, mut blocks)) = payload.split_at_checked(layout.sample_bytes()) else {
        return Err(truncated(layout.sample_bytes(), payload.len()));
    };
    let mut values: Vec<i32> = reference.chunks(reference.len() / channels).map(signed).collect();
    while !blocks.is_empty() {
        let mut header = Cursor::new("the header of a block", blocks);
        let (width, samples) = (u32::from(header.u8()?), usize::from(header.u8()?));
        if width > 32 {
            return Err(DecodeError::Unknown { what: "the bit width of a block", got: width });
        }
        let differences = samples * channels;
        let bytes = (differences * width as usize).div_ceil(8);
        let Some((packed, rest)) = header.rest().split_at_checked(bytes) else {
            return Err(truncated(bytes, header.rest().len()));
        };
        let mut bits = Bits { bytes: packed, held: 0, count: 0 };
        for _ in 0..differences {
            let before = values.get(values.len() - channels).copied().unwrap_or_default();
            values.push(before.wrapping_add(bits.signed(width)));
        }
        blocks = rest;
    }
    Ok(values)
}

/// Reads numbers of any width from bytes, from the lowest bit up.
struct Bits<'a> {
    bytes: &'a [u8],
    held: u64,
    count: u32,
}

impl Bits<'_> {
    fn signed(&mut self, width: u32) -> i32 {
        while self.count < width {
            let (byte, rest) = self.bytes.split_first().unwrap_or((&0, &[]));
            self.held |= u64::from(*byte) << self.count;
            self.count += 8;
            self.bytes = rest;
        }
        let number = self.held << (64 - width).min(63);
        self.held >>= width;
        self.count -= width;
        if width == 0 { 0 } else { (number as i64 >> (64 - width)) as i32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_any_width_is_read_from_the_lowest_bit_on() {
        let mut bits = Bits { bytes: &[0xbe, 0x5c, 0xbe, 0xba], held: 0, count: 0 };
        assert_eq!([10, 10, 10].map(|width| bits.signed(width)), [190, -105, -85]);
        let mut bits = Bits { bytes: &[0xff; 5], held: 0, count: 0 };
        assert_eq!([0, 1, 32, 7].map(|width| bits.signed(width)), [0, -1, -1, -1]);
    }
}
