//! The lines of a table, counted, and some of them ahead.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::error::TableError;
use super::utf16::as_utf8;

/// Longest line [bytes]: what is longer is no table.
const LONGEST_LINE: u64 = 1 << 20;

/// A line that may hold cells.
#[derive(Clone, Debug, PartialEq)]
pub struct TextLine {
    /// From 1.
    pub number: usize,
    pub text: String,
}

/// The lines of a file.
pub struct LineReader {
    input: BufReader<Box<dyn Read + Send>>,
    number: usize,
    /// Lines that were looked at.
    ahead: VecDeque<TextLine>,
    read: u64,
    bytes: u64,
}

impl LineReader {
    /// The lines of a file; `-` is standard input.
    pub fn open(path: &Path) -> Result<LineReader, TableError> {
        let opened = |error| TableError::Open { path: path.to_owned(), error };
        let (input, bytes): (Box<dyn Read + Send>, u64) = if path == Path::new("-") {
            (Box::new(std::io::stdin()), 0)
        } else {
            let file = File::open(path).map_err(opened)?;
            let bytes = file.metadata().map_err(opened)?.len();
            (Box::new(file), bytes)
        };
        let (input, width) = as_utf8(input).map_err(opened)?;
        let input = BufReader::with_capacity(1 << 18, input);
        let bytes = bytes / width;
        Ok(LineReader { input, number: 0, ahead: VecDeque::new(), read: 0, bytes })
    }

    /// The share of the file that was read [0..1]; `None` when its length is not known.
    pub fn read_share(&self) -> Option<f64> {
        (self.bytes > 0).then(|| (self.read as f64 / self.bytes as f64).min(1.0))
    }

    /// The next line that is neither empty nor a comment.
    pub fn next_data(&mut self) -> Result<Option<TextLine>, TableError> {
        loop {
            match self.next()? {
                Some(line) if !is_data(&line.text) => {}
                line => return Ok(line),
            }
        }
    }

    /// The next line, whatever it holds.
    pub fn next(&mut self) -> Result<Option<TextLine>, TableError> {
        if let Some(line) = self.ahead.pop_front() {
            return Ok(Some(line));
        }
        self.read()
    }

    /// The next `count` lines that hold data, or as many as there are, which stay to be read.
    pub fn peek(&mut self, count: usize) -> Result<Vec<TextLine>, TableError> {
        while self.ahead.iter().filter(|line| is_data(&line.text)).count() < count
            && let Some(line) = self.read()?
        {
            self.ahead.push_back(line);
        }
        let data = self.ahead.iter().filter(|line| is_data(&line.text));
        Ok(data.take(count).cloned().collect())
    }

    fn read(&mut self) -> Result<Option<TextLine>, TableError> {
        let mut bytes = Vec::new();
        self.number += 1;
        let read = (&mut self.input).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
        let read = read.map_err(|error| TableError::Read { line: self.number, error })? as u64;
        self.read += read;
        if read == LONGEST_LINE || bytes.contains(&0) {
            return Err(TableError::NoTable { line: self.number });
        }
        while bytes.last().is_some_and(|byte| b"\r\n".contains(byte)) {
            bytes.pop();
        }
        let text = String::from_utf8(bytes)
            .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
        Ok((read > 0).then_some(TextLine { number: self.number, text }))
    }
}

fn is_data(line: &str) -> bool {
    !(line.trim().is_empty() || is_comment(line))
}

/// Whether a line is a comment.
pub fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%'])
}
