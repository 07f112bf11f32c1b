#![doc = include_str!("../README.md")]

mod recording;
mod error;
mod cursor;
mod date;
pub mod e4;
mod avro;
pub mod embrace_plus;
pub mod edf;
pub mod xdf;

pub use date::StatedDate;
pub use error::FormatError;
pub use recording::{Channel, Content, MOST_VALUES, Mark, Quantity, Recording, Run, Signal};

/// Reads the bytes of a file.
type Reader = fn(&[u8]) -> Result<Recording, FormatError>;

/// Reads a file of any of the formats; `None` if its first bytes match none of them.
pub fn read(bytes: &[u8]) -> Option<Result<Recording, FormatError>> {
    let readers: [(&[u8], Reader); 5] = [
        (e4::MAGIC, e4::read),
        (embrace_plus::MAGIC, embrace_plus::read),
        (xdf::MAGIC, xdf::read),
        (edf::EDF_MAGIC, edf::read),
        (edf::BDF_MAGIC, edf::read),
    ];
    let (_, read) = readers.into_iter().find(|(magic, _)| bytes.starts_with(magic))?;
    Some(read(bytes))
}
