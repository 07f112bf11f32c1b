//! The streams of a file.

use std::collections::BTreeMap;

use super::clock::Fit;
use super::header::{Format, Header};
use super::samples::Samples;
use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::{Content, Mark, Quantity, Run, Signal, bounded, nanos};

/// A later stamp begins another run, as in `pyxdf`: more than a second and more than 500 samples late.
const GAP_SECS: f64 = 1.0;
const GAP_SAMPLES: f64 = 500.0;
/// So does one that lies further before the last one than jitter explains.
const BACK_SECS: f64 = 1.0;
/// And, where a part of the file could not be read, one from which on a sample is missing.
const MISSING_SAMPLES: f64 = 1.5;

/// The streams so far, by their id.
#[derive(Default)]
pub(super) struct Streams {
    each: BTreeMap<u32, XdfStream>,
    values: usize,
    unknown: usize,
}

struct XdfStream {
    header: Header,
    samples: Samples,
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
        let stream = XdfStream { header, samples: Samples::none(Some(0.0)), offsets: Vec::new() };
        self.each.insert(id, stream);
        Ok(())
    }

    pub(super) fn offset(&mut self, content: &mut Cursor<'_>) -> Result<(), FormatError> {
        let id = content.u32()?;
        let (collected_secs, offset_secs) = (content.f64()?, content.f64()?);
        if !content.is_empty() {
            let found = format!("{} bytes more", content.rest().len());
            return Err(FormatError::malformed("the offset of a clock", &found, "its end"));
        }
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
        let samples = stream.samples.read(&stream.header, content)?;
        self.values += samples.stamps_secs.len() * stream.header.channels.len();
        stream.samples.append(samples);
        bounded(self.values)
    }

    /// Samples of every stream may be missing here.
    pub(super) fn interrupt(&mut self) {
        self.each.values_mut().for_each(|stream| stream.samples.interrupt());
    }

    /// The number of samples that were left out because they have no stamp, and what they follow could not be read.
    pub(super) fn unstamped(&self) -> usize {
        self.each.values().map(|stream| stream.samples.unstamped).sum()
    }

    /// The signals, and notes on what was skipped.
    pub(super) fn finish(self) -> (Vec<Signal>, Vec<String>) {
        let mut notes = Vec::new();
        if self.unknown > 0 {
            notes.push(match self.unknown {
                1 => "a chunk of samples has no stream and was skipped".to_owned(),
                count => format!("{count} chunks of samples have no stream and were skipped"),
            });
        }
        let unplaced = self.each.values().filter(|stream| stream.samples.unplaced > 0);
        notes.extend(unplaced.map(|XdfStream { header, samples, .. }| {
            let name = &header.name;
            match samples.unplaced {
                1 => format!("a sample of {name} has a stamp that is not a time and was left out"),
                count => format!(
                    "{count} samples of {name} have stamps that are not times and were left out"
                ),
            }
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
    /// Whether each sample keeps the time of its stamp.
    fn is_uneven(&self) -> bool {
        let Header { format, rate_hz, quantity, .. } = &self.header;
        *format == Format::Text || *rate_hz <= 0.0 || *quantity == Quantity::Interval
    }

    /// How often the stamps go back, as after a clock was set back. The runs of evenly sampled streams are compared
    /// with each other instead.
    fn steps_back(&self) -> usize {
        let steps =
            self.samples.stamps_secs.windows(2).filter(|pair| pair[1] < pair[0] - BACK_SECS);
        if self.is_uneven() { steps.count() } else { 0 }
    }

    /// Its samples on the recorder's clock.
    fn signal(mut self) -> Signal {
        let is_uneven = self.is_uneven();
        let clock = Fit::without_outliers(&self.offsets).unwrap_or(Fit::ZERO);
        for stamp in &mut self.samples.stamps_secs {
            *stamp += clock.at(*stamp);
        }
        let at = |secs: f64| nanos(secs).unwrap_or_default();
        let Header { name, quantity, channels, rate_hz, format } = self.header;
        let samples = self.samples;
        if format == Format::Text {
            let marks = samples.stamps_secs.iter().zip(samples.texts);
            let marks = marks.map(|(secs, label)| Mark { at_ns: at(*secs), label }).collect();
            return Signal::marks(&name, marks);
        }
        let content = if is_uneven {
            let at_ns = samples.stamps_secs.iter().map(|secs| at(*secs)).collect();
            Content::Uneven { at_ns, values: samples.values }
        } else {
            Content::Even(runs(&samples, channels.len(), rate_hz))
        };
        Signal { name, quantity, channels, rate_hz, content }
    }
}

/// The runs between gaps, each with the line through its stamps.
fn runs(samples: &Samples, width: usize, rate_hz: f64) -> Vec<Run> {
    let gap_secs = GAP_SECS.max(GAP_SAMPLES / rate_hz);
    let follows = |a: &f64, b: &f64| (-BACK_SECS..=gap_secs).contains(&(b - a));
    let mut at = 0;
    let run = |stretch: &[f64]| {
        let points: Vec<(f64, f64)> =
            stretch.iter().enumerate().map(|(place, secs)| (place as f64, *secs)).collect();
        let line = Fit::of(&points)?;
        let values = samples.values[at * width..(at + stretch.len()) * width].to_vec();
        at += stretch.len();
        let is_forward = stretch.len() > 1 && line.slope() > 0.0;
        let period_secs = if is_forward { line.slope() } else { 1.0 / rate_hz };
        Some(Run { start_ns: nanos(line.at(0.0))?, period_ns: period_secs * 1e9, samples: values })
    };
    let parts = parts(samples, MISSING_SAMPLES / rate_hz);
    parts.into_iter().flat_map(|part| part.chunk_by(follows)).filter_map(run).collect()
}

/// The stamps between interruptions by more than a duration.
fn parts(samples: &Samples, missing_secs: f64) -> Vec<&[f64]> {
    let stamps_secs = &samples.stamps_secs[..];
    let is_gap = |at: &usize| {
        let before = at.checked_sub(1).and_then(|before| stamps_secs.get(before));
        let after = stamps_secs.get(*at);
        before.zip(after).is_some_and(|(before, after)| after - before > missing_secs)
    };
    let mut start = 0;
    let ends = samples.interruptions.iter().copied().filter(is_gap).chain([stamps_secs.len()]);
    ends.map(|end| &stamps_secs[std::mem::replace(&mut start, end)..end]).collect()
}
