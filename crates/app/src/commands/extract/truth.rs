//! Events in tables: the true ones that detected events are scored against, and those around which values are computed.

use std::ops::RangeInclusive;
use std::path::Path;

use super::options::failure;
use super::table::{Table, TableError, Wanted, dates_secs, text_column};
use crate::failure::Failure;

/// True events that an expert marked.
pub enum Marks {
    /// Positions of the events [samples].
    Samples(Vec<f64>),
    /// Times of the events [s].
    Secs(Vec<f64>),
}

impl Marks {
    /// Reads the column `sample`, or `time_secs` or `onset`, of a table. In a table without names, the first column is
    /// read as samples, and a note says so.
    pub fn read(path: &Path) -> Result<(Marks, Option<String>), Failure> {
        let there = match column(path, "sample") {
            Err(TableError::NoColumn { there, .. }) => there,
            read => return Ok((Marks::Samples(read.map_err(failure)?), None)),
        };
        let is_there = |wanted: &&str| there.iter().any(|name| name == wanted);
        if let Some(times) = ["time_secs", "onset"].into_iter().find(is_there) {
            return Ok((Marks::Secs(column(path, times).map_err(failure)?), None));
        }
        if there.first().is_some_and(|name| name == "1") {
            let note = "the first column of --truth has no name and is read as sample numbers: name it `time_secs` if it \
                        holds times";
            let samples = column(path, "1").map_err(failure)?;
            return Ok((Marks::Samples(samples), Some(note.to_owned())));
        }
        let no_column = TableError::NoColumn { wanted: "sample".to_owned(), there };
        Err(failure(no_column).hint(
            "the table of --truth needs the positions of its events in a column `sample`, or their times in `time_secs` or \
             `onset`",
        ))
    }

    /// Returns the positions [samples] in a recording between two times [s] at a rate [Hz], and a note on how the times
    /// were interpreted. Times are on the axis of the recording; if none lies within it, they count from its first
    /// sample.
    pub fn places(
        self,
        (begin_secs, end_secs): (f64, f64),
        rate_hz: f64,
    ) -> (Vec<f64>, Option<String>) {
        let length_secs = end_secs - begin_secs;
        let is_within = |secs: &f64| (0.0..=length_secs).contains(secs);
        let (places, offset_secs, note) = match self {
            Marks::Samples(places) => {
                let is_any_within = places.iter().any(|place| is_within(&(place / rate_hz)));
                (places, 0.0, (!is_any_within).then(|| outside(begin_secs, end_secs)))
            }
            Marks::Secs(times_secs) => {
                let is_on_axis = times_secs.iter().any(|secs| is_within(&(secs - begin_secs)));
                let is_after_first = times_secs.iter().any(is_within);
                let (offset_secs, note) = match (is_on_axis, is_after_first) {
                    (true, _) => (begin_secs, None),
                    (false, true) => (0.0, Some(
                        "the times of --truth are counted from the first sample: none of them lies within the \
                         recording on its time axis".to_owned(),
                    )),
                    (false, false) => (begin_secs, Some(outside(begin_secs, end_secs))),
                };
                (times_secs.into_iter().map(|secs| secs * rate_hz).collect(), offset_secs, note)
            }
        };
        let places = places.into_iter().map(|place| place - offset_secs * rate_hz).collect();
        (places, note)
    }
}

fn outside(begin_secs: f64, end_secs: f64) -> String {
    format!(
        "no event of --truth is within the recording, which runs from {begin_secs:.3} to {end_secs:.3} s"
    )
}

/// The columns with the times of events [s]: in tables that `extract` reads and writes, in `events.tsv`, and in events
/// that `export` writes.
const TIMES: [&str; 3] = ["time_secs", "onset", "measured_secs"];

/// The column of an `events.tsv` that holds the times of events as dates; its other columns hold times in the session.
const DATES: &str = "time";

