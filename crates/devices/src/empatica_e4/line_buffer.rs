/// The longest accepted line, enough for a list of a hundred devices [bytes].
const LONGEST: usize = 4096;

/// Assembles lines that arrive in pieces.
#[derive(Debug, Default)]
pub(super) struct LineBuffer {
    line: Vec<u8>,
    length: usize,
}

impl LineBuffer {
    /// Returns the next whole line, or the length of one that was too long. Removes the bytes it used from the front of
    /// `bytes`.
    pub fn next(&mut self, bytes: &mut &[u8]) -> Option<Result<Vec<u8>, usize>> {
        let end = bytes.iter().position(|byte| *byte == b'\n');
        let (piece, rest) = bytes.split_at(end.unwrap_or(bytes.len()));
        let room = LONGEST.saturating_sub(self.line.len());
        self.line.extend_from_slice(piece.get(..room).unwrap_or(piece));
        self.length += piece.len();
        *bytes = rest.get(1..).unwrap_or_default();
        end?;
        let line = std::mem::take(&mut self.line);
        let length = std::mem::take(&mut self.length);
        Some(if length > LONGEST { Err(length) } else { Ok(line) })
    }

    /// Discards an incomplete line of an earlier connection.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}
