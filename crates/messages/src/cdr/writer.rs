use bytes::Bytes;

use super::Cdr;

const HEADER: [u8; 4] = [0, 1, 0, 0];
/// The initial room for a message of unknown size [bytes]: enough for samples and features of a few numbers.
const USUAL_ROOM: usize = 124;

/// Writes values into a message in order.
#[derive(Clone, Debug)]
pub struct Writer(Vec<u8>);

impl Writer {
    /// Creates a message with only its header.
    pub fn new() -> Writer {
        Writer::with_room(USUAL_ROOM)
    }

    /// Creates a message with only its header, and room for this many bytes after it.
    pub fn with_room(bytes: usize) -> Writer {
        let mut message = Vec::with_capacity(HEADER.len() + bytes);
        message.extend_from_slice(&HEADER);
        Writer(message)
    }

    /// Appends a value.
    pub fn write<T: Cdr>(&mut self, value: &T) {
        value.write(self);
    }

    /// Appends a string.
    pub fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.bytes(text.as_bytes());
        self.bytes(&[0]);
    }

    /// Appends a sequence.
    pub fn sequence<T: Cdr>(&mut self, items: &[T]) {
        self.count(items.len());
        T::write_all(items, self);
    }

    /// Appends a sequence of bytes, given in parts.
    pub fn byte_sequence(&mut self, parts: &[&[u8]]) {
        self.count(parts.iter().map(|part| part.len()).sum());
        for part in parts {
            self.bytes(part);
        }
    }

    /// Appends raw bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Pads to a multiple of `width` bytes, counted from the end of the header.
    pub fn align(&mut self, width: usize) {
        let body = self.0.len() - HEADER.len();
        self.0.resize(HEADER.len() + body.next_multiple_of(width), 0);
    }

    /// Appends the length of a sequence, which must fit in a `u32`.
    fn count(&mut self, count: usize) {
        self.write(&u32::try_from(count).expect("a message is shorter than 4 GiB"));
    }

    /// Makes room for `count` numbers of `width` bytes each, after their padding.
    pub fn numbers(&mut self, count: usize, width: usize) -> &mut [u8] {
        if count > 0 {
            self.align(width);
        }
        let begin = self.0.len();
        self.0.resize(begin + count * width, 0);
        &mut self.0[begin..]
    }

    /// The number of bytes so far, including the header.
    pub fn size(&self) -> usize {
        self.0.len()
    }

    /// Returns the message.
    pub fn finish(self) -> Bytes {
        Bytes::from(self.0)
    }
}

impl Default for Writer {
    fn default() -> Writer {
        Writer::new()
    }
}
