//! The board: the last that is known of every robot and stream, as lines of text.

use std::collections::{BTreeMap, VecDeque};

use teampulse_core::data::{Data, Event, EventKind, FeatureValues};
use teampulse_core::sample::Record;
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Stream};
use teampulse_core::time::Time;

/// How many of the newest events are shown.
const EVENTS: usize = 5;

/// The last that is known of every robot and stream.
#[derive(Debug, Default)]
pub struct Board {
    streams: BTreeMap<String, StreamStatus>,
    subjects: BTreeMap<String, BTreeMap<&'static str, f64>>,
    events: VecDeque<String>,
    began: Option<Time>,
    now: Time,
    drawn_at: Time,
}

/// The figures that are shown of a subject: the channel of a feature, and how it is written.
const FIGURES: &[(&str, &str, &str)] = &[
    // channel, label, unit
    ("deployed_secs", "deployed", "s"),
    ("power_w", "power", "W"),
    ("percent_per_min", "battery use", "%/min"),
    ("rssi_median", "link", "dBm"),
];

impl Board {
    /// Takes what is new; gives a line for each state that changed and each event.
    pub fn take(&mut self, record: &Record) -> Option<String> {
        self.now = record.sample.log_time;
        self.began.get_or_insert(self.now);
        match &record.sample.data {
            Data::Status(status) => self.take_status(status),
            Data::Event(event) => self.take_event(&record.stream, event),
            Data::Feature(values) => {
                self.take_figures(&record.stream, values);
                None
            }
            _ => None,
        }
    }

    fn take_status(&mut self, status: &StreamStatus) -> Option<String> {
        let known = self.streams.insert(status.name.clone(), status.clone());
        // A stream is declared a moment before its first sample.
        let before = known.map_or(State::Never, |known| known.state);
        (before != status.state)
            .then(|| format!("{} {}", clock_time(self.now), stream_line(status)))
    }

    fn take_event(&mut self, stream: &Stream, event: &Event) -> Option<String> {
        let is_note = stream.name.ends_with("/notes") && event.kind != EventKind::Fault;
        if stream.name.starts_with("/teampulse/lost") || event.kind == EventKind::Beat || is_note {
            return None;
        }
        let value = if event.value.is_nan() { String::new() } else { format!(" {}", event.value) };
        let line = format!("{} {}: {}{value}", clock_time(self.now), event.kind, event.label);
        self.events.push_back(line.clone());
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
        Some(line)
    }

    fn take_figures(&mut self, stream: &Stream, values: &FeatureValues) {
        if stream.about != About::Robot {
            return;
        }
        let figures = self.subjects.entry(stream.id.clone()).or_default();
        for (channel, value) in stream.channels.iter().zip(&values.values) {
            let shown = FIGURES.iter().find(|(name, ..)| name == channel);
            if channel == "online" {
                figures.insert("online", *value);
            } else if let Some((name, ..)) = shown {
                figures.insert(name, *value);
            }
        }
    }

    /// Whether a second of the session has passed since this was last true.
    pub fn take_redraw(&mut self) -> bool {
        let due = self.now.secs_since(self.drawn_at) >= 1.0;
        if due {
            self.drawn_at = self.now;
        }
        due
    }

    /// The board in `rows` lines at most: each robot with its figures, its streams below it, the
    /// newest events. Where that does not fit, streams that are fine are left out.
    pub fn lines(&self, rows: usize) -> Vec<String> {
        let all = self.lines_of(|_| true);
        if all.len() <= rows {
            return all;
        }
        let mut lines = self.lines_of(|status| status.state != State::Ok);
        if lines.len() > rows {
            let hidden = lines.len() + 1 - rows;
            lines.truncate(rows - 1);
            lines.push(format!("… and {hidden} lines more"));
        }
        lines
    }

    fn lines_of(&self, shown: impl Fn(&StreamStatus) -> bool) -> Vec<String> {
        let mut lines = vec![format!(
            "{}  {:.0} s  {} streams",
            clock_time(self.now),
            self.elapsed_secs(),
            self.streams.len()
        )];
        let mut subject = "";
        for (name, status) in &self.streams {
            let of = name.split('/').nth(1).unwrap_or_default();
            if of != subject {
                subject = of;
                lines.push(self.subject_line(of));
            }
            if shown(status) {
                lines.push(format!("  {}", stream_line(status)));
            }
        }
        lines.extend(self.events.iter().cloned());
        lines
    }

    /// What is said when the session ends.
    pub fn summary(&self) -> Vec<String> {
        let total = |count: fn(&StreamStatus) -> u64| self.streams.values().map(count).sum::<u64>();
        let unknown = self.streams.values().filter(|each| each.lost_source.is_none()).count();
        let mut lines = vec![format!(
            "{:.0} s, {} streams, {} messages; lost on the way {}{}, in our queue {}; late {}, twice {}",
            self.elapsed_secs(),
            self.streams.len(),
            total(|each| each.received),
            total(|each| each.lost_source.unwrap_or(0)),
            if unknown > 0 { format!(" (unknown for {unknown} streams)") } else { String::new() },
            total(|each| each.lost_queue),
            total(|each| each.late),
            total(|each| each.duplicates),
        )];
        let troubled = self.streams.values().filter(|status| status.state != State::Ok);
        lines.extend(troubled.map(|status| format!("  {}", stream_line(status))));
        lines
    }

