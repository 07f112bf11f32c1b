//! The compressions of a ROS 1 bag.

use std::borrow::Cow;
use std::io::{self, Read};

use crate::read::records::LIMIT_BYTES;

/// The records of a chunk, as far as they can be decompressed, and why the rest can't be.
pub(super) fn contents<'a>(
    data: &'a [u8],
    compression: Option<&[u8]>,
) -> (Cow<'a, [u8]>, Option<String>) {
    match compression {
        None | Some(b"none" | b"") => (Cow::Borrowed(data), None),
        Some(b"bz2") => decompressed(bzip2::read::BzDecoder::new(data)),
        Some(b"lz4") => match lz4::Decoder::new(data) {
            Ok(decoder) => decompressed(decoder),
            Err(error) => (Cow::Borrowed(&[]), Some(error.to_string())),
        },
        Some(other) => {
            let name: String = String::from_utf8_lossy(other).chars().take(20).collect();
            (Cow::Borrowed(&[]), Some(format!("its compression {name:?} is not known")))
        }
    }
}

fn decompressed<'a>(decoder: impl Read) -> (Cow<'a, [u8]>, Option<String>) {
    let mut plain = Vec::new();
    let read = decoder.take(LIMIT_BYTES + 1).read_to_end(&mut plain);
    let large = || io::Error::other("it unpacks to more than the largest chunk");
    let is_large = plain.len() as u64 > LIMIT_BYTES;
    let read = if is_large { Err(large()) } else { read };
    (Cow::Owned(plain), read.err().map(|error| error.to_string()))
}
