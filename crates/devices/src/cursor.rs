use crate::DecodeError;

/// Reads little-endian fields in sequence.
pub(crate) struct Cursor<'a> {
    what: &'static str,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub fn new(what: &'static str, bytes: &'a [u8]) -> Self {
        Self { what, bytes, at: 0 }
    }

    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], DecodeError> {
        let Some((field, _)) = self.rest().split_first_chunk() else {
            let (expected, got) = (self.at + N, self.bytes.len());
            return Err(DecodeError::Truncated { what: self.what, expected, got });
        };
        self.at += N;
        Ok(*field)
    }

    pub fn u8(&mut self) -> Result<u8, DecodeError> {
        self.array::<1>().map(|[byte]| byte)
    }

    pub fn u16(&mut self) -> Result<u16, DecodeError> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, DecodeError> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }
}

/// Decodes a little-endian two's complement number of one to four bytes.
pub(crate) fn signed(bytes: &[u8]) -> i32 {
    let unused = 32 - 8 * bytes.len().clamp(1, 4) as u32;
    (unsigned(bytes) << unused) as i32 >> unused
}

/// Decodes a little-endian unsigned number of one to four bytes.
pub(crate) fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}
