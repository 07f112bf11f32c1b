//! The streams of a file.

use std::collections::{BTreeMap, BTreeSet};

use super::clock::Fit;
use super::gaps::gaps;
use super::header::{Format, Header};
use super::resets::convert;
use super::samples::Samples;
use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::{Content, Mark, Quantity, Run, Signal, bounded, nanos};

/// A stamp that is late by more than a second and by more than 500 samples always begins another run, as in `pyxdf`.
const GAP_SECS: f64 = 1.0;
const GAP_SAMPLES: f64 = 500.0;
/// A stamp that goes back by more than this also begins another run, as jitter can't explain it [s].
const BACK_SECS: f64 = 1.0;
/// After a part of the file that could not be read, a stamp this many samples after the previous one begins another
/// run.
const MISSING_SAMPLES: f64 = 1.5;

/// The streams so far, by id.
#[derive(Default)]
pub(super) struct Streams {
    each: BTreeMap<u32, XdfStream>,
    values: usize,
    unknown: usize,
}

struct XdfStream {
    header: Header,
    samples: Samples,
    /// The measured offsets [s], each after the time at which it was measured [s].
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

    /// Notes that samples of every stream may be missing here.
    pub(super) fn interrupt(&mut self) {
        self.each.values_mut().for_each(|stream| stream.samples.interrupt());
    }

    /// The number of samples that were left out because they have no stamp, and the part before them could not be read.
    pub(super) fn unstamped(&self) -> usize {
        self.each.values().map(|stream| stream.samples.unstamped).sum()
    }

    /// Converts the streams to signals; also returns notes on what was skipped.
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
        let mut whole = Vec::new();
        for mut stream in self.each.into_values() {
            notes.extend(stream.convert());
            let signal = stream.signal();
            if signal.is_empty() {
                notes.push(format!("{} has no samples", signal.name));
            } else {
                notes.extend(missing(&signal));
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

    /// Converts the stream's stamps to the recorder's clock; returns notes on irregularities.
    fn convert(&mut self) -> impl Iterator<Item = String> {
        let (name, stamps_secs) = (&self.header.name, &mut self.samples.stamps_secs);
        let resets = convert(stamps_secs, &self.offsets);
        let reset = (resets > 0).then(|| {
            let times = times(resets);
            format!("the clock of {name} was reset {times}: its times before and after are converted separately")
        });
        let steps = stamps_secs.windows(2).filter(|pair| pair[1] < pair[0] - BACK_SECS).count();
        let back = (steps > 0).then(|| {
            let times = times(steps);
            format!("the stamps of {name} go back by more than a second {times}: its samples are sorted by time")
        });
        let rounded = (self.samples.rounded > 0).then(|| {
            let count = self.samples.rounded;
            format!("{count} integers of {name} are beyond 2^53 and were rounded")
        });
        reset.into_iter().chain(back).chain(rounded)
    }

    /// Converts the stream to a signal.
    fn signal(self) -> Signal {
        let is_uneven = self.is_uneven();
        let at = |secs: f64| nanos(secs).unwrap_or_default();
        let Header { name, quantity, channels, rate_hz, format } = self.header;
        let samples = self.samples;
        if format == Format::Text {
            let marks = samples.stamps_secs.iter().zip(samples.texts);
            let marks = marks.map(|(secs, label)| Mark::new(at(*secs), label)).collect();
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

/// The runs between gaps, each timed by a line through its stamps.
fn runs(samples: &Samples, width: usize, rate_hz: f64) -> Vec<Run> {
    let mut start = 0;
    let run = |end: usize| {
        let stretch = std::mem::replace(&mut start, end)..end;
        let stamps = samples.stamps_secs[stretch.clone()].iter().enumerate();
        let points: Vec<(f64, f64)> = stamps.map(|(place, secs)| (place as f64, *secs)).collect();
        let line = Fit::of(&points)?;
        let is_forward = points.len() > 1 && line.slope() > 0.0;
        let period_secs = if is_forward { line.slope() } else { 1.0 / rate_hz };
        let values = samples.values[stretch.start * width..stretch.end * width].to_vec();
        Some(Run { start_ns: nanos(line.at(0.0))?, period_ns: period_secs * 1e9, samples: values })
    };
    let ends = breaks(samples, rate_hz).into_iter().chain([samples.stamps_secs.len()]);
    ends.filter_map(run).collect()
}

/// The indices of the samples that begin another run, in order.
fn breaks(samples: &Samples, rate_hz: f64) -> BTreeSet<usize> {
    let stamps_secs = &samples.stamps_secs[..];
    let step_secs = |at: usize| stamps_secs[at] - stamps_secs[at - 1];
    let may_follow = -BACK_SECS..=GAP_SECS.max(GAP_SAMPLES / rate_hz);
    let far = (1..stamps_secs.len()).filter(|at| !may_follow.contains(&step_secs(*at)));
    let inside = |at: &usize| (1..stamps_secs.len()).contains(at);
    let damaged = samples.interruptions.iter().copied().filter(inside);
    let damaged = damaged.filter(|at| step_secs(*at) > MISSING_SAMPLES / rate_hz);
    let mut breaks: BTreeSet<usize> = far.chain(damaged).collect();
    let mut start = 0;
    for end in breaks.clone().into_iter().chain([stamps_secs.len()]) {
        breaks.extend(gaps(&stamps_secs[start..end], rate_hz).iter().map(|at| start + at));
        start = end;
    }
    breaks
}

/// A note on how often and for how long samples are missing between the runs of a signal; `None` if none are.
fn missing(signal: &Signal) -> Option<String> {
    let Content::Even(runs) = &signal.content else { return None };
    let width = signal.channels.len().max(1);
    let end_ns =
        |run: &Run| run.start_ns as f64 + (run.samples.len() / width) as f64 * run.period_ns;
    let between = runs.windows(2).map(|pair| (pair[1].start_ns as f64 - end_ns(&pair[0])) / 1e9);
    let between: Vec<f64> = between.filter(|secs| *secs > 0.5 / signal.rate_hz).collect();
    let (name, total_secs) = (&signal.name, between.iter().sum::<f64>());
    match between.len() {
        0 => None,
        1 => Some(format!("samples of {name} are missing once, for {total_secs:.3} s")),
        count => Some(format!(
            "samples of {name} are missing in {count} places, for {total_secs:.3} s in all"
        )),
    }
}

/// A number of times, in words.
fn times(count: usize) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}
