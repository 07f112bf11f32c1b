//! EDF, EDF+, BDF and BDF+: the European Data Format, and `BioSemi`'s with samples of 24 bits.
//!
//! | bytes | contents |
//! |---|---|
//! | 256 | version, person, recording, start (local time), number and duration of records, number of signals `n` |
//! | 256 · n | by field: label, transducer, unit, physical and digital range, filters, samples per record |
//! | records | the samples of each signal in this record, 16 bits (EDF) or 24 bits (BDF), little-endian |
//!
//! Annotations are a signal of text (`EDF Annotations`). Its first entry in each record is the start of that record,
//! since records of EDF+D need not be contiguous. Sources: Kemp et al. 1992, doi:10.1016/0013-4694(92)90009-7; Kemp and
//! Olivan 2003, doi:10.1016/S1388-2457(03)00123-8. The start has no time zone, so times count from the start, and its
//! date is given separately. The identity of the person is not read.

mod annotations;
mod header;

use crate::cursor::Cursor;
use crate::error::FormatError;
use crate::recording::{Channel, Mark, Quantity, Recording, Run, Signal, bounded, nanos};

use annotations::{Annotations, annotations};
use header::{EdfSignal, Header};

/// The first bytes of EDF and EDF+.
pub const EDF_MAGIC: &[u8] = b"0       ";
/// The first bytes of BDF and BDF+.
pub const BDF_MAGIC: &[u8] = b"\xffBIOSEMI";

/// A record that starts this close to the end of the previous one is contiguous with it [s].
const FOLLOWS_SECS: f64 = 1e-3;

/// Reads a file.
pub fn read(bytes: &[u8]) -> Result<Recording, FormatError> {
    let header = Header::read(bytes)?;
    let data = bytes.get(header.bytes..).ok_or(FormatError::Short("its header"))?;
    let whole = data.len() / header.record_bytes();
    let stated = header.records.unwrap_or(whole);
    let mut recording = Recording { date: header.date, ..Recording::default() };
    recording.notes.extend(header.notes());
    if stated != whole {
        recording.notes.push(format!(
            "the number of records is {stated} in the header and {whole} in the file"
        ));
    }
    bounded(whole.saturating_mul(header.samples_a_record()))?;
    let mut signals = Groups::new(&header);
    let mut marks = Vec::new();
    for (number, record) in data.chunks_exact(header.record_bytes()).enumerate() {
        let found = annotations_of(&header, record);
        let regular_secs = number as f64 * header.record_secs;
        let start_secs = found.start_secs.filter(|_| header.is_plus).unwrap_or(regular_secs);
        signals.take(record, start_secs)?;
        marks.extend(found.marks);
    }
    recording.signals = signals.finish();
    let triggers = recording.signals.iter().any(|signal| signal.name == "status");
    if triggers {
        recording
            .notes
            .push("the channel Status has BioSemi's triggers in its lowest 16 bits".into());
    }
    marks.sort_by_key(|mark: &Mark| mark.at_ns);
    if !marks.is_empty() {
        recording.signals.push(Signal::marks("annotations", marks));
    }
    if recording.signals.is_empty() {
        return Err(FormatError::Empty("record with samples"));
    }
    Ok(recording)
}

fn annotations_of(header: &Header, record: &[u8]) -> Annotations {
    let mut found = Annotations::default();
    let mut at = 0;
    for signal in &header.signals {
        let bytes = signal.samples * header.sample_bytes;
        if signal.is_annotations() {
            let of = annotations(&record[at..at + bytes]);
            found.start_secs = found.start_secs.or(of.start_secs);
            found.marks.extend(of.marks);
        }
        at += bytes;
    }
    found
}

/// Groups of signals with the same quantity, unit and rate, such as all electroencephalograms.
struct Groups<'a> {
    header: &'a Header,
    groups: Vec<Group>,
}

struct Group {
    quantity: Quantity,
    samples: usize,
    unit: String,
    /// The indices of the signals in the header.
    places: Vec<usize>,
    runs: Vec<Run>,
}

impl<'a> Groups<'a> {
    fn new(header: &'a Header) -> Groups<'a> {
        let mut groups = Vec::<Group>::new();
        for (place, signal) in header.signals.iter().enumerate() {
            if signal.is_annotations() || signal.samples == 0 || header.record_secs <= 0.0 {
                continue;
            }
            let (quantity, samples, unit) =
                (signal.quantity(), signal.samples, signal.unit.clone());
            let is_same = |group: &&mut Group| {
                quantity != Quantity::Other
                    && (group.quantity, group.samples, &group.unit) == (quantity, samples, &unit)
            };
            match groups.iter_mut().find(is_same) {
                Some(group) => group.places.push(place),
                None => groups.push(Group {
                    quantity,
                    samples,
                    unit,
                    places: vec![place],
                    runs: Vec::new(),
                }),
            }
        }
        Groups { header, groups }
    }

    fn take(&mut self, record: &[u8], start_secs: f64) -> Result<(), FormatError> {
        let header = self.header;
        let starts: Vec<usize> = header.starts().collect();
        let start_ns = nanos(start_secs)
            .ok_or_else(|| FormatError::malformed("the start of a record", "", "seconds"))?;
        for group in &mut self.groups {
            let period_ns = header.record_secs * 1e9 / group.samples as f64;
            let width = group.places.len();
            let follows = group.runs.last().is_some_and(|run| {
                let end_ns =
                    run.start_ns as f64 + run.period_ns * (run.samples.len() / width) as f64;
                (start_ns as f64 - end_ns).abs() <= FOLLOWS_SECS * 1e9
            });
            if !follows {
                group.runs.push(Run { start_ns, period_ns, samples: Vec::new() });
            }
            let Some(run) = group.runs.last_mut() else { continue };
            for sample in 0..group.samples {
                for &place in &group.places {
                    let at = starts[place] + sample * header.sample_bytes;
                    let digital = integer(&record[at..at + header.sample_bytes]);
                    run.samples.push(header.signals[place].physical(digital));
                }
            }
        }
        Ok(())
    }

    fn finish(self) -> Vec<Signal> {
        let header = self.header;
        let signal = |group: Group| {
            let channel = |place: &usize| {
                let EdfSignal { label, unit, .. } = &header.signals[*place];
                Channel::new(label.as_str(), unit.as_str())
            };
            let channels: Vec<Channel> = group.places.iter().map(channel).collect();
            let name = channels[0].name.to_ascii_lowercase();
            let rate_hz = group.samples as f64 / header.record_secs;
            Signal::even(&name, group.quantity, channels, rate_hz, group.runs)
        };
        self.groups.into_iter().map(signal).filter(|signal| !signal.is_empty()).collect()
    }
}

/// A little-endian integer of two or three bytes.
fn integer(bytes: &[u8]) -> i32 {
    match *bytes {
        [low, high] => i16::from_le_bytes([low, high]).into(),
        [low, middle, high] => i32::from_le_bytes([0, low, middle, high]) >> 8,
        _ => 0,
    }
}

/// A cursor over a header.
fn cursor(bytes: &[u8]) -> Cursor<'_> {
    Cursor::new(bytes, "its header")
}
