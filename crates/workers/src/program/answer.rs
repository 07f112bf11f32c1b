//! The answers of a program: readings as one line of JSON.

use std::ops::RangeInclusive;
use std::sync::Arc;

use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::source::Reading;
use teampulse_core::time::Time;
use thiserror::Error;

use super::offers::Declared;

/// How much newer than the newest record a reading may be [ns]: a prediction may refer to the near future.
const AHEAD_NS: i64 = 1_000_000_000;
/// How much older than the oldest record a reading may be [ns]: the program may have waited for more records.
const BEHIND_NS: i64 = 3_600_000_000_000;

/// The reason why an answer is invalid.
#[derive(Debug, Error)]
pub(super) enum AnswerError {
    #[error("it is not a JSON array of readings: {0}")]
    Syntax(#[from] serde_json::Error),
    #[error("it has a reading for {name}, but offers {offered}")]
    UnknownStream { name: String, offered: String },
    #[error("a reading for {name} has {count} values instead of {expected}")]
    Count { name: String, count: usize, expected: usize },
    #[error("a reading for {name} is an event: it has a `label` and no `values`")]
    NoLabel { name: String },
    #[error(
        "a reading for {name} has a `time_ns` that is far from the times of all records that it read"
    )]
    Time { name: String },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answered {
    stream: String,
    time_ns: Option<i64>,
    #[serde(default)]
    values: Vec<Option<f64>>,
    label: Option<String>,
    value: Option<f64>,
    duration_secs: Option<f64>,
}

/// The readings of an answer to records with these oldest and newest times. A reading without a time gets the newest
/// time.
pub(super) fn read(
    line: &str,
    asked: RangeInclusive<Time>,
    declared: &Declared,
) -> Result<Vec<Reading>, AnswerError> {
    let answered: Vec<Answered> = serde_json::from_str(line)?;
    let (oldest_ns, newest_ns) = (asked.start().nanos(), asked.end().nanos());
    let reading = |answered: Answered| {
        let Some((stream, width)) = declared.get(&answered.stream) else {
            let names: Vec<_> = declared.names().collect();
            let offered = if names.is_empty() { "nothing".into() } else { names.join(", ") };
            return Err(AnswerError::UnknownStream { name: answered.stream, offered });
        };
        let time_ns = answered.time_ns.unwrap_or(newest_ns);
        let possible = oldest_ns.saturating_sub(BEHIND_NS)..=newest_ns.saturating_add(AHEAD_NS);
        if !possible.contains(&time_ns) {
            return Err(AnswerError::Time { name: answered.stream });
        }
        let source_time = Some(Time::from_nanos(time_ns));
        let data = if width == 0 { event(answered)? } else { sample(answered, width)? };
        Ok(Reading { stream, index: None, device_time: None, source_time, data })
    };
    answered.into_iter().map(reading).collect()
}

fn sample(answered: Answered, expected: usize) -> Result<Data, AnswerError> {
    let count = answered.values.len();
    if count != expected {
        return Err(AnswerError::Count { name: answered.stream, count, expected });
    }
    let values = answered.values.into_iter().map(|value| value.unwrap_or(f64::NAN));
    Ok(Data::Sample(values.collect()))
}

fn event(answered: Answered) -> Result<Data, AnswerError> {
    let Some(label) = answered.label.filter(|_| answered.values.is_empty()) else {
        return Err(AnswerError::NoLabel { name: answered.stream });
    };
    let value = answered.value.unwrap_or(f64::NAN);
    let duration_secs = answered.duration_secs.unwrap_or(0.0);
    Ok(Data::Event(Arc::new(Event { kind: EventKind::Marker, label, value, duration_secs })))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use teampulse_core::clock::Clock;
    use teampulse_core::outlet::Queue;
    use teampulse_core::streams::Streams;

    use super::*;
    use crate::program::offers::Offer;

    #[derive(Deserialize)]
    struct Offers {
        all: Vec<Offer>,
    }

    fn declared() -> Declared {
        let offers = r#"
            all = [
                { name = "/own/score", channels = [{ name = "score", unit = "1" }] },
                { name = "/own/moments" },
            ]"#;
        let Offers { all } = toml::from_str(offers).unwrap();
        let outlet = Queue::new().outlet(Clock::settable(), Streams::default());
        Declared::new(&all, &[], &outlet)
    }

    fn at(nanos: i64) -> Time {
        Time::from_nanos(nanos)
    }

    fn answer(line: &str) -> Result<Vec<Reading>, String> {
        read(line, at(5_000)..=at(7_000), &declared()).map_err(|error| error.to_string())
    }

    #[test]
    fn readings_have_the_time_of_what_was_looked_at() {
        let line = r#"[{"stream": "/own/score", "time_ns": 5000, "values": [0.5]},
                       {"stream": "/own/score", "values": [null]},
                       {"stream": "/own/moments", "label": "smile", "value": 3, "time_ns": 6000}]"#;
        let readings = answer(line).unwrap();
        let times: Vec<_> =
            readings.iter().map(|reading| reading.source_time.unwrap().nanos()).collect();
        assert_eq!(times, [5_000, 7_000, 6_000]);
        let [Data::Sample(known), Data::Sample(unknown), Data::Event(event)] =
            [&readings[0].data, &readings[1].data, &readings[2].data]
        else {
            panic!("{readings:?}");
        };
        assert_eq!((known[0], unknown[0].is_nan()), (0.5, true));
        assert_eq!((event.label.as_str(), event.value, event.duration_secs), ("smile", 3.0, 0.0));
        assert!(answer("[]").unwrap().is_empty());
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (line, wrong) in [
            (
                "",
                "it is not a JSON array of readings: EOF while parsing a value at line 1 column 0",
            ),
            ("hello", "it is not a JSON array of readings: expected value at line 1 column 1"),
            (
                r#"[{"stream": "/x"}]"#,
                "it has a reading for /x, but offers /own/moments, /own/score",
            ),
            (r#"[{"stream": "/own/score"}]"#, "a reading for /own/score has 0 values instead of 1"),
            (
                r#"[{"stream": "/own/moments", "values": [1]}]"#,
                "a reading for /own/moments is an event: it has a `label` and no `values`",
            ),
            (
                r#"[{"stream": "/own/score", "values": [1], "time_ns": 9000000000}]"#,
                // Without the time: the same fault is counted, not listed again for each reading.
                "a reading for /own/score has a `time_ns` that is far from the times of all records that it read",
            ),
        ] {
            assert_eq!(answer(line).unwrap_err(), wrong, "{line}");
        }
        assert!(
            answer(r#"[{"stream": "/own/score", "vals": [1]}]"#)
                .unwrap_err()
                .contains("unknown field")
        );
    }

    proptest! {
        #[test]
        fn no_line_panics(line in ".{0,200}") {
            drop(answer(&line));
        }
    }
}
