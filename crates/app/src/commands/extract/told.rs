//! What is told of a recording: for machines and for people.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use teampulse_signal::agreement::Agreement;
use teampulse_signal::analysis::{Event, Measured, Span, Value};

use crate::output;

/// Everything that was found.
#[derive(Debug, Serialize)]
pub struct Told {
    signal: &'static str,
    /// Null for intervals, which come at no rate.
    rate_hz: Option<f64>,
    method: &'static str,
    events: Vec<Happened>,
    features: Vec<Row>,
    #[serde(skip_serializing_if = "Option::is_none")]
    score: Option<Vec<Score>>,
}

/// One value of one window.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    /// Null exactly when `reason` says why.
    value: Option<f64>,
    unit: String,
    start_secs: f64,
    end_secs: f64,
    coverage: f64,
    quality: f64,
    method: String,
    reason: Option<String>,
}

/// An event, its details beside its place: an object each.
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

/// How the events agree with an expert's.
#[derive(Debug, Serialize)]
pub struct Score {
    tolerance_ms: f64,
    tp: usize,
    fp: usize,
    #[serde(rename = "fn")]
    missed: usize,
    f1: Option<f64>,
    sensitivity: Option<f64>,
    precision: Option<f64>,
    median_offset_ms: Option<f64>,
}

impl Score {
    /// The agreement of events in samples at a rate.
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

/// What an analysis found.
pub struct Found {
    /// What the values of each window are.
    pub values: Vec<Value>,
    /// Events in the order of their becoming known.
    pub events: Vec<Event>,
    /// Each window with what it told.
    pub windows: Vec<(Span, Measured)>,
    /// How many samples are missing by their times.
    pub missing: usize,
    /// How many rows were left out, because they are not after the one before them.
    pub left_out: usize,
}

impl Found {
    /// Nothing yet, of these values.
    pub fn of(values: &[Value]) -> Found {
        Found {
            values: values.to_vec(),
            events: Vec::new(),
            windows: Vec::new(),
            missing: 0,
            left_out: 0,
        }
    }

    /// Counts how many samples were missing before a row; `None` for one that was left out.
    pub fn count(&mut self, missing: Option<usize>) {
        match missing {
            Some(missing) => self.missing += missing,
            None => self.left_out += 1,
        }
    }
}

impl Told {
    /// Of what was found in a signal.
    pub fn new(
        signal: &'static str,
        rate_hz: Option<f64>,
        method: &'static str,
        found: &Found,
        score: Option<Vec<Score>>,
    ) -> Told {
        let mut events: Vec<&Event> = found.events.iter().collect();
        events.sort_by_key(|event| event.at_ns);
        Told {
            signal,
            rate_hz,
            method,
            events: events.into_iter().map(event).collect(),
            features: found.windows.iter().flat_map(|window| rows(&found.values, window)).collect(),
            score,
        }
    }

    /// Prints the events as a table with commas.
    pub fn print_events(&self) {
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in self.events.iter().flat_map(|event| &event.details) {
            if !names.contains(name) {
                names.push(name);
            }
        }
        output::line([&["kind", "sample", "time_secs"], &names[..]].concat().join(","));
        output::lines(self.events.iter().map(|event| {
            let mut cells = vec![event.kind.to_owned(), event.sample.to_string()];
            cells.push(event.time_secs.to_string());
            cells.extend(names.iter().map(|name| {
                let detail = event.details.iter().find(|(each, _)| each == name);
                let value = detail.and_then(|(_, value)| *value);
                value.map_or_else(String::new, |value| value.to_string())
            }));
            cells.join(",")
        }));
    }

