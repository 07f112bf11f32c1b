//! The intervals between heart beats, as programs for heart rate variability read them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use teampulse_core::data::{Event, EventKind};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{About, Origin, Signal, StreamId};
use teampulse_core::streams::Streams;

use super::file::{Lines, Unwritten};

/// Of several signals of one device the first of these that has beats is kept.
const BEST_FIRST: [Signal; 3] = [Signal::Ecg, Signal::Interval, Signal::Ppg];

/// One interval [ms] a line, as detected and not corrected: a file for each device of a person. Where
/// data are missing there is no interval, so none is longer than a heart can wait.
#[derive(Debug)]
pub(super) struct Intervals {
    folder: PathBuf,
    files: BTreeMap<StreamId, Option<OfSignal>>,
}

/// The intervals of one signal.
#[derive(Debug)]
struct OfSignal {
    person: String,
    device: String,
    signal: Signal,
    file: Lines,
    count: u64,
    gaps: u64,
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
        Intervals { folder: folder.to_owned(), files: BTreeMap::new() }
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
        if !self.files.contains_key(&id) {
            let of_signal = OfSignal::begin(&self.folder, record, streams)?;
            self.files.insert(id, of_signal);
        }
        self.files.get_mut(&id).and_then(Option::as_mut).map_or(Ok(()), |file| file.take(event))
    }

    pub(super) fn flush(&mut self) -> Result<(), Unwritten> {
        self.files.values_mut().flatten().try_for_each(|each| each.file.flush())
    }

    /// Keeps the best signal of each device; a file that is the only one has the plain name.
    pub(super) fn finish(mut self) -> Result<Vec<Kept>, Unwritten> {
        self.flush()?;
        let mut of_device: BTreeMap<_, Vec<OfSignal>> = BTreeMap::new();
        for each in self.files.into_values().flatten() {
            of_device.entry((each.person.clone(), each.device.clone())).or_default().push(each);
        }
        let is_only_one = of_device.len() == 1;
        let mut kept = Vec::new();
        for ((person, device), mut signals) in of_device {
            signals.sort_by_key(|each| (each.count == 0, rank(each.signal)));
            let mut signals = signals.into_iter();
            let Some(OfSignal { signal, file, count, gaps, .. }) = signals.next() else { continue };
            for other in signals {
                fs::remove_file(other.file.path()).map_err(Unwritten::at(other.file.path()))?;
            }
            let name = if is_only_one { String::new() } else { format!("_{person}_{device}") };
            let name = format!("intervals{name}.txt");
            let path = self.folder.join(&name);
            fs::rename(file.path(), &path).map_err(Unwritten::at(&path))?;
            kept.push(Kept { name, person, device, signal, count, gaps });
        }
        Ok(kept)
    }
}

impl OfSignal {
    /// `None` for beats that were not found in a signal of a person here.
    fn begin(
        folder: &Path,
        record: &Record,
        streams: &Streams,
    ) -> Result<Option<OfSignal>, Unwritten> {
        let stream = &record.stream;
        let input = stream.inputs.first().and_then(|input| streams.find(input));
        let Some((_, input)) = input else { return Ok(None) };
        let is_found = stream.about == About::Person && stream.origin == Origin::Derived;
        if !is_found || !BEST_FIRST.contains(&input.signal) {
            return Ok(None);
        }
        let (person, device, signal) = (plain(&stream.id), plain(&input.device), input.signal);
        let leaf = plain(input.name.rsplit('/').next().unwrap_or_default());
        let name = format!("intervals_{person}_{device}_{leaf}.txt");
        let file = Lines::create(folder.join(name))?;
        Ok(Some(OfSignal { person, device, signal, file, count: 0, gaps: 0 }))
    }

    fn take(&mut self, beat: &Event) -> Result<(), Unwritten> {
        if !beat.value.is_finite() {
            self.gaps += 1;
            return Ok(());
        }
        self.count += 1;
        self.file.push(format_args!("{:.3}", beat.value))
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
