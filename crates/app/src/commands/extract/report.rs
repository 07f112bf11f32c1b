//! Results of `extract` as JSON.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use teampulse_core::units;
use teampulse_signal::agreement::Agreement;
use teampulse_signal::analysis::{Event, Measured, Span, Value};

use super::found::Found;

/// All results of `extract`.
#[derive(Debug, Serialize)]
pub struct Report {
    signal: &'static str,
    /// The sampling rate; null for intervals, which have none.
    rate_hz: Option<f64>,
    method: &'static str,
    /// Notes on the table, as printed on standard error.
    notes: Vec<String>,
    events: Vec<Happened>,
    features: Vec<Row>,
    /// The values around events.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    around: Vec<EventRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    score: Option<Vec<Score>>,
}

/// A value computed over a window.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Null if and only if `reason` is given.
    value: Option<f64>,
    unit: String,
    start_secs: f64,
    end_secs: f64,
    coverage: f64,
    quality: f64,
    method: String,
    reason: Option<String>,
}

/// A value computed around an event.
#[derive(Debug, Serialize)]
struct EventRow {
    name: String,
    /// Null if and only if `reason` is given.
    value: Option<f64>,
    unit: String,
    event_secs: f64,
    /// The label of the event in its table.
    #[serde(skip_serializing_if = "String::is_empty")]
    label: String,
    coverage: f64,
    quality: f64,
    method: String,
    reason: Option<String>,
}

/// An event with its position and details, written as one object.
#[derive(Debug)]
struct Happened {
    kind: &'static str,
    sample: f64,
    time_secs: f64,
    details: Vec<(&'static str, Option<f64>)>,
}

impl Serialize for Happened {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(Some(3 + self.details.len()))?;
        object.serialize_entry("kind", self.kind)?;
        object.serialize_entry("sample", &self.sample)?;
        object.serialize_entry("time_secs", &self.time_secs)?;
        for (name, value) in &self.details {
            object.serialize_entry(name, value)?;
        }
        object.end()
    }
}

/// The agreement with the true events.
#[derive(Debug, Serialize)]
pub struct Score {
    pub(super) tolerance_ms: f64,
    pub(super) tp: usize,
    pub(super) fp: usize,
    #[serde(rename = "fn")]
    pub(super) missed: usize,
    pub(super) f1: Option<f64>,
    pub(super) sensitivity: Option<f64>,
    pub(super) precision: Option<f64>,
    pub(super) median_offset_ms: Option<f64>,
}

impl Score {
    /// Turns an agreement, whose offset is in samples, into a score with its offset in ms.
    pub fn new(tolerance_secs: f64, agreement: &Agreement, rate_hz: f64) -> Score {
        Score {
            tolerance_ms: tolerance_secs * 1e3,
            tp: agreement.hits,
            fp: agreement.extra,
            missed: agreement.missed,
            f1: finite(agreement.f1()),
            sensitivity: finite(agreement.sensitivity()),
            precision: finite(agreement.precision()),
            median_offset_ms: finite(agreement.median_offset / rate_hz * 1e3),
        }
    }
}

impl Report {
    /// Creates a report for a signal.
    pub fn new(
        signal: &'static str,
        rate_hz: Option<f64>,
        method: &'static str,
        found: &Found,
        score: Option<Vec<Score>>,
    ) -> Report {
        let mut events: Vec<&Event> = found.events.iter().collect();
        events.sort_by_key(|event| event.at_ns);
        Report {
            signal,
            rate_hz,
            method,
            notes: found.notes.clone(),
            events: events.into_iter().map(event).collect(),
            features: found.windows.iter().flat_map(|window| rows(&found.values, window)).collect(),
            around: found
                .around
                .events
                .iter()
                .zip(&found.around.labels)
                .flat_map(|(event, label)| around(&found.around.values, event, label))
                .collect(),
            score,
        }
    }
}

fn event(event: &Event) -> Happened {
    let detail = |(name, value): &(&'static str, f64)| (*name, finite(*value));
    Happened {
        kind: event.kind,
        sample: event.sample,
        time_secs: secs(event.at_ns),
        details: event.details.iter().map(detail).collect(),
    }
}

fn rows<'a>(
    values: &'a [Value],
    (span, measured): &'a (Span, Measured),
) -> impl Iterator<Item = Row> + 'a {
    values.iter().zip(&measured.values).map(|(value, found)| Row {
        name: value.name.clone().into_owned(),
        value: found.ok().map(positive_zero),
        unit: units::spelt(&value.unit),
        start_secs: secs(span.begin_ns),
        end_secs: secs(span.end_ns),
        coverage: measured.coverage,
        quality: measured.quality,
        method: value.method.clone().into_owned(),
        reason: found.err().map(|reason| reason.to_string()),
    })
}

fn around<'a>(
    values: &'a [Value],
    (event_secs, measured): &'a (f64, Measured),
    label: &'a str,
) -> impl Iterator<Item = EventRow> + 'a {
    values.iter().zip(&measured.values).map(|(value, found)| EventRow {
        name: value.name.clone().into_owned(),
        value: found.ok().map(positive_zero),
        unit: units::spelt(&value.unit),
        event_secs: *event_secs,
        label: label.to_owned(),
        coverage: measured.coverage,
        quality: measured.quality,
        method: value.method.clone().into_owned(),
        reason: found.err().map(|reason| reason.to_string()),
    })
}

/// Converts nanoseconds to seconds.
pub fn secs(at_ns: i64) -> f64 {
    at_ns as f64 / 1e9
}

/// Turns `-0.0`, which an empty sum may yield, into `0.0`.
fn positive_zero(value: f64) -> f64 {
    value + 0.0
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_value_of_an_empty_sum_is_zero_without_a_sign() {
        let empty: f64 = [0.0; 0].iter().sum();
        assert!(positive_zero(empty).is_sign_positive());
        assert_eq!(positive_zero(-1.5).to_string(), "-1.5");
    }
}