    /// Prints windows with their values, then how these were computed.
    pub fn print(&self) {
        let mut window = None;
        for row in &self.features {
            if window != Some((row.start_secs.to_bits(), row.end_secs.to_bits())) {
                window = Some((row.start_secs.to_bits(), row.end_secs.to_bits()));
                let (coverage, quality) = (100.0 * row.coverage, row.quality);
                output::line(format!(
                    "{} to {} s   {coverage:.0} % of the data   quality {quality:.2}",
                    shown_secs(row.start_secs),
                    shown_secs(row.end_secs)
                ));
            }
            let value = match (row.value, &row.reason) {
                (Some(value), _) => format!("{:>12} {}", shown(value), shown_unit(&row.unit)),
                (None, reason) => format!("{:>12} {}", "-", reason.as_deref().unwrap_or_default()),
            };
            output::line(format!("  {:<32}{value}", row.name).trim_end());
        }
        self.print_recipes();
        output::line(format!("\n{} {}", self.events.len(), self.kinds()));
        for score in self.score.iter().flatten() {
            output::line(score.shown());
        }
    }

    /// Says on standard error how the events agree with an expert's.
    pub fn say_score(&self) {
        self.score.iter().flatten().for_each(|score| eprintln!("{}", score.shown()));
    }

    /// What the events are, in words.
    fn kinds(&self) -> String {
        let mut kinds: Vec<&str> = self.events.iter().map(|event| event.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        match kinds[..] {
            [] => "events".to_owned(),
            _ => kinds.iter().map(|kind| format!("{kind}s")).collect::<Vec<_>>().join(" and "),
        }
    }

    /// Prints how each value was computed; what several recipes have in common stands once.
    fn print_recipes(&self) {
        let mut told: Vec<(&str, Vec<(&str, &str)>)> = Vec::new();
        for row in &self.features {
            let (recipe, common) = row.method.split_once("; ").unwrap_or((&row.method, ""));
            // Of several channels, that of one stands for all.
            let name = row.name.split('/').next().unwrap_or_default();
            match told.iter_mut().find(|(each, _)| *each == common) {
                Some((_, recipes)) if recipes.contains(&(name, recipe)) => {}
                Some((_, recipes)) => recipes.push((name, recipe)),
                None => told.push((common, vec![(name, recipe)])),
            }
        }
        output::line(format!("\nhow, {}:", self.method));
        for (common, recipes) in told {
            output::lines(recipes.iter().map(|(name, recipe)| format!("  {name:<26}{recipe}")));
            if !common.is_empty() {
                output::line(format!("      all of these: {common}"));
            }
        }
    }
}

impl Score {
    fn shown(&self) -> String {
        let percent = |share: Option<f64>| {
            share.map_or("-".into(), |share| format!("{:.2} %", 100.0 * share))
        };
        format!(
            "within {:.0} ms of the truth: F1 {}, sensitivity {}, precision {} ({} found, {} missed, {} extra), median offset {} ms",
            self.tolerance_ms,
            percent(self.f1),
            percent(self.sensitivity),
            percent(self.precision),
            self.tp,
            self.missed,
            self.fp,
            self.median_offset_ms.map_or("-".into(), |offset| format!("{offset:.1}")),
        )
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
    values.iter().zip(&measured.values).map(|(value, told)| Row {
        name: value.name.clone().into_owned(),
        value: told.ok(),
        unit: value.unit.clone().into_owned(),
        start_secs: secs(span.begin_ns),
        end_secs: secs(span.end_ns),
        coverage: measured.coverage,
        quality: measured.quality,
        method: value.method.clone().into_owned(),
        reason: told.err().map(|reason| reason.to_string()),
    })
}

fn secs(at_ns: i64) -> f64 {
    at_ns as f64 / 1e9
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A time to the millisecond.
fn shown_secs(secs: f64) -> String {
    format!("{secs:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A number with six digits that count.
fn shown(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = 5 - value.abs().log10().floor() as i32;
    if !(0..=12).contains(&digits) {
        return format!("{value:.5e}");
    }
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

fn shown_unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_with_six_digits() {
        let numbers = [0.0, 72.0, 72.123_456, -0.001_234_567, 123_456.7, 1e-20, 3e20];
        let expected = ["0", "72", "72.1235", "-0.00123457", "123457", "1.00000e-20", "3.00000e20"];
        assert_eq!(numbers.map(shown), expected);
    }
}
