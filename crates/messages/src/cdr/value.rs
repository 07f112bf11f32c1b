use teampulse_core::time::Time;

use super::{CdrError, Reader, Writer};

/// A value that can be serialised as CDR.
pub trait Cdr: Sized {
    /// The minimum number of bytes in the CDR form of the value, excluding padding.
    const LEAST_BYTES: usize = 1;

    /// Appends the value to a message.
    fn write(&self, to: &mut Writer);

    /// Reads the value from a message.
    fn read(from: &mut Reader<'_>) -> Result<Self, CdrError>;

    /// Appends a slice of values.
    fn write_all(items: &[Self], to: &mut Writer) {
        for item in items {
            item.write(to);
        }
    }

    /// Reads `count` values.
    fn read_all(count: usize, from: &mut Reader<'_>) -> Result<Vec<Self>, CdrError> {
        (0..count).map(|_| Self::read(from)).collect()
    }
}

macro_rules! numbers {
    ($($number:ty)*) => {$(
        impl Cdr for $number {
            const LEAST_BYTES: usize = size_of::<$number>();

            fn write(&self, to: &mut Writer) {
                to.align(Self::LEAST_BYTES);
                to.bytes(&self.to_le_bytes());
            }

            fn read(from: &mut Reader<'_>) -> Result<Self, CdrError> {
                let bytes = from.number()?;
                Ok(if from.is_big_endian() { Self::from_be_bytes(bytes) } else { Self::from_le_bytes(bytes) })
            }

            fn write_all(items: &[Self], to: &mut Writer) {
                let (bytes, _) = to.numbers(items.len(), Self::LEAST_BYTES).as_chunks_mut();
                for (bytes, item) in bytes.iter_mut().zip(items) {
                    *bytes = item.to_le_bytes();
                }
            }

            fn read_all(count: usize, from: &mut Reader<'_>) -> Result<Vec<Self>, CdrError> {
                let (numbers, _) = from.numbers(count, Self::LEAST_BYTES)?.as_chunks();
                let numbers = numbers.iter().copied();
                Ok(if from.is_big_endian() {
                    numbers.map(Self::from_be_bytes).collect()
                } else {
                    numbers.map(Self::from_le_bytes).collect()
                })
            }
        }
    )*};
}

numbers!(u8 i8 u16 i16 u32 i32 u64 i64 f32 f64);

impl Cdr for bool {
    fn write(&self, to: &mut Writer) {
        u8::from(*self).write(to);
    }

    fn read(from: &mut Reader<'_>) -> Result<bool, CdrError> {
        Ok(u8::read(from)? != 0)
    }
}

/// A string: its length and a terminating zero. Invalid UTF-8 is replaced character by character, so that
/// the messages of a robot with an old locale can still be read.
impl Cdr for String {
    const LEAST_BYTES: usize = 4;

    fn write(&self, to: &mut Writer) {
        to.text(self);
    }

    fn read(from: &mut Reader<'_>) -> Result<String, CdrError> {
        Ok(String::from_utf8_lossy(from.text()?).into_owned())
    }
}

/// A sequence: its length and its items.
impl<T: Cdr> Cdr for Vec<T> {
    const LEAST_BYTES: usize = 4;

    fn write(&self, to: &mut Writer) {
        to.sequence(self);
    }

    fn read(from: &mut Reader<'_>) -> Result<Vec<T>, CdrError> {
        let count = from.count(T::LEAST_BYTES)?;
        T::read_all(count, from)
    }
}

/// An array: only its items.
impl<T: Cdr, const N: usize> Cdr for [T; N] {
    fn write(&self, to: &mut Writer) {
        T::write_all(self, to);
    }

    fn read(from: &mut Reader<'_>) -> Result<[T; N], CdrError> {
        match T::read_all(N, from)?.try_into() {
            Ok(items) => Ok(items),
            Err(_) => unreachable!("as many items are read as were asked for"),
        }
    }
}

/// A `builtin_interfaces/Time`.
impl Cdr for Time {
    const LEAST_BYTES: usize = 8;

    fn write(&self, to: &mut Writer) {
        let (secs, nanos) = self.stamp();
        secs.write(to);
        nanos.write(to);
    }

    fn read(from: &mut Reader<'_>) -> Result<Time, CdrError> {
        Ok(Time::from_stamp(i32::read(from)?, u32::read(from)?))
    }
}
