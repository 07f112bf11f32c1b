//! The columns of a stream, and the cells of its records.

use std::io;

use teampulse_core::counted::counted;
use teampulse_core::data::{Data, Event, FeatureValues, Wave};
use teampulse_core::sample::Record;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{Channel, Shape, Stream};
use teampulse_core::time::Time;
use teampulse_messages::cdr::CdrError;
use teampulse_messages::definition::{Definition, DefinitionError};
use teampulse_messages::value::{Value, flatten};

use super::layout::Layout;
use crate::text::harmless;

/// The longest array with a column per element; longer arrays are summarised.
const LONGEST_ARRAY: usize = 64;

/// The columns of a stream.
pub(super) struct Columns {
    layout: Layout,
    definition: Option<Definition>,
    /// The number of values that were left out, as the table would have too many columns.
    left_out: u64,
    /// The number of messages that could not be decoded, and the reason for the first.
    undecoded: Option<(u64, CdrError)>,
    /// Why no message can be decoded, if the definition is invalid.
    undefined: Option<DefinitionError>,
}

impl Columns {
    /// The columns of a stream, given its description and its first record.
    pub(super) fn of(first: &Record, stream: &Stream, definition: Option<Definition>) -> Columns {
        let names = match (&first.sample.data, &definition) {
            (Data::Message(cdr), Some(definition)) => paths(definition, cdr),
            (Data::Message(_), None) => vec!["cdr_bytes".into()],
            (Data::Sample(values), _) => channels(stream, values.len()),
            (Data::Wave(wave), _) => channels(stream, wave.channels as usize),
            _ => of_shape(stream),
        };
        let undefined = match (&stream.shape, &definition) {
            (Shape::Message(schema), None) => Definition::of(schema).err(),
            _ => None,
        };
        let layout = Layout::new(names);
        Columns { layout, definition, left_out: 0, undecoded: None, undefined }
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The number of messages that could not be decoded.
    pub(super) fn undecoded(&self) -> u64 {
        self.undecoded.as_ref().map_or(0, |(count, _)| *count)
    }

    /// The data of the stream that the table lacks, each as a sentence.
    pub(super) fn lacks(&self) -> Vec<String> {
        let undefined = self.undefined.as_ref().map(|error| {
            format!("its table has only the sizes of the messages: failed to {error}")
        });
        let undecoded = self.undecoded.as_ref().map(|(count, error)| {
            let failed = counted(*count, "message has", "messages have");
            format!("{failed} no values in its table: failed to {error}")
        });
        let left_out = (self.left_out > 0).then(|| {
            let left_out = counted(self.left_out, "value has", "values have");
            format!("{left_out} no column in its table, which would have too many columns")
        });
        undefined.into_iter().chain(undecoded).chain(left_out).collect()
    }

    /// Passes each row of a record, with its time, to `row`.
    pub(super) fn rows(
        &mut self,
        record: &Record,
        mut row: impl FnMut(Time, Vec<String>) -> io::Result<()>,
    ) -> io::Result<()> {
        let sample = &record.sample;
        let scale =
            |place: usize| record.stream.channels.get(place).map_or(1.0, |channel| channel.scale);
        match &sample.data {
            Data::Wave(Wave { channels, samples, .. }) => {
                let width = (*channels).max(1) as usize;
                self.widen(width);
                for (place, values) in samples.chunks(width).enumerate() {
                    let after_ns = (sample.period_ns * place as f64).round() as i64;
                    let at = Time::from_nanos(sample.measured.nanos().saturating_add(after_ns));
                    row(at, self.of_numbers(values, scale))?;
                }
                Ok(())
            }
            Data::Sample(values) => {
                self.widen(values.len());
                row(sample.measured, self.of_numbers(values, scale))
            }
            Data::Feature(values) => row(sample.measured, of_window(values)),
            Data::Event(event) => row(sample.measured, of_event(event)),
            Data::Status(status) => row(sample.measured, of_status(status)),
            Data::Description(_) => Ok(()),
            Data::Message(cdr) => row(sample.measured, self.of_message(cdr)),
        }
    }

    /// Adds numbered columns if a sample has more values than its stream has channels.
    fn widen(&mut self, width: usize) {
        for number in self.layout.width()..width {
            self.layout.place(&format!("value{}", number + 1), number.checked_sub(1));
        }
    }

    fn of_numbers(&self, values: &[f64], scale: impl Fn(usize) -> f64) -> Vec<String> {
        let cells = values.iter().enumerate().map(|(place, value)| number(value * scale(place)));
        cells.chain(std::iter::repeat(String::new())).take(self.layout.width()).collect()
    }

    fn of_message(&mut self, cdr: &[u8]) -> Vec<String> {
        let Some(definition) = &self.definition else { return vec![cdr.len().to_string()] };
        let fields = flatten(definition, cdr, LONGEST_ARRAY).unwrap_or_else(|error| {
            self.undecoded.get_or_insert((0, error)).0 += 1;
            Vec::new()
        });
        let mut cells = vec![String::new(); self.layout.width()];
        let mut before = None;
        for (path, value) in &fields {
            let Some(place) = self.layout.place(path, before) else {
                self.left_out += 1;
                continue;
            };
            cells.resize(self.layout.width(), String::new());
            cells[place] = of_value(value);
            before = Some(place);
        }
        cells
    }
}

fn paths(definition: &Definition, cdr: &[u8]) -> Vec<String> {
    let fields = flatten(definition, cdr, LONGEST_ARRAY).unwrap_or_default();
    fields.into_iter().map(|(path, _)| path).collect()
}

/// The names of a stream's channels, with units in brackets; numbered if they are unknown.
fn channels(stream: &Stream, width: usize) -> Vec<String> {
    if stream.channels.len() != width {
        return (1..=width).map(|number| format!("value{number}")).collect();
    }
    stream.channels.iter().map(|channel| with_unit(&channel.name, &channel.unit)).collect()
}

fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

fn of_shape(stream: &Stream) -> Vec<String> {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    match &stream.shape {
        Shape::Feature => {
            let mut columns: Vec<String> = own(&["window_secs", "coverage", "quality"]);
            for Channel { name, unit, .. } in &stream.channels {
                columns.push(with_unit(name, unit));
                columns.push(with_unit(&format!("{name}_sigma"), unit));
                columns.push(format!("{name}_reason"));
            }
            columns
        }
        Shape::Event => own(&["kind", "label", "value", "duration_secs"]),
        Shape::Status => own(&STATUS),
        _ => Vec::new(),
    }
}

/// The columns of the health of streams.
const STATUS: [&str; 17] = [
    "name",
    "state",
    "reason",
    "rate_hz",
    "age_secs",
    "received",
    "lost_source",
    "lost_queue",
    "late",
    "duplicates",
    "clock",
    "epoch",
    "offset_secs",
    "skew_ppm",
    "jitter_secs",
    "sigma_secs",
    "latency_secs",
];

fn of_window(values: &FeatureValues) -> Vec<String> {
    let mut cells = vec![
        values.window_secs.to_string(),
        values.coverage.to_string(),
        values.quality.to_string(),
    ];
    for (k, value) in values.values.iter().enumerate() {
        cells.push(number(*value));
        cells.push(number(values.sigmas.get(k).copied().unwrap_or(f64::NAN)));
        cells.push(values.reasons.get(k).map_or(String::new(), ToString::to_string));
    }
    cells
}

fn of_event(Event { kind, label, value, duration_secs }: &Event) -> Vec<String> {
    vec![kind.to_string(), cell(label), number(*value), number(*duration_secs)]
}

fn of_status(status: &StreamStatus) -> Vec<String> {
    vec![
        cell(&status.name),
        status.state.to_string(),
        cell(&status.reason),
        number(status.rate_hz),
        number(status.age_secs),
        status.received.to_string(),
        status.lost_source.map_or(String::new(), |lost| lost.to_string()),
        status.lost_queue.to_string(),
        status.late.to_string(),
        status.duplicates.to_string(),
        status.clock.to_string(),
        status.epoch.to_string(),
        number(status.offset_secs),
        number(status.skew_ppm),
        number(status.jitter_secs),
        number(status.sigma_secs),
        number(status.latency_secs),
    ]
}

fn of_value(value: &Value) -> String {
    match value {
        Value::Text(text) => cell(text),
        value => quoted(&value.to_string()),
    }
}

/// Formats a time in seconds with nanosecond precision.
pub(crate) fn exact_secs(time: Time) -> String {
    let nanos = time.nanos();
    let sign = if nanos < 0 { "-" } else { "" };
    format!(
        "{sign}{}.{:09}",
        nanos.unsigned_abs() / 1_000_000_000,
        nanos.unsigned_abs() % 1_000_000_000
    )
}

/// Magnitudes below the first or from the second on are written with an exponent.
const WITHOUT_EXPONENT: (f64, f64) = (1e-7, 1e17);

/// Formats a number with all its digits; empty if it is missing, and never a negative zero.
pub(crate) fn number(value: f64) -> String {
    let (least, most) = WITHOUT_EXPONENT;
    let size = value.abs();
    if value.is_nan() {
        String::new()
    } else if size >= most && size.is_finite() || size > 0.0 && size < least {
        format!("{value:e}")
    } else {
        (value + 0.0).to_string()
    }
}

/// Formats a text from outside as a CSV cell that no spreadsheet executes.
pub(crate) fn cell(text: &str) -> String {
    quoted(&harmless(text))
}

/// Formats a text as a CSV cell (RFC 4180).
pub(crate) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_were_and_are_short() {
        for (value, text) in [
            (0.1, "0.1"),
            (-0.0, "0"),
            (1e16, "10000000000000000"),
            (1e300, "1e300"),
            (-f64::MAX, "-1.7976931348623157e308"),
            (5e-324, "5e-324"),
            (0.00002, "0.00002"),
            (f64::NAN, ""),
            (f64::INFINITY, "inf"),
        ] {
            let found = number(value);
            assert_eq!(found, text);
            assert!(
                value.is_nan()
                    || found
                        .parse::<f64>()
                        .is_ok_and(|read| read.total_cmp(&(value + 0.0)).is_eq())
            );
        }
    }
}
