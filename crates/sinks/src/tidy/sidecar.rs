//! What the columns of the tidy files are: JSON beside each table, as BIDS has it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::Serialize;
use teampulse_core::data::{EventKind, Reason};

use super::file::Unwritten;
use super::{events, features};

/// What a column is: the keys are those of BIDS.
#[derive(Debug, Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Column {
    description: &'static str,
    #[serde(skip_serializing_if = "str::is_empty")]
    units: &'static str,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    levels: BTreeMap<String, &'static str>,
}

impl Column {
    pub(super) const fn of(description: &'static str) -> Column {
        Column::united(description, "")
    }

    pub(super) const fn united(description: &'static str, units: &'static str) -> Column {
        Column { description, units, levels: BTreeMap::new() }
    }
}

/// Writes what the columns of both tables are.
pub(super) fn write(folder: &Path) -> Result<(), Unwritten> {
    let mut of_events: BTreeMap<&str, Column> = events::COLUMNS.into_iter().collect();
    if let Some(kinds) = of_events.get_mut("trial_type") {
        let told = EventKind::ALL.iter().filter(|kind| **kind != EventKind::Beat);
        kinds.levels = told.map(|kind| (kind.to_string(), meaning(*kind))).collect();
    }
    let mut of_features: BTreeMap<&str, Column> = features::COLUMNS.into_iter().collect();
    if let Some(reasons) = of_features.get_mut("reason") {
        let lacks = Reason::ALL.iter().filter(|reason| **reason != Reason::Ok);
        reasons.levels = lacks.map(|reason| (reason.to_string(), why(*reason))).collect();
    }
    put(folder, events::SIDECAR, &of_events)?;
    put(folder, features::SIDECAR, &of_features)
}

fn put(folder: &Path, name: &str, columns: &BTreeMap<&str, Column>) -> Result<(), Unwritten> {
    let path = folder.join(name);
    let text = serde_json::to_string_pretty(columns).expect("texts are JSON");
    fs::write(&path, text + "\n").map_err(Unwritten::at(&path))
}

/// What an event of a kind is, with what its value is.
fn meaning(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Phase => "a phase of the study began; the label is its name",
        EventKind::Marker => {
            "somebody or a program set a mark, or something of a robot is over; the label is its text; \
             value, of what is over: how long it had lasted until this onset [s]"
        }
        EventKind::Report => {
            "a person reported; isa: value is the workload from 1 (idle) to 5 (too much)"
        }
        EventKind::Beat => "the heart beat; value: interval since the beat before [ms]",
        EventKind::Response => "the skin responded; value: its height [uS]",
        EventKind::Breath => "a breath began; value: its depth, in the unit of the sensor",
        EventKind::Burst => {
            "a muscle was active; value: the peak of its envelope, in the unit of the sensor"
        }
        EventKind::Blink => "the eyes blinked; value: the height of the blink [uV]",
        EventKind::Intervention => {
            "a person stepped in and commanded a robot; value: how many commands it took"
        }
        EventKind::Fault => "something went wrong; the label says what",
        EventKind::Clock => "a clock stepped or began anew [s], or the session ended",
    }
}

/// What a reason says, in a sentence.
fn why(reason: Reason) -> &'static str {
    match reason {
        Reason::Ok => "there is a value",
        Reason::Short => "the window is too short for this value, or not yet full",
        Reason::Gap => "too much of the window has no data",
        Reason::Quality => "the signal was too poor to be judged",
        Reason::Missing => "no sensor here gives this quantity",
        Reason::Undefined => "the formula has no answer for these data",
        Reason::NoBaseline => "no phase named baseline is over, or nothing was measured in it",
        Reason::Nothing => "what this would tell of has not happened, or is no more",
        Reason::BriefBaseline => {
            "too little of the baseline is known: a difference needs nearly two windows, z five"
        }
    }
}
