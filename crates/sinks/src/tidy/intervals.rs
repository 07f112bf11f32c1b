//! Inter-beat intervals in the formats of programs for heart rate variability.

mod judged;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use teampulse_core::data::{Event, EventKind};
use teampulse_core::sample::{Record, Turn};
use teampulse_core::stream::{About, Origin, Signal, StreamId, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;

use super::file::{TextFile, Unwritten, on_one_line};
use super::sidecar::{self, Column};
use super::timeline::Timeline;
use crate::csv::cell;

/// The name of the file that describes the tables' columns.
pub(super) const SIDECAR: &str = "intervals.json";
/// The columns of the tables.
pub(super) const COLUMNS: [(&str, Column); 4] = [
    (
        "time_secs",
        Column::united(
            "Time of the beat that ends the interval, since the start of the session.",
            "s",
        ),
    ),
    (
        "rr_ms",
        Column::united(
            "The interval since the previous beat, as detected and not corrected.",
            "ms",
        ),
    ),
    ("phase", Column::of("The phase at that beat; empty between phases.")),
    (
        "corrected",
        Column::of(
            "1 if the features do not use this interval unchanged, else 0. They do not if, by the method of Lipponen and \
             Tarvainen (2019, doi:10.1080/03091902.2019.1640306) over the whole recording, a beat at one of its ends \
             is ectopic or extra, a beat was missed in it, or it is too long or too short; or if it is outside 300 to \
             2000 ms. No interval spans missing data.",
        ),
    ),
];
/// The signals in order of preference, for a device with several.
const BEST_FIRST: [Signal; 3] = [Signal::Ecg, Signal::Interval, Signal::Ppg];

/// The intervals as detected and not corrected. There are two files for each device of a person, and for each further
/// signal of the same kind on that device: `intervals.txt` has the time of the beat that ends the interval and the
/// interval [s, s], one per line, as read by Kubios HRV; `intervals.csv`, which is written at the end, has the phase
/// and the correction. No interval spans missing data, so none is implausibly long.
///
/// The files have their final names at all times, so that they are the same after a crash as after a replay: if there
/// is only one file, it has the plain name.
#[derive(Debug)]
pub(super) struct Intervals {
    folder: PathBuf,
    /// The signals in which beats are detected, by stream; `None` for streams without files.
    signals: BTreeMap<StreamId, Option<OfSignal>>,
    /// The files by person and device.
    files: BTreeMap<(String, String), OfDevice>,
}

/// A signal in which beats are detected.
#[derive(Debug)]
struct OfSignal {
    subject: Subject,
    person: String,
    device: String,
    /// The name of the signal's stream.
    input: String,
    signal: Signal,
    /// The number of intervals, and of beats without an interval before them.
    count: u64,
    gaps: u64,
}

/// The intervals of one device.
#[derive(Debug)]
struct OfDevice {
    /// The stream of the beats.
    of: StreamId,
    /// The name of the stream in which the beats are detected.
    input: String,
    signal: Signal,
    file: TextFile,
    /// The time of each beat, and the interval before it [ms] or NaN.
    beats: Vec<(Time, f64)>,
}

/// The files of a device's intervals; `name` is their name without `.txt` and `.csv`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Kept {
    pub(super) name: String,
    pub(super) person: String,
    pub(super) device: String,
    pub(super) signal: Signal,
    /// The number of intervals.
    pub(super) count: u64,
    /// The number of beats without an interval before them because data were missing, including the first.
    pub(super) gaps: u64,
    /// The number of intervals that are marked as corrected.
    pub(super) corrected: usize,
}

/// Writes the table of a device's intervals; returns the number marked as corrected.
fn table(
    path: &Path,
    subject: &Subject,
    beats: &[(Time, f64)],
    timeline: &Timeline,
) -> Result<usize, Unwritten> {
    let mut file = TextFile::create(path.to_owned())?;
    file.push(COLUMNS.map(|(name, _)| name).join(","))?;
    let is_corrected = judged::corrected(beats);
    for ((at, rr_ms), is_corrected) in beats.iter().zip(&is_corrected) {
        if rr_ms.is_finite() {
            let phase = timeline.section(subject, *at).phase.unwrap_or_default();
            let (phase, at_secs) = (cell(&on_one_line(phase)), timeline.secs(*at));
            let is_corrected = u8::from(*is_corrected);
            file.push(format_args!("{at_secs:.6},{rr_ms:.3},{phase},{is_corrected}"))?;
        }
    }
    file.flush()?;
    Ok(is_corrected.into_iter().filter(|is| *is).count())
}

impl Intervals {
    pub(super) fn new(folder: &Path) -> Intervals {
        let (signals, files) = (BTreeMap::new(), BTreeMap::new());
        Intervals { folder: folder.to_owned(), signals, files }
    }

