use super::{Cdr, CdrError};

/// Reads the values of a message in order.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    body: &'a [u8],
    at: usize,
    big_endian: bool,
    widest_alignment: usize,
}

impl<'a> Reader<'a> {
    /// Starts at the first value of a message with its four-byte header.
    pub fn new(cdr: &'a [u8]) -> Result<Reader<'a>, CdrError> {
        let (header, body) = cdr.split_first_chunk::<4>().ok_or(CdrError::NoHeader(cdr.len()))?;
        let (big_endian, widest_alignment) = match u16::from_be_bytes([header[0], header[1]]) {
            0 => (true, 8),
            1 => (false, 8),
            6 => (true, 4),
            7 => (false, 4),
            other => return Err(CdrError::Representation(other)),
        };
        Ok(Reader { body, at: 0, big_endian, widest_alignment })
    }

    /// Reads the next value.
    pub fn read<T: Cdr>(&mut self) -> Result<T, CdrError> {
        T::read(self)
    }

    /// The number of remaining bytes, including padding.
    pub fn left(&self) -> usize {
        self.body.len() - self.at
    }

    /// Whether numbers are in big-endian byte order.
    pub fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// Reads the next `count` bytes.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        self.expect(count, 1)?;
        let bytes = &self.body[self.at..self.at + count];
        self.at += count;
        Ok(bytes)
    }

    /// Reads the bytes of the next number, after its padding.
    pub fn number<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.align(N)?;
        let number = self.body[self.at..].first_chunk().ok_or(self.short(N as u64))?;
        self.at += N;
        Ok(*number)
    }

    /// Reads the bytes of the next `count` numbers of `width` bytes each, after their padding.
    pub fn numbers(&mut self, count: usize, width: usize) -> Result<&'a [u8], CdrError> {
        if count == 0 {
            return Ok(&[]);
        }
        self.align(width)?;
        self.expect(count, width)?;
        self.bytes(count * width)
    }

    /// Reads the length of a sequence whose items have at least `item_bytes`; checks that it fits into the
    /// remaining bytes.
    pub fn count(&mut self, item_bytes: usize) -> Result<usize, CdrError> {
        let count = self.read::<u32>()? as usize;
        self.expect(count, item_bytes)?;
        Ok(count)
    }

    /// Reads the bytes of the next string, without its terminating zero.
    pub fn text(&mut self) -> Result<&'a [u8], CdrError> {
        let count = self.count(1)?;
        let bytes = self.bytes(count)?;
        Ok(bytes.strip_suffix(b"\0").unwrap_or(bytes))
    }

    /// Reads the next string of 16-bit units, without its terminating zero.
    pub fn wide_text(&mut self) -> Result<String, CdrError> {
        let units: Vec<u16> = self.read()?;
        let text = units.strip_suffix(&[0]).unwrap_or(&units);
        Ok(String::from_utf16_lossy(text))
    }

    fn align(&mut self, width: usize) -> Result<(), CdrError> {
        let padding = self.at.next_multiple_of(width.min(self.widest_alignment)) - self.at;
        self.bytes(padding).map(|_| ())
    }

    fn expect(&self, count: usize, item_bytes: usize) -> Result<(), CdrError> {
        let needed = (count as u64).saturating_mul(item_bytes as u64);
        if needed > self.left() as u64 { Err(self.short(needed)) } else { Ok(()) }
    }

    fn short(&self, needed: u64) -> CdrError {
        CdrError::Short { needed, at: self.at, left: self.left() }
    }
}
