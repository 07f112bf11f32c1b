//! The binary frame of a picture.
//!
//! Little-endian: u32 the stream's number, u32 0 (a wave has its channels there), f64 when it was taken [s], then a file
//! that browsers can show: JPEG, PNG or WebP; or a frame of H.264 in Annex B, which begins with a start code.

/// The length of what precedes the file [bytes].
pub const HEAD_BYTES: usize = 16;

/// What precedes the file.
pub fn head(stream: u32, t: f64) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(4 << 10);
    bytes.extend(stream.to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(t.to_le_bytes());
    bytes
}
