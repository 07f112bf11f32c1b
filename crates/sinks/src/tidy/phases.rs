//! A wide table of phases and measures.

mod rows;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use teampulse_core::data::FeatureValues;
use teampulse_core::sample::Record;
use teampulse_core::stream::{About, Channel, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_signal::analysis::Value;

use self::rows::{Row, Rows};
use super::features::{Window, says_nothing};
use super::file::{TextFile, Unwritten, on_one_line, whole};
use super::measures::{
    COVERAGE, Measures, QUALITY, has_coverage, is_of_phases, is_of_statistics, methods, source_of,
};
use super::sidecar::{self, Column, ColumnDescription};
use super::timeline::{Timeline, word_of};
use crate::csv::{cell, number};

/// The name of the file.
pub(super) const NAME: &str = "phases.csv";
/// The name of the file that describes its columns.
pub(super) const SIDECAR: &str = "phases.json";
/// The columns of every table; the columns of measures follow.
pub(super) const COLUMNS: [(&str, Column); 5] = [
    ("subject", Column::of("The subject: a person's pseudonym, or a robot.")),
    ("phase", Column::of("The name of the phase.")),
    (
        "occurrence",
        Column::of("The number of the phase among the subject's phases with this name, from 1."),
    ),
    ("start_secs", Column::united("Start of the phase, since the start of the session.", "s")),
    (
        "duration_secs",
        Column::united(
            "Duration; the values of a phase longer than 600 s are computed from its last 600 s.",
            "s",
        ),
    ),
];
/// The statistics of robots' raw signals that are in the table; the others are in `features.csv`.
const STATISTICS: [&str; 2] = ["mean", "sd"];

/// One row per phase of a subject, one column per measure.
#[derive(Debug)]
pub(super) struct PhaseTable {
    columns: Vec<Known>,
    /// The column indices by measure and source.
    places: BTreeMap<(String, String), usize>,
    streams: BTreeMap<StreamId, (Arc<Stream>, Vec<Option<usize>>)>,
    rows: Rows,
}

/// A column that does not have its final name yet.
#[derive(Debug)]
struct Known {
    measure: String,
    source: String,
    unit: String,
    method: String,
}

impl PhaseTable {
    /// An empty table, to be written into this folder.
    pub(super) fn new(folder: &Path) -> PhaseTable {
        let (places, streams) = (BTreeMap::new(), BTreeMap::new());
        PhaseTable { columns: Vec::new(), places, streams, rows: Rows::new(folder) }
    }

    /// Takes the values of a phase, if they belong in the table.
    pub(super) fn take(&mut self, record: &Record, values: &FeatureValues, timeline: &Timeline) {
        let stream = &record.stream;
        if !is_of_phases(stream) || says_nothing(values) {
            return;
        }
        let window = Window::of(record.sample.measured, values);
        let (subject, section) = (stream.subject(), window.middle());
        let section = timeline.section(&subject, section);
        if section.phase.is_none() {
            return;
        }
        let places = self.places_of(record.sample.stream, stream);
        let shares = [f64::from(values.coverage), f64::from(values.quality)];
        let all = shares.into_iter().chain(values.values.iter().copied());
        let known = places.into_iter().zip(all).filter(|(_, value)| value.is_finite());
        let known = known.filter_map(|(place, value)| Some((place?, value)));
        self.rows.extend((subject, section.begin), known);
    }

    /// The columns of a stream: coverage, quality, and its values.
    fn places_of(&mut self, id: StreamId, stream: &Arc<Stream>) -> Vec<Option<usize>> {
        if let Some((_, places)) = self.streams.get(&id).filter(|(known, _)| **known == **stream) {
            return places.clone();
        }
        let source = source_of(stream);
        let is_signal = has_coverage(stream);
        let shares =
            [COVERAGE, QUALITY].map(|name| (name.to_owned(), "1", String::new(), is_signal));
        let recipes = methods(stream);
        let values = stream.channels.iter().zip(recipes);
        let values = values.map(|(Channel { name, unit, .. }, method)| {
            (name.clone(), unit.as_str(), method.to_owned(), is_listed(stream, name))
        });
        let all: Vec<_> = shares.into_iter().chain(values).collect();
        let mut places = Vec::with_capacity(all.len());
        for (measure, unit, method, is_listed) in all {
            let known = Known { measure, source: source.clone(), unit: unit.to_owned(), method };
            places.push(is_listed.then(|| self.place_of(known)));
        }
        self.streams.insert(id, (Arc::clone(stream), places.clone()));
        places
    }

    fn place_of(&mut self, known: Known) -> usize {
        let key = (known.measure.clone(), known.source.clone());
        let next = self.columns.len();
        let place = *self.places.entry(key).or_insert(next);
        if place == next {
            self.columns.push(known);
        }
        place
    }

    /// Writes the table and the descriptions of its columns.
    pub(super) fn finish(
        &self,
        folder: &Path,
        timeline: &Timeline,
        measures: &Measures,
    ) -> Result<(), Unwritten> {
        let names = self.names();
        let mut columns: Vec<&str> = Vec::new();
        for name in names.iter().flatten() {
            if !columns.contains(&name.as_str()) {
                columns.push(name);
            }
        }
        let head = COLUMNS.iter().map(|(name, _)| (*name).to_owned());
        let head: Vec<String> = head.chain(columns.iter().map(|name| cell(name))).collect();
        let path = folder.join(NAME);
        whole(&path, || self.write_rows(&path, &head, (&names, &columns), timeline))?;
        self.describe(folder, &names, measures)
    }

    fn write_rows(
        &self,
        path: &Path,
        head: &[String],
        (names, columns): (&[Option<String>], &[&str]),
        timeline: &Timeline,
    ) -> Result<(), Unwritten> {
        let mut file = TextFile::create(path.to_owned())?;
        file.push(head.join(","))?;
        let mut occurrences: BTreeMap<(&Subject, &str), u32> = BTreeMap::new();
        let cut = timeline.cut_phases();
        let rows: BTreeSet<&(Subject, Time)> = self.rows.all().into_iter().chain(&cut).collect();
        for of in rows {
            let (subject, begin) = of;
            let phases = timeline.phases_of(subject);
            // A subject's own phase follows the session's phase that it replaces.
            let Some(phase) = phases.iter().rfind(|phase| phase.begin == *begin) else { continue };
            let occurrence = occurrences.entry((subject, &phase.label)).or_default();
            *occurrence += 1;
            let lasted = phase.end.map(|end| format!("{:.3}", end.secs_since(*begin)));
            let mut row = vec![
                cell(word_of(subject)),
                cell(&on_one_line(&phase.label)),
                occurrence.to_string(),
                format!("{:.3}", timeline.secs(*begin)),
                lasted.unwrap_or_default(),
            ];
            let values: Row = self.rows.row(of).map_err(Unwritten::at(path))?;
            let named = values
                .into_iter()
                .filter_map(|(place, value)| Some((names[place].as_deref()?, value)));
            let cells: BTreeMap<&str, f64> = named.collect();
            row.extend(
                columns.iter().map(|name| number(cells.get(name).copied().unwrap_or(f64::NAN))),
            );
            file.push(row.join(","))?;
        }
        file.flush()
    }

    /// Returns the name of each column: its measure, followed by its source if a subject has several; `None` for a
    /// column without values.
    fn names(&self) -> Vec<Option<String>> {
        let mut sources: BTreeMap<(&Subject, &str), BTreeSet<&str>> = BTreeMap::new();
        let mut has_value: BTreeSet<usize> = BTreeSet::new();
        for (subject, places) in self.rows.used() {
            for place in places {
                let Known { measure, source, .. } = &self.columns[*place];
                sources.entry((subject, measure)).or_default().insert(source);
                has_value.insert(*place);
            }
        }
        let several = sources.iter().filter(|(_, sources)| sources.len() > 1);
        let several: BTreeSet<&str> = several.map(|((_, measure), _)| *measure).collect();
        let name = |(place, known): (usize, &Known)| {
            let measure = known.measure.replace('/', ".");
            has_value.contains(&place).then(|| {
                let is_one_of_several =
                    several.contains(known.measure.as_str()) || is_share(&known.measure);
                let of = known.source.replace('/', "_");
                if is_one_of_several { format!("{measure}.{of}") } else { measure }
            })
        };
        self.columns.iter().enumerate().map(name).collect()
    }

    fn describe(
        &self,
        folder: &Path,
        names: &[Option<String>],
        measures: &Measures,
    ) -> Result<(), Unwritten> {
        let mut described = sidecar::columns(&COLUMNS);
        for (name, Known { measure, unit, method, .. }) in names.iter().zip(&self.columns) {
            if let Some(name) = name {
                let values_of =
                    ColumnDescription::measure(measures.meaning_of(measure), unit, method);
                described.entry(name.clone()).or_insert(values_of);
            }
        }
        sidecar::put(folder, SIDECAR, &described)
    }
}

/// Whether the table includes a value of a stream: all values except statistics, and the mean and SD of robots' raw
/// signals.
fn is_listed(stream: &Stream, name: &str) -> bool {
    let (measure, _) = Value::parts(name);
    !is_of_statistics(stream) || stream.about == About::Robot && STATISTICS.contains(&measure)
}

fn is_share(measure: &str) -> bool {
    [COVERAGE, QUALITY].contains(&measure)
}
