//! The interface for programs: `/api`, in JSON.

use axum::extract::rejection::{JsonRejection, QueryRejection};
use axum::extract::{FromRequestParts, Query, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::access::Grant;
use crate::acts::{self, Cause, Doer, Refusal};
use crate::hub::{Hub, Known};
use crate::server::Shared;
use crate::wire::Stream;

/// The largest number of columns in an answer.
const MOST_POINTS: u32 = 4000;

/// The routes below `/api`.
pub fn routes() -> Router<Shared> {
    Router::new()
        .route("/api", get(index))
        .route("/api/streams", get(streams))
        .route("/api/latest", get(latest))
        .route("/api/history", get(history))
        .route("/api/events", post(post_event))
}

/// An overview of the routes.
async fn index(State(shared): State<Shared>) -> Json<Value> {
    Json(json!({
        "session": shared.hub.context.session,
        "began_unix_secs": shared.hub.began().secs(),
        "now": shared.hub.now(),
        "times": "seconds since the session began",
        "GET /api/streams": "every stream: name, signal, subject, channels with units, method",
        "GET /api/latest?stream=NAME": "the newest values, of one stream or of all, with the health of raw streams",
        "GET /api/history?stream=NAME&from=SECS&to=SECS&points=N":
            "up to ten minutes in columns with the smallest, largest and mean value of each channel; negative times \
            count from now",
        "POST /api/events": "{\"label\": \"robot lost\"} sets a marker; {\"note\": \"…\"} writes a note; \
            {\"scale\": \"isa\", \"value\": 3, \"subject\": \"p001\"} reports on any scale (only isa, from 1 to 5, \
            counts in estimates); add \"at\" [s] or \"unix\" [s] unless it happened now",
        "GET /metrics": "for Prometheus",
        "WebSocket /ws": "the same data live, as sent to the pages",
    }))
}

/// Whether some streams are hidden from programs because viewers must stay blind.
fn is_blind(shared: &Shared) -> bool {
    shared.hub.context.is_blinding
}

async fn streams(State(shared): State<Shared>) -> Json<Vec<Stream>> {
    let known = shared.hub.known();
    let is_blind = is_blind(&shared);
    Json(known.streams.keys().filter_map(|id| known.stream(*id, is_blind)).collect())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OfStream {
    stream: Option<String>,
}

async fn latest(State(shared): State<Shared>, Asked(asked): Asked<OfStream>) -> Response {
    let known = shared.hub.known();
    let is_blind = is_blind(&shared);
    let chosen: Vec<u32> = match &asked.stream {
        Some(name) => match known.named.get(name) {
            Some(id) => vec![*id],
            None => return no_stream(name),
        },
        None => known.streams.keys().copied().collect(),
    };
    let shown = chosen.into_iter().filter(|id| known.shows(*id, is_blind));
    let values: serde_json::Map<String, Value> =
        shown.filter_map(|id| latest_of(&known, id)).collect();
    Json(Value::Object(values)).into_response()
}

/// Returns a stream's name, and its newest values by channel with its health; `None` if it has neither.
fn latest_of(known: &Known, id: u32) -> Option<(String, Value)> {
    let stream = known.streams.get(&id)?;
    let health = known.health.get(&id);
    let named = |values: &[Option<f64>]| -> Value {
        let channels = stream.channels.iter().zip(values);
        let of = channels.map(|(channel, value)| {
            (channel.name.clone(), json!({ "value": value, "unit": channel.unit }))
        });
        Value::Object(of.collect())
    };
    let mut answer = serde_json::Map::new();
    if let Some(feature) = known.features.get(&id) {
        answer.insert("t".into(), json!(feature.t));
        answer.insert("quality".into(), json!(feature.quality));
        answer.insert("coverage".into(), json!(feature.coverage));
        answer.insert("values".into(), named(&feature.values));
    } else if let Some(sample) = known.samples.get(&id) {
        answer.insert("t".into(), json!(sample.t));
        answer.insert("values".into(), named(&sample.values));
    }
    if let Some(health) = health {
        answer.insert("health".into(), json!(health));
    }
    (!answer.is_empty()).then(|| (stream.name.clone(), Value::Object(answer)))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Span {
    stream: String,
    from: Option<f64>,
    to: Option<f64>,
    points: Option<u32>,
}

async fn history(State(shared): State<Shared>, Asked(asked): Asked<Span>) -> Response {
    for (name, time) in [("from", asked.from), ("to", asked.to)] {
        if time.is_some_and(|time| !time.is_finite()) {
            return refused_query(&format!("{name}: not a number"));
        }
    }
    if asked.points == Some(0) {
        return refused_query("points: expected 1 or more");
    }
    let now = shared.hub.now();
    // Negative times count from now.
    let time = |asked: Option<f64>, otherwise: f64| {
        let asked = asked.unwrap_or(otherwise);
        if asked < 0.0 { now + asked } else { asked }
    };
    let (from, to) = (time(asked.from, 0.0), time(asked.to, now));
    if from >= to && (asked.from.is_some() || asked.to.is_some()) {
        return refused_query(&format!(
            "the span from {from:.1} s to {to:.1} s of the session is empty"
        ));
    }
    let known = shared.hub.known();
    let id = known.named.get(&asked.stream).filter(|id| known.shows(**id, is_blind(&shared)));
    let Some(id) = id else { return no_stream(&asked.stream) };
    let Some(track) = known.tracks.get(id) else {
        let error = format!("{:?} has no stored values", asked.stream);
        let hint = "only streams of waves, samples and features have a history";
        return refused(StatusCode::NOT_FOUND, &error, hint);
    };
    let points = asked.points.unwrap_or(600).min(MOST_POINTS);
    let excerpt = track.excerpt(from, to, points);
    let channels =
        known.streams.get(id).into_iter().flat_map(|stream| &stream.channels).zip(excerpt.channels);
    let channels = channels.map(|(channel, column)| {
        let (name, unit) = (&channel.name, &channel.unit);
        json!({ "name": name, "unit": unit, "min": column.min, "max": column.max, "mean": column.mean })
    });
    let channels: Vec<Value> = channels.collect();
    let (from, step) = (excerpt.from, excerpt.step);
    Json(json!({ "stream": asked.stream, "from": from, "step": step, "channels": channels }))
        .into_response()
}

/// A marker, a note or a self-report of a program, and its time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Posted {
    label: Option<String>,
    note: Option<String>,
    scale: Option<String>,
    value: Option<f64>,
    subject: Option<String>,
    at: Option<f64>,
    unix: Option<f64>,
}

impl Posted {
    /// The time of the event [s of the session]; `None` for now.
    fn time(&self, hub: &Hub) -> Result<Option<f64>, Refusal> {
        let began = hub.began().secs();
        match (self.at, self.unix) {
            (Some(_), Some(_)) => {
                Err(Refusal::new("the event has two times", "give either `at` or `unix`"))
            }
            (at, None) => Ok(at),
            (None, Some(unix)) => {
                let (first, last) = acts::times(hub.now());
                if (first..=last).contains(&(unix - began)) {
                    return Ok(Some(unix - began));
                }
                let reason = format!("{unix} is not within the last minute of the session");
                let (first, last) = (began + first, began + last);
                let hint = format!("expected seconds since 1970 from {first:.1} to {last:.1}");
                Err(Refusal::new(reason, &hint))
            }
        }
    }

    /// Records the event.
    fn record(&self, doer: &Doer<'_>, at: Option<f64>) -> Result<(), Refusal> {
        if let Some(reason) = self.contradiction() {
            return Err(Refusal::new(reason, KINDS));
        }
        match (&self.label, &self.note, &self.scale, self.value) {
            (Some(label), None, None, _) => doer.mark(label, at, String::new()),
            (None, Some(note), None, _) => doer.note(note, at, String::new()),
            (None, None, Some(scale), Some(value)) => {
                doer.report(scale, self.subject.as_deref(), (value, at), String::new())
            }
            (None, None, Some(_), None) => Err(Refusal::new("a `scale` needs a `value`", KINDS)),
            _ => {
                Err(Refusal::new("the event is neither a marker, a note nor a self-report", KINDS))
            }
        }
    }

    /// Returns a remark if the event is a report about an unknown person.
    fn remark(&self, doer: &Doer<'_>) -> Option<String> {
        let subject = self.subject.as_deref()?;
        let others = doer.others_than(subject)?;
        Some(format!(
            "nobody named {subject} is known (known people: {others}); the report is still recorded"
        ))
    }

    /// Describes which keys of the event exclude each other, if any do.
    fn contradiction(&self) -> Option<String> {
        let kinds = [
            ("label", self.label.is_some()),
            ("note", self.note.is_some()),
            ("scale", self.scale.is_some()),
        ];
        let of_report = [("value", self.value.is_some()), ("subject", self.subject.is_some())];
        let given = |keys: &[(&'static str, bool)]| -> Vec<&'static str> {
            keys.iter().filter(|(_, is_given)| *is_given).map(|(key, _)| *key).collect()
        };
        match (&given(&kinds)[..], &given(&of_report)[..]) {
            ([one, other, ..], _) => {
                Some(format!("the event has `{one}` and `{other}`, which exclude each other"))
            }
            ([kind @ ("label" | "note")], [key, ..]) => {
                Some(format!("the event has a `{kind}` with `{key}`, which belongs to a `scale`"))
            }
            _ => None,
        }
    }
}

/// The hint on what can be posted.
const KINDS: &str = "expected {\"label\": …}, {\"note\": …} or {\"scale\": …, \"value\": …}, \
    as application/json, with `at` or `unix` unless it happened now";

async fn post_event(
    State(shared): State<Shared>,
    Extension(grant): Extension<Grant>,
    posted: Result<Json<Posted>, JsonRejection>,
) -> Response {
    let posted = match posted {
        Ok(Json(posted)) => posted,
        Err(error) => {
            let text = error.body_text();
            let reason = text.strip_prefix(NOT_OF_TYPE).unwrap_or(&text);
            return refused(error.status(), &reason.replace("field", "key"), KINDS);
        }
    };
    if !shared.may_post() {
        let error = "too many events were posted per second";
        return answer(StatusCode::TOO_MANY_REQUESTS, json!({ "error": error }));
    }
    let hub = &*shared.hub;
    let doer = Doer { hub, right: grant.right, sender: grant.sender(), client: None };
    let now = hub.now();
    let done = posted.time(hub).and_then(|at| posted.record(&doer, at).map(|()| at));
    match done {
        Ok(at) => {
            let mut body = json!({ "t": at.unwrap_or(now) });
            if let Some(remark) = posted.remark(&doer) {
                body["note"] = remark.into();
            }
            answer(StatusCode::OK, body)
        }
        Err(Refusal { cause, reason, hint }) => refused(status_of(cause), &reason, &hint),
    }
}

/// The start of axum's message about JSON of an unexpected type, before the reason.
const NOT_OF_TYPE: &str = "Failed to deserialize the JSON body into the target type: ";

fn status_of(cause: Cause) -> StatusCode {
    match cause {
        Cause::Invalid => StatusCode::UNPROCESSABLE_ENTITY,
        Cause::NotAllowed => StatusCode::FORBIDDEN,
    }
}

fn no_stream(name: &str) -> Response {
    let error = format!("there is no stream {name:?}");
    refused(StatusCode::NOT_FOUND, &error, "GET /api/streams lists them")
}

/// The query of a request; an invalid query is answered in JSON.
struct Asked<T>(T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Asked<T> {
    type Rejection = Response;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Asked<T>, Response> {
        let asked = Query::from_request_parts(parts, state).await;
        asked.map(|Query(asked)| Asked(asked)).map_err(|rejection| wrong_query(&rejection))
    }
}

/// Phrases of the parser, and the phrases that are shown instead.
const SERDE: [(&str, &str); 6] = [
    ("unknown field", "unknown parameter"),
    ("duplicate field", "more than one parameter"),
    ("missing field", "missing parameter"),
    ("invalid float literal", "not a number"),
    ("cannot parse float from empty string", "empty, not a number"),
    ("invalid digit found in string", "not a whole number, 0 or more"),
];

/// The answer to a query with a missing or wrong value.
fn wrong_query(rejection: &QueryRejection) -> Response {
    let text = rejection.body_text();
    let reason = text.split_once(": ").map_or(&*text, |(_, reason)| reason);
    let reason =
        SERDE.iter().fold(reason.to_owned(), |text, (theirs, ours)| text.replace(theirs, ours));
    refused_query(&reason)
}

fn refused_query(reason: &str) -> Response {
    let hint = "`stream` is a name, `from` and `to` are seconds since the session began, or before now if they \
        are negative, and `points` is a whole number above 0";
    refused(StatusCode::BAD_REQUEST, &format!("the query is wrong: {reason}"), hint)
}

/// The answer to a refused request; an empty hint is omitted.
fn refused(status: StatusCode, error: &str, hint: &str) -> Response {
    let body = json!({ "error": error, "hint": hint });
    answer(status, if hint.is_empty() { json!({ "error": error }) } else { body })
}

fn answer(status: StatusCode, body: Value) -> Response {
    (status, Json(body)).into_response()
}
