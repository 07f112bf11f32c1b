//! The intervals between heart beats, as programs for heart rate variability read them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use teampulse_core::data::{Event, EventKind};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{About, Origin, Signal, StreamId};
use teampulse_core::streams::Streams;

use super::file::{Lines, Unwritten};

/// Of several signals of one device the first of these that has intervals is kept.
const BEST_FIRST: [Signal; 3] = [Signal::Ecg, Signal::Interval, Signal::Ppg];

/// One interval [ms] a line, as detected and not corrected: a file for each device of a person. Where
/// data are missing there is no interval, so none is longer than a heart can wait.
///
/// The names are at every moment those that they would have in the end, so that after a crash they are
/// the same as after a replay: a file that is the only one has the plain name.
#[derive(Debug)]
pub(super) struct Intervals {
    folder: PathBuf,
    /// What beats are found in, by their streams; `None` for those of which there are no files.
    signals: BTreeMap<StreamId, Option<OfSignal>>,
    /// By person and device.
    files: BTreeMap<(String, String), OfDevice>,
}

/// A signal in which beats are found.
#[derive(Debug)]
struct OfSignal {
    person: String,
    device: String,
    signal: Signal,
    /// How many intervals it has, and how many beats that have none before them.
    count: u64,
    gaps: u64,
}

/// The intervals of one device.
#[derive(Debug)]
struct OfDevice {
    /// The stream of beats that it holds.
    of: StreamId,
    signal: Signal,
    file: Lines,
}

/// A file of intervals that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Kept {
    pub(super) name: String,
    pub(super) person: String,
    pub(super) device: String,
    pub(super) signal: Signal,
    /// How many intervals it has.
    pub(super) count: u64,
    /// How many beats have none before them, as data were missing; the first of all is one.
    pub(super) gaps: u64,
}

impl Intervals {
    pub(super) fn new(folder: &Path) -> Intervals {
        let (signals, files) = (BTreeMap::new(), BTreeMap::new());
        Intervals { folder: folder.to_owned(), signals, files }
    }

    /// Takes a beat, if it is one that was found in a signal.
    pub(super) fn take(
        &mut self,
        record: &Record,
        event: &Event,
        streams: &Streams,
    ) -> Result<(), Unwritten> {
        let id = record.sample.stream;
        if event.kind != EventKind::Beat || record.sample.turn == Turn::Duplicate {
            return Ok(());
        }
        let signal = self.signals.entry(id).or_insert_with(|| OfSignal::of(record, streams));
        let Some(of) = signal else { return Ok(()) };
        if !of.take(event) {
            return Ok(());
        }
        let (device, signal) = ((of.person.clone(), of.device.clone()), of.signal);
        let file = self.file_of(&device, id, signal)?;
        file.map_or(Ok(()), |file| file.push(format_args!("{:.3}", event.value)))
    }

    /// The file into which the intervals of a stream go: that of its device, unless that has those of a
    /// better signal. The better one begins it anew.
    fn file_of(
        &mut self,
        device: &(String, String),
        id: StreamId,
        signal: Signal,
    ) -> Result<Option<&mut Lines>, Unwritten> {
        if !self.files.contains_key(device) {
            self.name_all()?;
            let file = Lines::create(self.path(device, self.files.is_empty()))?;
            self.files.insert(device.clone(), OfDevice { of: id, signal, file });
        }
        let Some(known) = self.files.get_mut(device) else { return Ok(None) };
        if rank(signal) < rank(known.signal) {
            // What is still in memory must not come after what is new.
            known.file.flush()?;
            known.file = Lines::create(known.file.path().to_owned())?;
            (known.of, known.signal) = (id, signal);
        }
        Ok((known.of == id).then_some(&mut known.file))
    }

    /// With a second device the file of the first is named after it, too.
    fn name_all(&mut self) -> Result<(), Unwritten> {
        if self.files.len() != 1 {
            return Ok(());
        }
        let path = self.files.keys().next().map(|device| self.path(device, false));
        let first = self.files.values_mut().next();
        first.zip(path).map_or(Ok(()), |(first, path)| first.file.rename(path))
    }

    fn path(&self, (person, device): &(String, String), is_only_one: bool) -> PathBuf {
        let name = if is_only_one { String::new() } else { format!("_{person}_{device}") };
        self.folder.join(format!("intervals{name}.txt"))
    }

    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.files.values_mut().try_for_each(|each| each.file.flush())
    }

    /// What there is, by person and device.
    pub(super) fn finish(mut self) -> Result<Vec<Kept>, Unwritten> {
        self.flush()?;
        let kept = self.files.into_iter().filter_map(
            |((person, device), OfDevice { of, signal, file })| {
                let name = file.path().file_name()?.to_string_lossy().into_owned();
                let OfSignal { count, gaps, .. } = self.signals.get(&of)?.as_ref()?;
                Some(Kept { name, person, device, signal, count: *count, gaps: *gaps })
            },
        );
        Ok(kept.collect())
    }
}

impl OfSignal {
    /// `None` for beats that were not found in a signal of a person here.
    fn of(record: &Record, streams: &Streams) -> Option<OfSignal> {
        let stream = &record.stream;
        let (_, input) = stream.inputs.first().and_then(|input| streams.find(input))?;
        let is_found = stream.about == About::Person && stream.origin == Origin::Derived;
        if !is_found || !BEST_FIRST.contains(&input.signal) {
            return None;
        }
        let (person, device) = (plain(&stream.id), plain(&input.device));
        Some(OfSignal { person, device, signal: input.signal, count: 0, gaps: 0 })
    }

    /// Counts a beat; whether it has an interval before it.
    fn take(&mut self, beat: &Event) -> bool {
        let is_interval = beat.value.is_finite();
        let counted = if is_interval { &mut self.count } else { &mut self.gaps };
        *counted += 1;
        is_interval
    }
}

/// A word of a bag as a part of a file's name.
fn plain(word: &str) -> String {
    let plain = |each: char| if each.is_alphanumeric() || each == '-' { each } else { '_' };
    word.chars().map(plain).collect()
}

fn rank(signal: Signal) -> Option<usize> {
    BEST_FIRST.iter().position(|each| *each == signal)
}
