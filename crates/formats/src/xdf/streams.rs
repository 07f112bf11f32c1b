//! The streams of a file.

use std::collections::BTreeMap;

use super::chunks::length;
use super::clock::Fit;
use super::header::{Format, Header};
use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::{Content, Mark, Quantity, Run, Signal, bounded, nanos};

/// A later stamp begins another run, as in `pyxdf`: more than a second and more than 500 samples late.
const GAP_SECS: f64 = 1.0;
const GAP_SAMPLES: f64 = 500.0;
/// So does one that lies further before the last one than jitter explains.
const BACK_SECS: f64 = 1.0;
/// The longest text of a mark [bytes].
const MOST_TEXT: usize = 4096;

/// The streams so far, by their id.
#[derive(Default)]
pub(super) struct Streams {
    each: BTreeMap<u32, XdfStream>,
    values: usize,
    unknown: usize,
}

struct XdfStream {
    header: Header,
    stamps_secs: Vec<f64>,
    values: Vec<f64>,
    texts: Vec<String>,
    /// How many samples had stamps that are not times.
    unplaced: usize,
    /// The measured offsets, each with its time by the recorder's clock.
    offsets: Vec<(f64, f64)>,
}

impl Streams {
    pub(super) fn declare(&mut self, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let id = content.u32()?;
        let xml = String::from_utf8_lossy(content.rest());
        let header = Header::parse(&xml).ok_or_else(|| {
            FormatError::malformed(
                "the header of a stream",
                xml.trim(),
                "its format, rate and channels",
            )
        })?;
        let stream = XdfStream {
            header,
            stamps_secs: Vec::new(),
            values: Vec::new(),
            texts: Vec::new(),
            unplaced: 0,
            offsets: Vec::new(),
        };
        self.each.insert(id, stream);
        Ok(())
    }

    pub(super) fn offset(&mut self, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let id = content.u32()?;
        let (collected_secs, offset_secs) = (content.f64()?, content.f64()?);
        if let Some(stream) = self.each.get_mut(&id)
            && collected_secs.is_finite()
            && offset_secs.is_finite()
        {
            stream.offsets.push((collected_secs, offset_secs));
        }
        Ok(())
    }

    pub(super) fn samples(&mut self, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let id = content.u32()?;
        let Some(stream) = self.each.get_mut(&id) else {
            self.unknown += 1;
            return Ok(());
        };
        for _ in 0..length(content)? {
            stream.sample(content)?;
            self.values += stream.header.channels.len();
            bounded(self.values)?;
        }
        Ok(())
    }

    /// The signals, and notes on what was skipped.
    pub(super) fn finish(self) -> (Vec<Signal>, Vec<String>) {
        let mut notes = Vec::new();
        if self.unknown > 0 {
            notes.push(format!(
                "{} chunks of samples have no stream and were skipped",
                self.unknown
            ));
        }
        let unplaced = self.each.values().filter(|stream| stream.unplaced > 0);
        notes.extend(unplaced.map(|XdfStream { header, unplaced, .. }| {
            format!(
                "{unplaced} samples of {} have stamps that are not times and were left out",
                header.name
            )
        }));
        let set_back = self.each.values().filter(|stream| stream.steps_back() > 0);
        notes.extend(set_back.map(|stream| {
            let (name, steps) = (&stream.header.name, stream.steps_back());
            let times = if steps == 1 { "once".to_owned() } else { format!("{steps} times") };
            format!("the stamps of {name} go back by more than a second {times}: its samples are sorted by time")
        }));
        let signals = self.each.into_values().map(XdfStream::signal);
        let mut whole = Vec::new();
        for signal in signals {
            if signal.is_empty() {
                notes.push(format!("{} has no samples", signal.name));
            } else {
                whole.push(signal);
            }
        }
        (whole, notes)
    }
}

