//! `/metrics`, in the text format of Prometheus.

use std::fmt::Write;

use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};

use crate::hub::{Hub, Known};
use crate::machine::{memory_bytes, processor_secs};
use crate::server::Shared;
use crate::wire::StreamHealth;

const FORMAT: &str = "text/plain; version=0.0.4; charset=utf-8";
/// The states of a stream; the index is the value of the metric.
const STATES: [&str; 5] = ["never", "ok", "degraded", "stale", "dead"];

/// Answers with all metrics.
pub async fn answer(State(shared): State<Shared>) -> Response {
    ([(CONTENT_TYPE, FORMAT)], text(&shared.hub)).into_response()
}

/// Reads a metric from the health of a stream; `None` if it is unknown.
type Figure = fn(&StreamHealth) -> Option<f64>;

/// The metrics of each raw stream: name, type, help text, and how to read it.
const FIGURES: [(&str, &str, &str, Figure); 8] = [
    ("stream_state", "gauge", "0 never seen, 1 ok, 2 degraded, 3 stale, 4 dead", |health| {
        STATES.iter().position(|state| *state == health.state).map(|state| state as f64)
    }),
    ("stream_rate_hz", "gauge", "Rate over the last seconds", |health| Some(health.rate_hz)),
    ("stream_age_seconds", "gauge", "Time since the last sample", |health| health.age_secs),
    ("stream_latency_seconds", "gauge", "Median time from measurement to arrival", |health| {
        health.latency_secs
    }),
    (
        "stream_uncertainty_seconds",
        "gauge",
        "Half the width of the 95 % interval of a sample's time",
        |health| health.uncertainty_secs,
    ),
    ("stream_received_total", "counter", "Samples received", |health| Some(health.received as f64)),
    ("stream_lost_on_the_way_total", "counter", "Samples lost in transit", |health| {
        health.lost_source.map(|lost| lost as f64)
    }),
    ("stream_lost_in_queue_total", "counter", "Samples lost in teampulse's queue", |health| {
        Some(health.lost_queue as f64)
    }),
];

/// All metrics of a session.
fn text(hub: &Hub) -> String {
    let mut text = String::new();
    let mut one = |name: &str, kind: &str, what: &str, value: f64| {
        head(&mut text, name, kind, what);
        line(&mut text, name, &[], value);
    };
    one("session_seconds", "gauge", "Time since the session began", hub.now());
    one("viewers", "gauge", "Connected browsers", f64::from(hub.viewers()));
    one(
        "viewers_cut_off_total",
        "counter",
        "Browsers that the dashboard disconnected",
        hub.cut_off() as f64,
    );
    one("cpu_seconds_total", "counter", "Processor time of teampulse", processor_secs());
    if let Some(bytes) = memory_bytes() {
        one("memory_bytes", "gauge", "Memory of teampulse", bytes as f64);
    }
    let known = hub.known();
    one(
        "dashboard_skipped_total",
        "counter",
        "Records that the dashboard skipped",
        known.skipped as f64,
    );
    if let Some(recording) = &known.recording {
        one(
            "recording_bytes",
            "gauge",
            "Size of the recording on the disk",
            recording.bytes as f64,
        );
        if let Some(free) = recording.free_bytes {
            one("disk_free_bytes", "gauge", "Free space on the disk of the recording", free as f64);
        }
        if let Some(age) = recording.sync_age_secs {
            one("recording_sync_age_seconds", "gauge", "Time since the recording last grew", age);
        }
    }
    streams(&mut text, &known);
    features(&mut text, &known, hub.context.is_blinding);
    text
}

fn streams(text: &mut String, known: &Known) {
    for (name, kind, what, figure) in FIGURES {
        head(text, name, kind, what);
        for (id, health) in &known.health {
            let stream = known.streams.get(id);
            if let (Some(stream), Some(value)) = (stream, figure(health)) {
                line(text, name, &[("stream", &stream.name), ("subject", &stream.id)], value);
            }
        }
    }
}

fn features(text: &mut String, known: &Known, is_blind: bool) {
    head(text, "feature", "gauge", "The newest value of a feature");
    for (id, feature) in known.features.iter().filter(|(id, _)| known.shows(**id, is_blind)) {
        let Some(stream) = known.streams.get(id) else { continue };
        for (channel, value) in stream.channels.iter().zip(&feature.values) {
            let labels = [
                ("stream", &*stream.name),
                ("subject", &stream.id),
                ("channel", &channel.name),
                ("unit", &channel.unit),
            ];
            if let Some(value) = value {
                line(text, "feature", &labels, *value);
            }
        }
    }
}

fn head(text: &mut String, name: &str, kind: &str, what: &str) {
    writeln!(text, "# HELP teampulse_{name} {what}.\n# TYPE teampulse_{name} {kind}")
        .expect("writing into memory does not fail");
}

fn line(text: &mut String, name: &str, labels: &[(&str, &str)], value: f64) {
    let escaped =
        |value: &str| value.replace('\\', r"\\").replace('"', "\\\"").replace('\n', r"\n");
    let labels = labels.iter().map(|(name, value)| format!("{name}=\"{}\"", escaped(value)));
    let labels: Vec<String> = labels.collect();
    let labels =
        if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
    writeln!(text, "teampulse_{name}{labels} {value}").expect("writing into memory does not fail");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_anything_in_it_stays_a_label() {
        let mut text = String::new();
        line(&mut text, "x", &[("stream", "/a\"} 1\n\\b")], 0.5);
        assert_eq!(text, "teampulse_x{stream=\"/a\\\"} 1\\n\\\\b\"} 0.5\n");
    }
}
