//! The parts of a damaged file that could not be read.

use std::ops::Range;

/// The bytes of a file that could not be read.
#[derive(Debug, Default)]
pub(super) struct Unread {
    bytes: usize,
    places: usize,
    /// The offset after the last skipped bytes.
    end: usize,
    last: Option<Last>,
}

/// The unreadable end of a file.
#[derive(Debug)]
struct Last {
    bytes: usize,
    /// Whether the file ends within a chunk, as after a crash of the recorder.
    is_cut: bool,
}

impl Unread {
    /// Counts bytes that were skipped; bytes that directly follow others count as the same place.
    pub(super) fn skipped(&mut self, bytes: Range<usize>) {
        self.bytes += bytes.len();
        self.places += usize::from(self.places == 0 || bytes.start != self.end);
        self.end = bytes.end;
    }

    /// Counts the bytes up to the end of the file.
    pub(super) fn rest(&mut self, bytes: Range<usize>, is_cut: bool) {
        self.last = Some(Last { bytes: bytes.len(), is_cut });
    }

    /// Notes on the missing parts. `unstamped` is the number of samples that were left out after skipped bytes, as they
    /// have no stamp.
    pub(super) fn notes(&self, unstamped: usize) -> Vec<String> {
        let skipped = (self.places > 0).then(|| self.skipped_note(unstamped));
        skipped.into_iter().chain(self.last.as_ref().map(Last::note)).collect()
    }

    fn skipped_note(&self, unstamped: usize) -> String {
        let places = match self.places {
            1 => "one place".to_owned(),
            several => format!("{several} places"),
        };
        let left_out = match unstamped {
            0 => String::new(),
            1 => "; 1 sample after them was left out, as it has no stamp".to_owned(),
            _ => format!("; {unstamped} samples after them were left out, as they have no stamps"),
        };
        let bytes = self.bytes;
        format!(
            "{bytes} bytes in {places} could not be read: the samples there are missing{left_out}"
        )
    }
}

impl Last {
    fn note(&self) -> String {
        let reason = if self.is_cut { "the file ends within a chunk: " } else { "" };
        format!("{reason}the last {} bytes could not be read", self.bytes)
    }
}
