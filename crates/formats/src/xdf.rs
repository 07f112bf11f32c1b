//! XDF, the format of LSL's `LabRecorder`: several streams on the recorder's clock.
//!
//! A file is `XDF:` and chunks, each with its length, a tag and its content: 1 the file's header, 2 and 6 the
//! header and the footer of a stream (XML), 3 samples, 4 the offset of a stream's clock, 5 a boundary. Source:
//! <https://github.com/sccn/xdf/wiki/Specifications>.
//!
//! After a chunk that can't be read, reading continues with the next chunk if one follows it, or else after the next
//! boundary, as in `pyxdf`. A sample without a stamp is placed one period after the previous sample; after a part that
//! can't be read, it is left out.
//!
//! Stamps are by the clock of the computer that sent the stream. A line through the measured offsets converts them to
//! the recorder's clock; if a computer was restarted or replaced, each of its clocks has its own line. The recorder's
//! clock counts from the start of its computer, and so has no date: the date in the file's header, when the recording
//! began, is taken for the first sample. Stamps of evenly sampled streams have the jitter of the network: each stretch
//! between gaps becomes a run, timed by a line through its stamps. `pyxdf` does the same, but finds only gaps of more
//! than a second and 500 samples.

mod chunks;
mod clock;
mod gaps;
mod header;
mod resets;
mod samples;
mod streams;
mod unread;

use crate::date::StatedDate;
use crate::error::FormatError;
use crate::recording::Recording;

use chunks::{Chunk, Chunks, Tag};
use header::element;
use streams::Streams;

/// The first bytes of a file.
pub const MAGIC: &[u8] = b"XDF:";

/// Reads a file.
pub fn read(bytes: &[u8]) -> Result<Recording, FormatError> {
    let (mut chunks, mut contents) = (Chunks::new(bytes)?, Contents::default());
    let mut malformed = None;
    while let Some(chunk) = chunks.next() {
        match chunk.and_then(|chunk| contents.take(chunk)) {
            Ok(()) => {}
            Err(FormatError::TooLarge) => return Err(FormatError::TooLarge),
            Err(error) => {
                malformed = malformed.or(Some(error).filter(is_malformed));
                chunks.skip();
                contents.streams.interrupt();
            }
        }
    }
    let Contents { streams, began } = contents;
    let mut notes = chunks.unread().notes(streams.unstamped());
    let (signals, left_out) = streams.finish();
    notes.extend(left_out);
    if signals.is_empty() {
        return Err(malformed.unwrap_or(FormatError::Empty("stream with samples")));
    }
    let first_ns = signals.iter().filter_map(|signal| signal.content.first_ns()).min();
    let date = began.zip(first_ns).and_then(|(began, first_ns): (StatedDate, i64)| {
        Some(StatedDate { zero_ns: began.zero_ns.checked_sub(first_ns)?, ..began })
    });
    Ok(Recording { date, signals, notes, ..Recording::default() })
}

/// The contents of the chunks so far.
#[derive(Default)]
struct Contents {
    streams: Streams,
    began: Option<StatedDate>,
}

impl Contents {
    fn take(&mut self, Chunk { tag, mut content }: Chunk<'_>) -> Result<(), FormatError> {
        match tag {
            Tag::FileHeader => self.began = stated(content.rest()),
            Tag::StreamHeader => self.streams.declare(&mut content)?,
            Tag::Samples => self.streams.samples(&mut content)?,
            Tag::ClockOffset => self.streams.offset(&mut content)?,
            Tag::Boundary | Tag::StreamFooter => {}
        }
        Ok(())
    }
}

fn is_malformed(error: &FormatError) -> bool {
    matches!(error, FormatError::Malformed { .. })
}

/// When the recording began, as stated in the header of the file.
fn stated(xml: &[u8]) -> Option<StatedDate> {
    let xml = String::from_utf8_lossy(xml);
    StatedDate::of_iso(element(&xml, "datetime")?.0)
}
