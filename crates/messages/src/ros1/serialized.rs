use super::Ros1Error;
use crate::cdr::Writer;
use crate::definition::{Count, EMPTY, Field, Kind, Struct};

/// The limit on a message's size as CDR: this multiple of its size, plus this many bytes. Padding at most doubles it;
/// only empty messages, for which ROS 1 writes nothing and ROS 2 one byte each, make it larger.
const MOST_TIMES: usize = 16;
const MOST_MORE: usize = 1024;

/// The only type whose fields differ from those in ROS 1.
const HEADER: &str = "std_msgs/msg/Header";

/// The rest of a ROS 1 message.
pub(super) struct Serialized<'a> {
    message: &'a [u8],
    at: usize,
    has_sequence_numbers: bool,
}

impl<'a> Serialized<'a> {
    pub fn new(message: &'a [u8], has_sequence_numbers: bool) -> Serialized<'a> {
        Serialized { message, at: 0, has_sequence_numbers }
    }

    /// Fails if something follows the last field.
    pub fn ended(&self) -> Result<(), Ros1Error> {
        let (length, at) = (self.message.len(), self.at);
        if at == length { Ok(()) } else { Err(Ros1Error::Long { length, at }) }
    }

    /// Converts the next value, which is a message.
    pub fn convert(&mut self, kind: &Struct, to: &mut Writer) -> Result<(), Ros1Error> {
        let most_bytes = self.message.len().saturating_mul(MOST_TIMES).saturating_add(MOST_MORE);
        if to.size() > most_bytes {
            return Err(Ros1Error::Large(most_bytes));
        }
        if self.has_sequence_numbers && kind.name == HEADER {
            self.take(4)?;
        }
        kind.fields.iter().try_for_each(|field| self.field(field, to))
    }

    fn field(&mut self, field: &Field, to: &mut Writer) -> Result<(), Ros1Error> {
        if field.name == EMPTY {
            to.write(&0_u8);
            return Ok(());
        }
        let count = match field.count {
            Count::One => 1,
            Count::Array(count) => usize::try_from(count).unwrap_or(usize::MAX),
            Count::AtMost(_) | Count::Any => {
                let count = self.number()?;
                to.write(&count);
                count as usize
            }
        };
        match &field.kind {
            Kind::Number(number) => self.numbers(count, number.bytes(), to),
            Kind::Text(_) | Kind::WideText(_) => (0..count).try_for_each(|_| self.text(to)),
            Kind::Struct(nested) => (0..count).try_for_each(|_| self.convert(nested, to)),
        }
    }

    fn numbers(&mut self, count: usize, width: usize, to: &mut Writer) -> Result<(), Ros1Error> {
        let bytes = self.take(count.saturating_mul(width))?;
        to.numbers(count, width).copy_from_slice(bytes);
        Ok(())
    }

    /// Converts a string; ROS 1 strings don't end with a zero.
    fn text(&mut self, to: &mut Writer) -> Result<(), Ros1Error> {
        let length = self.number()?;
        let text = self.take(length as usize)?;
        to.write(&length.saturating_add(1));
        to.bytes(text);
        to.bytes(&[0]);
        Ok(())
    }

    fn number(&mut self) -> Result<u32, Ros1Error> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    fn take(&mut self, needed: usize) -> Result<&'a [u8], Ros1Error> {
        let rest = &self.message[self.at..];
        let short = Ros1Error::Short { needed, at: self.at, left: rest.len() };
        let bytes = rest.get(..needed).ok_or(short)?;
        self.at += needed;
        Ok(bytes)
    }
}