/// The columns with the labels of events.
const LABELS: [&str; 2] = ["trial_type", "label"];

/// The time axis of a recording.
pub struct Axis<'a> {
    /// The start and end of the recording [s].
    pub within: RangeInclusive<f64>,
    /// Returns the time of a sample [s], if the recording is sampled evenly.
    pub of_sample: Option<&'a dyn Fn(f64) -> f64>,
}

/// Events with their times.
#[derive(Debug, PartialEq)]
pub struct Events {
    /// The time of each event [s].
    pub secs: Vec<f64>,
    /// The label of each event; empty if it has none.
    pub labels: Vec<String>,
    /// The number of events left out, which have no time, or text instead of a number.
    pub left_out: usize,
    /// A note on how the times are read, if the table does not state it.
    pub note: Option<String>,
}

impl Events {
    /// Reads the times of events from the column `time_secs`, `onset` or `measured_secs` of a table, in seconds or as
    /// dates, or from `sample` if samples have times; and their labels from `trial_type` or `label`. If none of these
    /// times is within the recording, but dates in `time` are, as in an `events.tsv`, the dates are used.
    pub fn read(path: &Path, axis: &Axis<'_>) -> Result<Events, TableError> {
        let (secs, note) = match (times(path)?, axis.of_sample) {
            (Some(times), _) => times,
            (None, Some(of_sample)) if text_column(path, "sample")?.is_some() => {
                (cells(path, "sample")?.into_iter().map(of_sample).collect(), String::new())
            }
            (None, _) => (column(path, TIMES[0])?, String::new()),
        };
        let is_any_within = |secs: &[f64]| secs.iter().any(|secs| axis.within.contains(secs));
        let dated = || Some(dates_secs(DATES, &text_column(path, DATES).ok()??)?.0);
        let secs = match (!is_any_within(&secs)).then(dated).flatten() {
            Some(dated) if is_any_within(&dated) => dated,
            _ => secs,
        };
        let mut labels = Vec::new();
        for name in LABELS {
            if labels.is_empty() {
                labels = text_column(path, name)?.unwrap_or_default();
            }
        }
        labels.resize(secs.len(), String::new());
        let all = secs.len();
        let timed = secs.into_iter().zip(labels).filter(|(secs, _)| secs.is_finite());
        let (secs, labels): (Vec<f64>, Vec<String>) = timed.unzip();
        let left_out = all - secs.len();
        Ok(Events { secs, labels, left_out, note: Some(note).filter(|note| !note.is_empty()) })
    }
}

/// Reads the first column of times that a table has, NaN where a time is missing, with a note on how dates are read.
fn times(path: &Path) -> Result<Option<(Vec<f64>, String)>, TableError> {
    for name in TIMES {
        let Some(texts) = text_column(path, name)? else { continue };
        return match cells(path, name) {
            Ok(secs) => Ok(Some((secs, String::new()))),
            Err(error) => dates_secs(name, &texts).map(Some).ok_or(error),
        };
    }
    Ok(None)
}

/// Returns the finite numbers in a column.
fn column(path: &Path, name: &str) -> Result<Vec<f64>, TableError> {
    let mut numbers = cells(path, name)?;
    numbers.retain(|number| number.is_finite());
    Ok(numbers)
}