impl XdfStream {
    fn sample(&mut self, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let rate_hz = self.header.rate_hz;
        let after_secs = if rate_hz > 0.0 { 1.0 / rate_hz } else { 0.0 };
        let deduced_secs = self.stamps_secs.last().map_or(0.0, |last| last + after_secs);
        let stamp_secs = match content.u8()? {
            0 => deduced_secs,
            8 => content.f64()?,
            other => {
                let found = other.to_string();
                return Err(FormatError::malformed("the size of a stamp", &found, "0 or 8 bytes"));
            }
        };
        let mut texts = Vec::new();
        let before = self.values.len();
        for _ in 0..self.header.channels.len() {
            if self.header.format == Format::Text {
                let length = length(content)?;
                let text = content.length(length)?;
                texts
                    .push(String::from_utf8_lossy(&text[..text.len().min(MOST_TEXT)]).into_owned());
            } else {
                self.values.push(number(content, self.header.format)?);
            }
        }
        // A stamp that is not a time can't be placed.
        if nanos(stamp_secs).is_none() {
            self.values.truncate(before);
            self.unplaced += 1;
            return Ok(());
        }
        if self.header.format == Format::Text {
            self.texts.push(texts.join(" "));
        }
        self.stamps_secs.push(stamp_secs);
        Ok(())
    }

    /// Whether each sample keeps the time of its stamp.
    fn is_uneven(&self) -> bool {
        let Header { format, rate_hz, quantity, .. } = &self.header;
        *format == Format::Text || *rate_hz <= 0.0 || *quantity == Quantity::Interval
    }

    /// How often the stamps go back, as after a clock was set back. The runs of evenly sampled streams are compared
    /// with each other instead.
    fn steps_back(&self) -> usize {
        let steps = self.stamps_secs.windows(2).filter(|pair| pair[1] < pair[0] - BACK_SECS);
        if self.is_uneven() { steps.count() } else { 0 }
    }

    /// Its samples on the recorder's clock.
    fn signal(mut self) -> Signal {
        let is_uneven = self.is_uneven();
        let clock = Fit::without_outliers(&self.offsets).unwrap_or(Fit::ZERO);
        for stamp in &mut self.stamps_secs {
            *stamp += clock.at(*stamp);
        }
        let at = |secs: f64| nanos(secs).unwrap_or_default();
        let Header { name, quantity, channels, rate_hz, format } = self.header;
        if format == Format::Text {
            let marks = self.stamps_secs.iter().zip(self.texts);
            let marks = marks.map(|(secs, label)| Mark { at_ns: at(*secs), label }).collect();
            return Signal::marks(&name, marks);
        }
        let content = if is_uneven {
            let at_ns = self.stamps_secs.iter().map(|secs| at(*secs)).collect();
            Content::Uneven { at_ns, values: self.values }
        } else {
            Content::Even(runs(&self.stamps_secs, &self.values, channels.len(), rate_hz))
        };
        Signal { name, quantity, channels, rate_hz, content }
    }
}

/// The runs between gaps, each with the line through its stamps.
fn runs(stamps_secs: &[f64], values: &[f64], width: usize, rate_hz: f64) -> Vec<Run> {
    let gap_secs = GAP_SECS.max(GAP_SAMPLES / rate_hz);
    let follows = |a: &f64, b: &f64| (-BACK_SECS..=gap_secs).contains(&(b - a));
    let mut at = 0;
    let run = |stretch: &[f64]| {
        let points: Vec<(f64, f64)> =
            stretch.iter().enumerate().map(|(place, secs)| (place as f64, *secs)).collect();
        let line = Fit::of(&points)?;
        let samples = values[at * width..(at + stretch.len()) * width].to_vec();
        at += stretch.len();
        let is_forward = stretch.len() > 1 && line.slope() > 0.0;
        let period_secs = if is_forward { line.slope() } else { 1.0 / rate_hz };
        Some(Run { start_ns: nanos(line.at(0.0))?, period_ns: period_secs * 1e9, samples })
    };
    stamps_secs.chunk_by(follows).filter_map(run).collect()
}

fn number(content: &mut Cursor<'_>, format: Format) -> Result<f64, FormatError> {
    Ok(match format {
        Format::Float32 => f32::from_le_bytes(content.array()?).into(),
        Format::Double64 => content.f64()?,
        Format::Int8 => i8::from_le_bytes(content.array()?).into(),
        Format::Int16 => i16::from_le_bytes(content.array()?).into(),
        Format::Int32 => i32::from_le_bytes(content.array()?).into(),
        Format::Int64 | Format::Text => i64::from_le_bytes(content.array()?) as f64,
    })
}
