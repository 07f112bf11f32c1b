//! The binary frame of a picture.
//!
//! Little-endian: u32 stream number, u32 0 (the channel count for waves), f64 time at which it was taken [s], then a
//! file that browsers can show: JPEG, PNG or WebP; or an H.264 frame in Annex B, which begins with a start code.

/// The length of the header [bytes].
pub const HEAD_BYTES: usize = 16;

/// Returns the header that precedes the file.
pub fn head(stream: u32, t: f64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 << 10);
    bytes.extend(stream.to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(t.to_le_bytes());
    bytes
}
