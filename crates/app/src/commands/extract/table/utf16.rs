//! Tables in UTF-16, as spreadsheets and programs on Windows write them.

use std::io::{self, Cursor, Read};

/// The number of bytes that are decoded at once.
const BLOCK: usize = 1 << 16;

/// Returns the bytes of a table as UTF-8, and how many bytes of the file correspond to each of them: two if the file is
/// in UTF-16. UTF-16 is detected by its byte-order mark, or by a zero byte in its first character, which no other text
/// contains.
pub fn as_utf8(mut input: Box<dyn Read + Send>) -> io::Result<(Box<dyn Read + Send>, u64)> {
    let mut begin = Vec::with_capacity(2);
    (&mut input).take(2).read_to_end(&mut begin)?;
    let unit: Option<fn([u8; 2]) -> u16> = match begin[..] {
        [0xff, 0xfe] | [b' '..=b'~', 0] => Some(u16::from_le_bytes),
        [0xfe, 0xff] | [0, b' '..=b'~'] => Some(u16::from_be_bytes),
        _ => None,
    };
    let input = Cursor::new(begin).chain(input);
    Ok(match unit {
        Some(unit) => {
            (Box::new(Utf16 { input, unit, rest: Vec::new(), ready: Cursor::default() }), 2)
        }
        None => (Box::new(input), 1),
    })
}

/// A text in UTF-16, decoded block by block.
struct Utf16<R> {
    input: R,
    /// Combines the two bytes of a code unit.
    unit: fn([u8; 2]) -> u16,
    /// The bytes of an incomplete character.
    rest: Vec<u8>,
    /// UTF-8 that has not been returned yet.
    ready: Cursor<Vec<u8>>,
}

impl<R: Read> Utf16<R> {
    /// Decodes the next block; false at the end of the text.
    fn decode(&mut self) -> io::Result<bool> {
        let mut bytes = std::mem::take(&mut self.rest);
        let held = bytes.len();
        bytes.resize(held + BLOCK, 0);
        let read = self.input.read(&mut bytes[held..])?;
        bytes.truncate(held + read);
        let pairs = bytes.chunks_exact(2).map(|pair| (self.unit)([pair[0], pair[1]]));
        let mut units: Vec<u16> = pairs.collect();
        if read > 0 {
            let is_halved = units.last().is_some_and(|unit| (0xd800..0xdc00).contains(unit));
            units.truncate(units.len() - usize::from(is_halved));
            self.rest = bytes.split_off(2 * units.len());
        }
        self.ready = Cursor::new(String::from_utf16_lossy(&units).into_bytes());
        Ok(read > 0)
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let mut goes_on = true;
        loop {
            let read = self.ready.read(into)?;
            if read > 0 || into.is_empty() || !goes_on {
                return Ok(read);
            }
            goes_on = self.decode()?;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns a few bytes at a time, as a pipe may.
    struct Slow(Cursor<Vec<u8>>, usize);

    impl Read for Slow {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let length = into.len().min(self.1);
            self.0.read(&mut into[..length])
        }
    }

    fn read(bytes: Vec<u8>, at_once: usize) -> Vec<u8> {
        let (mut input, _) = as_utf8(Box::new(Slow(Cursor::new(bytes), at_once))).unwrap();
        let mut read = Vec::new();
        input.read_to_end(&mut read).unwrap();
        read
    }

    proptest! {
        #[test]
        fn utf_16_is_the_same_text_in_any_pieces(text: String, is_big: bool, at_once in 1..9_usize) {
            let bytes = |unit: u16| if is_big { unit.to_be_bytes() } else { unit.to_le_bytes() };
            let marked = format!("\u{feff}{text}");
            let wide = marked.encode_utf16().flat_map(bytes).collect();
            prop_assert_eq!(read(wide, at_once), marked.into_bytes());
        }

        #[test]
        fn all_else_stays_as_it_is(bytes: Vec<u8>, at_once in 1..9_usize) {
            let is_wide = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") || bytes.iter().take(2).any(|byte| *byte == 0);
            prop_assume!(!is_wide);
            prop_assert_eq!(read(bytes.clone(), at_once), bytes);
        }
    }

    #[test]
    fn a_mark_may_be_missing_and_the_end_torn() {
        assert_eq!(read(b"e\0c\0g\0\n\0".to_vec(), 3), b"ecg\n");
        assert_eq!(read(b"\0e\0c\0g\0\n".to_vec(), 3), b"ecg\n");
        assert_eq!(read(b"1\x002\0\n".to_vec(), 3), b"12");
        assert_eq!(read(b"\xff\xfe1\0\x00\xd8".to_vec(), 3), "\u{feff}1\u{fffd}".as_bytes());
        for short in [&b""[..], b"7", b"\x00\x01\x02"] {
            assert_eq!(read(short.to_vec(), 1), short);
        }
    }
}