    fn elapsed_secs(&self) -> f64 {
        self.began.map_or(0.0, |began| self.now.secs_since(began))
    }

    fn subject_line(&self, id: &str) -> String {
        let Some(figures) = self.subjects.get(id) else { return id.to_owned() };
        let mut parts = vec![id.to_owned()];
        parts.extend(figures.get("online").map(|online| match online {
            online if *online > 0.0 => "online".to_owned(),
            _ => "OFFLINE".to_owned(),
        }));
        for (channel, label, unit) in FIGURES {
            let value = figures.get(channel).filter(|value| value.is_finite());
            parts.extend(value.map(|value| format!("{label} {value:.1} {unit}")));
        }
        parts.join("  ")
    }
}

/// A stream with its state, rate, age and losses.
fn stream_line(status: &StreamStatus) -> String {
    let lost = match status.lost_source {
        Some(lost) => (lost + status.lost_queue).to_string(),
        None => "?".into(),
    };
    let age = if status.age_secs.is_nan() { "-".into() } else { format!("{:.1}", status.age_secs) };
    let line = format!(
        "{:<34} {:<10} {:>7.1} Hz  age {age:>5} s  lost {lost:>4}",
        status.name, status.state, status.rate_hz
    );
    if status.reason.is_empty() { line } else { format!("{line}  {}", status.reason) }
}

/// The time of day in UTC.
fn clock_time(time: Time) -> String {
    time.to_string()[11..19].to_owned()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytes::Bytes;
    use teampulse_core::sample::{Sample, Turn};
    use teampulse_core::stream::{Shape, StreamId, Subject};

    use super::*;

    fn record(second: i64, name: &str, data: Data) -> Record {
        let stream = Stream::raw(name, Subject::robot("robot1"), Shape::Status);
        let stream = stream.with_channels(&[("deployed_secs", "s"), ("online", "1")]);
        let time = Time::from_nanos(second * 1_000_000_000);
        let sample = Sample {
            stream: StreamId(0),
            measured: time,
            log_time: time,
            device_time: None,
            source_time: None,
            index: 0,
            turn: Turn::OnTime,
            data,
        };
        Record { stream: Arc::new(stream), sample, cdr: Bytes::new() }
    }

    fn status(name: &str, state: State, reason: &str) -> Data {
        Data::Status(Arc::new(StreamStatus {
            name: name.into(),
            state,
            reason: reason.into(),
            rate_hz: 20.0,
            age_secs: 0.05,
            received: 100,
            lost_source: Some(2),
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: 0,
            epoch: 0,
            offset_secs: f64::NAN,
            skew_ppm: f64::NAN,
            jitter_secs: f64::NAN,
            sigma_secs: f64::NAN,
            latency_secs: f64::NAN,
        }))
    }

    fn board() -> Board {
        let mut board = Board::default();
        let figures = FeatureValues {
            window_secs: 0.0,
            coverage: 1.0,
            quality: 1.0,
            values: vec![61.0, 0.0],
            sigmas: Vec::new(),
            reasons: Vec::new(),
        };
        board.take(&record(0, "/robot1/deployment", Data::Feature(Arc::new(figures))));
        board.take(&record(1, "s", status("/robot1/odom", State::Ok, "")));
        board.take(&record(2, "s", status("/robot1/wifi", State::Dead, "silent for 9.0 s")));
        board
    }

    #[test]
    fn a_robot_that_fell_silent_is_never_shown_as_fine() {
        insta::assert_snapshot!(board().lines(50).join("\n"), @r"
        00:00:02  2 s  2 streams
        robot1  OFFLINE  deployed 61.0 s
          /robot1/odom                       ok            20.0 Hz  age   0.1 s  lost    2
          /robot1/wifi                       dead          20.0 Hz  age   0.1 s  lost    2  silent for 9.0 s
        ");
    }

    #[test]
    fn what_is_fine_makes_room_for_what_is_not() {
        insta::assert_snapshot!(board().lines(3).join("\n"), @r"
        00:00:02  2 s  2 streams
        robot1  OFFLINE  deployed 61.0 s
          /robot1/wifi                       dead          20.0 Hz  age   0.1 s  lost    2  silent for 9.0 s
        ");
        assert_eq!(board().lines(2).len(), 2);
    }

    #[test]
    fn only_changes_are_told_line_by_line() {
        let mut board = board();
        assert!(board.take(&record(3, "s", status("/robot1/odom", State::Ok, ""))).is_none());
        let stale = status("/robot1/odom", State::Stale, "silent for 2.0 s");
        assert!(board.take(&record(4, "s", stale)).is_some());
    }
}
