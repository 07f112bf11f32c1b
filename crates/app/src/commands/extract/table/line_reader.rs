//! The numbered lines of a table, with look-ahead.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use super::error::TableError;
use super::utf16::as_utf8;

/// Longest line [bytes]; a file with a longer line is not a table.
const LONGEST_LINE: u64 = 1 << 20;

/// A line that may contain cells.
#[derive(Clone, Debug, PartialEq)]
pub struct TextLine {
    /// The line number, from 1.
    pub number: usize,
    pub text: String,
}

/// The lines of a file.
pub struct LineReader {
    input: BufReader<Box<dyn Read + Send>>,
    number: usize,
    /// Lines that were read ahead.
    ahead: VecDeque<TextLine>,
    read: u64,
    bytes: u64,
    /// The bytes that may end a line, known after the first line ending.
    ends: Option<&'static [u8]>,
}

impl LineReader {
    /// Opens a file; `-` is standard input.
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
        Ok(LineReader { input, number: 0, ahead: VecDeque::new(), read: 0, bytes, ends: None })
    }

    /// The fraction of the file that was read [0..1]; `None` if its length is not known.
    pub fn read_share(&self) -> Option<f64> {
        (self.bytes > 0).then(|| (self.read as f64 / self.bytes as f64).min(1.0))
    }

    /// Returns the next line that is neither empty nor a comment.
    pub fn next_data(&mut self) -> Result<Option<TextLine>, TableError> {
        loop {
            match self.next()? {
                Some(line) if !is_data(&line.text) => {}
                line => return Ok(line),
            }
        }
    }

    /// Returns the next line with data, or an empty line with data after it.
    pub fn next_data_or_empty(&mut self) -> Result<Option<TextLine>, TableError> {
        loop {
            match self.next()? {
                Some(line) if is_data(&line.text) => return Ok(Some(line)),
                Some(line) if is_comment(&line.text) || is_rule(&line.text) => {}
                Some(line) if self.goes_on()? => return Ok(Some(line)),
                _ => return Ok(None),
            }
        }
    }

    /// Whether an empty line follows every line with data among those read ahead: such empty lines are only spacing.
    pub fn is_double_spaced(&self) -> bool {
        let is_data = |line: &TextLine| is_data(&line.text);
        let is_alone = |pair: &[&TextLine]| !(is_data(pair[0]) && is_data(pair[1]));
        let lines: Vec<&TextLine> = self.ahead.iter().collect();
        let count = lines.iter().filter(|line| is_data(line)).count();
        count > 1 && !is_data(lines[0]) && lines.windows(2).all(is_alone)
    }

    /// Whether a line with data follows. Lines read ahead are searched from the last one, since reading ahead stops at
    /// data.
    fn goes_on(&mut self) -> Result<bool, TableError> {
        let is_known = self.ahead.iter().rev().any(|line| is_data(&line.text));
        Ok(is_known || !self.peek(1)?.is_empty())
    }

    /// Returns the next line of any kind.
    pub fn next(&mut self) -> Result<Option<TextLine>, TableError> {
        if let Some(line) = self.ahead.pop_front() {
            return Ok(Some(line));
        }
        self.read()
    }

    /// Returns the next `count` lines with data, or as many as there are, without consuming them.
    pub fn peek(&mut self, count: usize) -> Result<Vec<TextLine>, TableError> {
        let mut known = self.ahead.iter().filter(|line| is_data(&line.text)).count();
        while known < count
            && let Some(line) = self.read()?
        {
            known += usize::from(is_data(&line.text));
            self.ahead.push_back(line);
        }
        let data = self.ahead.iter().filter(|line| is_data(&line.text));
        Ok(data.take(count).cloned().collect())
    }

    fn read(&mut self) -> Result<Option<TextLine>, TableError> {
        let mut bytes = Vec::new();
        self.number += 1;
        let read = self.read_line(&mut bytes);
        read.map_err(|error| TableError::Read { line: self.number, error })?;
        let read = bytes.len() as u64;
        self.read += read;
        if read >= LONGEST_LINE || bytes.contains(&0) {
            let is_wav = self.number == 1 && bytes.starts_with(b"RIFF");
            let no_table = TableError::NoTable { line: self.number };
            return Err(if is_wav { TableError::Wav } else { no_table });
        }
        while bytes.last().is_some_and(|byte| b"\r\n".contains(byte)) {
            bytes.pop();
        }
        let text = String::from_utf8(bytes)
            .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
        Ok((read > 0).then_some(TextLine { number: self.number, text }))
    }

    /// Reads up to the end of the line. The first line determines the line ending: old Mac files and exports of some
    /// devices use carriage returns alone.
    fn read_line(&mut self, bytes: &mut Vec<u8>) -> io::Result<()> {
        let ends = self.ends.unwrap_or(b"\r\n");
        while (bytes.len() as u64) < LONGEST_LINE {
            let there = self.input.fill_buf()?;
            let there = &there[..there.len().min(LONGEST_LINE as usize - bytes.len())];
            let end = there.iter().position(|byte| ends.contains(byte));
            let taken = end.map_or(there.len(), |end| end + 1);
            bytes.extend_from_slice(&there[..taken]);
            self.input.consume(taken);
            match end {
                Some(_) => break,
                None if taken == 0 => return Ok(()),
                None => {}
            }
        }
        if self.ends.is_none() {
            while bytes.last() == Some(&b'\r') && self.takes_next(b"\r\n", bytes)? {}
            let is_feed = bytes.last() == Some(&b'\n');
            self.ends = Some(if is_feed { b"\n" } else { b"\r\n" });
        }
        Ok(())
    }

    /// Reads the next byte if it is one of these.
    fn takes_next(&mut self, wanted: &[u8], bytes: &mut Vec<u8>) -> io::Result<bool> {
        let next = self.input.fill_buf()?.first().copied().filter(|byte| wanted.contains(byte));
        bytes.extend(next);
        self.input.consume(usize::from(next.is_some()));
        Ok(next.is_some())
    }
}

fn is_data(line: &str) -> bool {
    !(line.trim().is_empty() || is_comment(line) || is_rule(line))
}

/// Whether a line is a rule below the names, such as `----+----` or `|:--|--:|`.
pub fn is_rule(line: &str) -> bool {
    line.contains("---") && line.bytes().all(|byte| b"-+|=: \t".contains(&byte))
}

/// Whether a line is a comment; comments of `SoX` start with a semicolon.
pub fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    if ["; Sample Rate ", "; Channels "].iter().any(|of_sox| line.starts_with(of_sox)) {
        return true;
    }
    // A cell with a spreadsheet error starts like a comment.
    line.starts_with(['#', '%'])
        && !["#N/A", "#DIV/0!", "#VALUE!", "#NUM!", "#NULL!"].iter().any(|it| line.starts_with(it))
}
