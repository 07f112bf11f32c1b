//! The compressions of a ROS 1 bag.

use std::borrow::Cow;
use std::io::{self, Read};

/// Decompresses the records of a chunk as far as possible, to `most_bytes` at most; also returns why the rest can't be
/// decompressed.
pub(super) fn contents<'a>(
    data: &'a [u8],
    compression: Option<&[u8]>,
    most_bytes: u64,
) -> (Cow<'a, [u8]>, Option<String>) {
    match compression {
        None | Some(b"none" | b"") => (Cow::Borrowed(data), None),
        Some(b"bz2") => decompressed(bzip2::read::BzDecoder::new(data), most_bytes),
        Some(b"lz4") => match lz4::Decoder::new(data) {
            Ok(decoder) => decompressed(decoder, most_bytes),
            Err(error) => (Cow::Borrowed(&[]), Some(error.to_string())),
        },
        Some(other) => {
            let name: String = String::from_utf8_lossy(other).chars().take(20).collect();
            (Cow::Borrowed(&[]), Some(format!("its compression {name:?} is not known")))
        }
    }
}

fn decompressed<'a>(decoder: impl Read, most_bytes: u64) -> (Cow<'a, [u8]>, Option<String>) {
    let mut plain = Vec::new();
    let read = decoder.take(most_bytes + 1).read_to_end(&mut plain);
    let is_large = plain.len() as u64 > most_bytes;
    let large = || io::Error::other("it unpacks to far more than its size");
    let read = if is_large { Err(large()) } else { read };
    (Cow::Owned(plain), read.err().map(|error| error.to_string()))
}
