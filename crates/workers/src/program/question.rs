//! The lines that a program reads: records in JSON.

use std::collections::HashMap;
use std::sync::Arc;

use serde_json::{Map, Value, json};
use teampulse_core::data::{Data, Wave};
use teampulse_core::sample::Record;
use teampulse_core::stream::{Schema, Shape};
use teampulse_core::time::Time;
use teampulse_messages::definition::Definition;
use teampulse_messages::value::{self, flatten};

/// The longest array in a message whose values are written; for longer ones, only the length is written.
const LONGEST_ARRAY: usize = 1024;

/// Writes a request to the program, with its time, as a line: an array with one object.
pub(super) fn request(request: &str, at: Time) -> String {
    let mut line = json!([{ "command": request, "time_ns": at.nanos() }]).to_string();
    line.push('\n');
    line
}

/// Writes the lines; caches message definitions.
#[derive(Default)]
pub(super) struct Questions {
    definitions: HashMap<Arc<Schema>, Option<Definition>>,
}

impl Questions {
    /// Writes records as one line: a JSON array with one object for each record.
    pub(super) fn line(&mut self, records: &[Record]) -> String {
        let records: Vec<Value> = records.iter().map(|record| self.object(record)).collect();
        let mut line = Value::from(records).to_string();
        line.push('\n');
        line
    }

    fn object(&mut self, record: &Record) -> Value {
        let (stream, sample) = (&record.stream, &record.sample);
        let mut object = Map::new();
        let mut put = |key: &str, value: Value| drop(object.insert(key.to_owned(), value));
        put("stream", json!(stream.name));
        put("about", json!(stream.about.word()));
        put("id", json!(stream.id));
        put("time_ns", json!(sample.measured.nanos()));
        put("index", json!(sample.index));
        let channels = || stream.channels.iter().map(|channel| channel.name.as_str());
        match &sample.data {
            Data::Sample(values) => {
                put("channels", channels().collect());
                put("values", scaled(record, values));
            }
            Data::Wave(Wave { channels: width, samples, .. }) => {
                put("channels", channels().collect());
                put("period_ns", json!(sample.period_ns));
                let rows = samples.chunks((*width).max(1) as usize);
                put("samples", rows.map(|row| scaled(record, row)).collect());
            }
            Data::Feature(window) => {
                put("channels", channels().collect());
                put("window_secs", json!(window.window_secs));
                put("coverage", json!(window.coverage));
                put("quality", json!(window.quality));
                put("values", json!(window.values));
            }
            Data::Event(event) => {
                put("kind", json!(event.kind.word()));
                put("label", json!(event.label));
                put("value", json!(event.value));
                put("duration_secs", json!(event.duration_secs));
            }
            Data::Status(status) => {
                put("of", json!(status.name));
                put("state", json!(status.state.to_string()));
                put("reason", json!(status.reason));
            }
            Data::Description(described) => put("of", json!(described.name)),
            Data::Message(cdr) => {
                if let Shape::Message(schema) = &stream.shape {
                    put("type", json!(schema.name));
                    put("fields", self.fields(schema, cdr));
                }
            }
        }
        Value::Object(object)
    }

    /// The fields of a message by their paths; null if its definition is unknown.
    fn fields(&mut self, schema: &Arc<Schema>, cdr: &[u8]) -> Value {
        let read = || Definition::of(schema).ok();
        let definition = self.definitions.entry(Arc::clone(schema)).or_insert_with(read);
        let fields = definition.as_ref().and_then(|known| flatten(known, cdr, LONGEST_ARRAY).ok());
        let fields =
            fields.map(|fields| fields.into_iter().map(|(path, value)| (path, json(value))));
        fields.map_or(Value::Null, |fields| Value::Object(fields.collect()))
    }
}

/// Numbers in the units of their channels; null for NaN.
fn scaled(record: &Record, values: &[f64]) -> Value {
    let scale =
        |place: usize| record.stream.channels.get(place).map_or(1.0, |channel| channel.scale);
    values.iter().enumerate().map(|(place, value)| value * scale(place)).collect()
}

fn json(value: value::Value) -> Value {
    match value {
        value::Value::Bool(value) => json!(value),
        value::Value::Int(value) => json!(value),
        value::Value::Uint(value) => json!(value),
        value::Value::Float32(value) => json!(value),
        value::Value::Float64(value) => json!(value),
        value::Value::Text(value) => json!(value),
        many @ value::Value::Many(_) => json!(many.to_string()),
    }
}
