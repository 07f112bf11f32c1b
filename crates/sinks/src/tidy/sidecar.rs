//! Descriptions of the tidy files' columns: JSON next to each table, as in BIDS.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};
use teampulse_core::data::{EventKind, Reason};

use super::file::{Unwritten, write};
use super::measures::Measures;
use super::{events, features, intervals};

/// A column's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    description: &'static str,
    units: &'static str,
}

impl Column {
    pub(super) const fn of(description: &'static str) -> Column {
        Column::united(description, "")
    }

    pub(super) const fn united(description: &'static str, units: &'static str) -> Column {
        Column { description, units }
    }
}

/// The description of a column, with the keys of BIDS.
#[derive(Debug, Default, Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct ColumnDescription {
    description: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    units: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    method: String,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    levels: BTreeMap<String, Value>,
}

impl ColumnDescription {
    /// The description of a measure's column.
    pub(super) fn measure(description: String, units: &str, method: &str) -> ColumnDescription {
        let (units, method) = (units.to_owned(), method.to_owned());
        ColumnDescription { description, units, method, levels: BTreeMap::new() }
    }
}

/// The descriptions of a table's columns, by name.
pub(super) fn columns(all: &[(&str, Column)]) -> BTreeMap<String, ColumnDescription> {
    let described = |(name, column): &(&str, Column)| {
        let (description, units) = (column.description.to_owned(), column.units.to_owned());
        (
            (*name).to_owned(),
            ColumnDescription { description, units, ..ColumnDescription::default() },
        )
    };
    all.iter().map(described).collect()
}

/// Writes the descriptions of the events' columns.
pub(super) fn write_events(folder: &Path) -> Result<(), Unwritten> {
    let mut described = columns(&events::COLUMNS);
    if let Some(kinds) = described.get_mut("trial_type") {
        let all = EventKind::ALL.iter().filter(|kind| **kind != EventKind::Beat);
        kinds.levels = all.map(|kind| (kind.to_string(), json!(meaning(*kind)))).collect();
        kinds.levels.insert(events::NOTICE.to_owned(), json!(NOTICE));
    }
    put(folder, events::SIDECAR, &described)
}

/// Writes the descriptions of the features' columns and measures.
pub(super) fn write_features(folder: &Path, measures: &Measures) -> Result<(), Unwritten> {
    let mut described = columns(&features::COLUMNS);
    if let Some(reasons) = described.get_mut("reason") {
        let lacks = Reason::ALL.iter().filter(|reason| **reason != Reason::Ok);
        reasons.levels = lacks.map(|reason| (reason.to_string(), json!(why(*reason)))).collect();
    }
    if let Some(names) = described.get_mut("measure") {
        let all = measures.all().iter();
        names.levels = all.map(|(name, measure)| (name.clone(), json!(measure))).collect();
    }
    put(folder, features::SIDECAR, &described)
}

/// Writes the descriptions of the intervals' columns.
pub(super) fn write_intervals(folder: &Path) -> Result<(), Unwritten> {
    put(folder, intervals::SIDECAR, &columns(&intervals::COLUMNS))
}

pub(super) fn put(
    folder: &Path,
    name: &str,
    columns: &BTreeMap<String, ColumnDescription>,
) -> Result<(), Unwritten> {
    let text = serde_json::to_string_pretty(columns).expect("texts are JSON");
    write(&folder.join(name), text + "\n")
}

/// The meaning of a notice.
const NOTICE: &str = "a conclusion of teampulse about a robot, a person, a sensor or the team that is not a fault (it is back, an alert is over, answered or unknown, how a number is interpreted), or a note of the session itself (a command had no effect, what was kept is in a bag); the label states which; value, if something is over: how long it had lasted at this onset [s]";

/// The meaning of an event kind and its value.
fn meaning(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Phase => "a phase of the study began; the label is its name",
        EventKind::Marker => {
            "a person or a program set a marker: a key, a stimulus, a press; the label is its text; \
             value: the number sent with it; for a press, the reaction time [s]"
        }
        EventKind::Report => {
            "a self-report of a person; value, for isa: the workload from 1 (idle) to 5 (too much)"
        }
        EventKind::Beat => "the heartbeat; value: interval since the previous beat [ms]",
        EventKind::Response => "the skin responded; value: its height [uS]",
        EventKind::Breath => "a breath began; value: its depth, in the unit of the sensor",
        EventKind::Burst => {
            "a muscle was active; value: the peak of its envelope, in the unit of the sensor"
        }
        EventKind::Blink => "the eyes blinked; value: the height of the blink [uV]",
        EventKind::Intervention => {
            "a person stepped in and commanded a robot; value: the number of commands"
        }
        EventKind::Command => "a command to the session; the label is its sender and the command",
        EventKind::Fault => {
            "a fault, or an alert; the label states which; value, for an alert of the study: the number that was beyond \
             its limit, in the unit given in the label"
        }
        EventKind::Clock => "a clock stepped or restarted [s], or the session ended",
    }
}

/// The meaning of a reason, in a sentence.
fn why(reason: Reason) -> &'static str {
    match reason {
        Reason::Ok => "there is a value",
        Reason::Short => "the window is too short for this value, or not yet full",
        Reason::Gap => "too much of the window has no data",
        Reason::Quality => "the signal was too poor to be judged",
        Reason::Missing => "no sensor here provides this quantity",
        Reason::Undefined => "the formula is undefined for these data",
        Reason::NoBaseline => "no phase named baseline has ended, or nothing was measured in it",
        Reason::Nothing => {
            "what is measured, such as speech, has not happened in the window, or is over"
        }
        Reason::BriefBaseline => {
            "too little of the baseline is known: a difference needs nearly two windows, a z-score five"
        }
    }
}
