//! The samples of a stream, as its chunks contain them.

use super::chunks::length;
use super::header::{Format, Header};
use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::{bounded, nanos};

/// The longest text of a mark [bytes].
const MOST_TEXT: usize = 4096;

/// Samples: their stamps, and their values or texts.
pub(super) struct Samples {
    pub(super) stamps_secs: Vec<f64>,
    pub(super) values: Vec<f64>,
    pub(super) texts: Vec<String>,
    /// The number of samples that were left out because their stamps are not times.
    pub(super) unplaced: usize,
    /// The number of samples that were left out because they have no stamp, and the part before them could not be read.
    pub(super) unstamped: usize,
    /// The number of integers that an `f64` can't represent exactly.
    pub(super) rounded: usize,
    /// The indices of the samples before which other samples may be missing.
    pub(super) interruptions: Vec<usize>,
    /// The time of the next sample if it has no stamp; `None` if it is unknown.
    next_secs: Option<f64>,
}

impl Samples {
    /// Starts without samples; `next_secs` is the time of the next sample if it has no stamp.
    pub(super) fn none(next_secs: Option<f64>) -> Samples {
        Samples {
            stamps_secs: Vec::new(),
            values: Vec::new(),
            texts: Vec::new(),
            unplaced: 0,
            unstamped: 0,
            rounded: 0,
            interruptions: Vec::new(),
            next_secs,
        }
    }

    /// Reads the samples of the next chunk.
    pub(super) fn read(
        &self,
        header: &Header,
        content: &mut Cursor<'_>,
    ) -> Result<Samples, FormatError> {
        let mut samples = Samples::none(self.next_secs);
        for _ in 0..length(content)? {
            samples.sample(header, content)?;
            bounded(samples.stamps_secs.len() * header.channels.len())?;
        }
        if !content.is_empty() {
            let found = format!("{} bytes more", content.rest().len());
            return Err(FormatError::malformed("a chunk of samples", &found, "its end"));
        }
        Ok(samples)
    }

    /// Appends the samples of the next chunk.
    pub(super) fn append(&mut self, mut more: Samples) {
        self.stamps_secs.append(&mut more.stamps_secs);
        self.values.append(&mut more.values);
        self.texts.append(&mut more.texts);
        self.unplaced += more.unplaced;
        self.unstamped += more.unstamped;
        self.rounded += more.rounded;
        self.next_secs = more.next_secs;
    }

    /// Notes that samples may be missing here: the next sample can be timed only if it has a stamp.
    pub(super) fn interrupt(&mut self) {
        self.next_secs = None;
        self.interruptions.push(self.stamps_secs.len());
    }

    fn sample(&mut self, header: &Header, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let stamp_secs = match content.u8()? {
            0 => self.next_secs,
            8 => Some(content.f64()?),
            other => {
                let found = other.to_string();
                return Err(FormatError::malformed("the size of a stamp", &found, "0 or 8 bytes"));
            }
        };
        let before = self.values.len();
        let text = self.values(header, content)?;
        match stamp_secs {
            Some(secs) if nanos(secs).is_some() => {
                self.stamps_secs.push(secs);
                self.texts.extend(text);
                self.next_secs = Some(secs + header.period_secs());
                return Ok(());
            }
            Some(_) => self.unplaced += 1,
            None => self.unstamped += 1,
        }
        self.values.truncate(before);
        Ok(())
    }

    /// Reads the values of a sample; returns its text if values are texts.
    fn values(
        &mut self,
        header: &Header,
        content: &mut Cursor<'_>,
    ) -> Result<Option<String>, FormatError> {
        let mut texts = Vec::new();
        for _ in 0..header.channels.len() {
            if header.format == Format::Text {
                texts.push(text(content)?);
            } else {
                let number = self.number(content, header.format)?;
                self.values.push(number);
            }
        }
        Ok((header.format == Format::Text).then(|| texts.join(" ")))
    }

    fn number(&mut self, content: &mut Cursor<'_>, format: Format) -> Result<f64, FormatError> {
        Ok(match format {
            Format::Float32 => f32::from_le_bytes(content.array()?).into(),
            Format::Double64 => content.f64()?,
            Format::Int8 => i8::from_le_bytes(content.array()?).into(),
            Format::Int16 => i16::from_le_bytes(content.array()?).into(),
            Format::Int32 => i32::from_le_bytes(content.array()?).into(),
            Format::Int64 | Format::Text => {
                let whole = i64::from_le_bytes(content.array()?);
                let number = whole as f64;
                self.rounded += usize::from(number as i128 != i128::from(whole));
                number
            }
        })
    }
}

fn text(content: &mut Cursor<'_>) -> Result<String, FormatError> {
    let length = length(content)?;
    let text = content.length(length)?;
    Ok(String::from_utf8_lossy(&text[..text.len().min(MOST_TEXT)]).into_owned())
}