/// Returns the cells of a column, NaN where there is no number.
fn cells(path: &Path, name: &str) -> Result<Vec<f64>, TableError> {
    let wanted = Wanted {
        signal: "true events",
        words: &[],
        takes_all: false,
        channels: None,
        unit: None,
        is_even: true,
        least_hz: 0.0,
        columns: vec![name.to_owned()],
        time: None,
        decimal: None,
    };
    let mut table = Table::open(path, &wanted, Some(1.0))?;
    let mut cells = Vec::new();
    while let Some(row) = table.next_row()? {
        cells.extend(row.values);
    }
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: Axis<'_> = Axis { within: f64::MIN..=f64::MAX, of_sample: None };

    #[test]
    fn events_of_a_session_are_placed_by_their_dates_where_the_recording_has_dates() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.tsv");
        let text = "onset\ttrial_type\ttime\n\
                    1.5\tgo\t2026-01-05T10:15:00.500Z\n3\tstop\t2026-01-05T10:15:02Z\n";
        std::fs::write(&path, text).unwrap();
        let of = |within| Events::read(&path, &Axis { within, of_sample: None }).unwrap().secs;
        assert_eq!(of(1_767_608_101.0..=1_767_608_200.0), [1_767_608_100.5, 1_767_608_102.0]);
        assert_eq!(of(0.0..=60.0), [1.5, 3.0]);
        assert_eq!(of(100.0..=160.0), [1.5, 3.0], "neither is within");
    }

    #[test]
    fn events_have_their_labels_and_those_without_a_time_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.tsv");
        std::fs::write(&path, "onset\ttrial_type\n1.5\tgo\nn/a\tgo\nnan\tstop\n2\tstop\n").unwrap();
        let events = Events::read(&path, &ANY).unwrap();
        assert_eq!((events.secs, events.left_out, events.note), (vec![1.5, 2.0], 2, None));
        assert_eq!(events.labels, ["go", "stop"]);
    }

    #[test]
    fn events_may_have_dates() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.csv");
        let text =
            "onset,trial_type\n2026-01-05T10:15:00.5Z,go\n,lost\n2026-01-05T10:15:02Z,stop\n";
        std::fs::write(&path, text).unwrap();
        let events = Events::read(&path, &ANY).unwrap();
        assert_eq!(events.secs, [1_767_608_100.5, 1_767_608_102.0]);
        assert_eq!((events.left_out, events.note, &*events.labels[1]), (1, None, "stop"));
        std::fs::write(&path, "time_secs\n2026-01-05 10:15:00\n").unwrap();
        let note = Events::read(&path, &ANY).unwrap().note.unwrap();
        assert!(note.contains("taken as UTC"), "{note}");
    }

    #[test]
    fn true_events_are_samples_or_times_by_the_name_of_their_column() {
        let folder = tempfile::tempdir().unwrap();
        let read = |text: &str| {
            let path = folder.path().join("truth.csv");
            std::fs::write(&path, text).unwrap();
            Marks::read(&path).map_err(|failure| failure.words().1)
        };
        assert!(matches!(read("sample\n7\n"), Ok((Marks::Samples(_), None))));
        assert!(matches!(read("onset\ttrial_type\n1.5\tgo\n"), Ok((Marks::Secs(_), None))));
        let Ok((Marks::Samples(places), Some(note))) = read("0.5\n1.4\n") else {
            panic!("a column without a name holds sample numbers, with a note")
        };
        assert!(places == [0.5, 1.4] && note.contains("read as sample numbers"), "{note}");
        let hint = read("when\n1\n").err().unwrap();
        assert!(hint.contains("--truth") && hint.contains("`onset`"), "{hint}");
    }

    #[test]
    fn true_events_are_on_the_axis_of_the_recording_or_after_its_first_sample() {
        let placed = |secs: &[f64]| Marks::Secs(secs.to_vec()).places((1000.0, 1060.0), 10.0);
        assert_eq!(placed(&[1001.0, 1002.0]), (vec![10.0, 20.0], None));
        let (places, note) = placed(&[1.0, 2.0]);
        assert_eq!(places, [10.0, 20.0]);
        assert!(note.is_some_and(|note| note.contains("from the first sample")));
        let (_, note) = placed(&[5000.0]);
        assert!(
            note.is_some_and(|note| note.contains("no event of --truth is within the recording"))
        );
        assert_eq!(Marks::Samples(vec![7.0]).places((1000.0, 1060.0), 10.0), (vec![7.0], None));
    }
}