    /// Takes a beat, if it was detected in a signal.
    pub(super) fn take(
        &mut self,
        record: &Record,
        event: &Event,
        streams: &Streams,
        timeline: &Timeline,
    ) -> Result<(), Unwritten> {
        let id = record.sample.stream;
        if event.kind != EventKind::Beat || record.sample.turn == Turn::Duplicate {
            return Ok(());
        }
        let signal = self.signals.entry(id).or_insert_with(|| OfSignal::of(record, streams));
        let Some(of) = signal else { return Ok(()) };
        let is_interval = of.take(event);
        let device = of.file_among(&self.files);
        if !is_interval && !self.files.contains_key(&device) {
            return Ok(());
        }
        let (input, signal) = (of.input.clone(), of.signal);
        let (at, at_secs) = (record.sample.measured, timeline.secs(record.sample.measured));
        let Some(file) = self.file_of(&device, (id, input, signal), is_interval)? else {
            return Ok(());
        };
        file.beats.push((at, event.value));
        if !is_interval {
            return Ok(());
        }
        file.file.push(format_args!("{at_secs:.6}\t{:.6}", event.value / 1e3))
    }

    /// Returns the file for the intervals of a stream: the file of its device, unless that holds the intervals of a
    /// better signal. A better signal restarts the file.
    fn file_of(
        &mut self,
        device: &(String, String),
        (id, input, signal): (StreamId, String, Signal),
        is_interval: bool,
    ) -> Result<Option<&mut OfDevice>, Unwritten> {
        if !self.files.contains_key(device) {
            if self.files.is_empty() {
                sidecar::write_intervals(&self.folder)?;
            }
            self.name_all()?;
            let file = TextFile::create(self.path(device, self.files.is_empty()))?;
            let file = OfDevice { of: id, input, signal, file, beats: Vec::new() };
            self.files.insert(device.clone(), file);
            return Ok(self.files.get_mut(device));
        }
        let Some(known) = self.files.get_mut(device) else { return Ok(None) };
        if is_interval && rank(signal) < rank(known.signal) {
            // Buffered rows must precede new ones.
            known.file.flush()?;
            known.file = TextFile::create(known.file.path().to_owned())?;
            (known.of, known.input, known.signal) = (id, input, signal);
            known.beats.clear();
        }
        Ok((known.of == id).then_some(known))
    }

    /// Names the first device's file after the device when a second device is added.
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

    /// Writes the tables; returns the files by person and device.
    pub(super) fn finish(mut self, timeline: &Timeline) -> Result<Vec<Kept>, Unwritten> {
        self.flush()?;
        let mut kept = Vec::new();
        for ((person, device), OfDevice { of, signal, file, beats, .. }) in self.files {
            let Some(Some(of)) = self.signals.get(&of) else { continue };
            let Some(name) = file.path().file_stem() else { continue };
            let name = name.to_string_lossy().into_owned();
            let corrected =
                table(&file.path().with_extension("csv"), &of.subject, &beats, timeline)?;
            let OfSignal { count, gaps, .. } = *of;
            kept.push(Kept { name, person, device, signal, count, gaps, corrected });
        }
        Ok(kept)
    }
}

impl OfSignal {
    /// The signal in which a beat was detected; `None` unless it is a person's signal in this session.
    fn of(record: &Record, streams: &Streams) -> Option<OfSignal> {
        let stream = &record.stream;
        let (_, input) = stream.inputs.first().and_then(|input| streams.find(input))?;
        let is_found = stream.about == About::Person && stream.origin == Origin::Derived;
        if !is_found || !BEST_FIRST.contains(&input.signal) {
            return None;
        }
        let (person, device) = (plain(&stream.id), plain(&input.device));
        Some(OfSignal {
            subject: stream.subject(),
            person,
            device,
            input: input.name.clone(),
            signal: input.signal,
            count: 0,
            gaps: 0,
        })
    }

    /// Returns the person and the device in the name of the file. The name of the stream is appended if the device's
    /// file holds another signal of the same kind.
    fn file_among(&self, files: &BTreeMap<(String, String), OfDevice>) -> (String, String) {
        let name = self.input.rsplit('/').next().unwrap_or_default();
        let own = (self.person.clone(), format!("{}_{}", self.device, plain(name)));
        let device = (self.person.clone(), self.device.clone());
        let is_other = |known: &OfDevice| known.signal == self.signal && known.input != self.input;
        if files.contains_key(&own) || files.get(&device).is_some_and(is_other) {
            own
        } else {
            device
        }
    }

    /// Counts a beat; returns whether there is an interval before it.
    fn take(&mut self, beat: &Event) -> bool {
        let is_interval = beat.value.is_finite();
        let counted = if is_interval { &mut self.count } else { &mut self.gaps };
        *counted += 1;
        is_interval
    }
}

/// Converts a word from a bag to a part of a file name.
fn plain(word: &str) -> String {
    let plain = |each: char| if each.is_alphanumeric() || each == '-' { each } else { '_' };
    word.chars().map(plain).collect()
}

fn rank(signal: Signal) -> Option<usize> {
    BEST_FIRST.iter().position(|each| *each == signal)
}
