//! The board: the last that is known of every person, robot and stream, as lines of text.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use teampulse_core::data::{Data, Event, FeatureValues};
use teampulse_core::sample::Record;
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Signal, Stream};
use teampulse_core::time::Time;

use super::estimates::{Estimates, is_estimate};
use super::happening::told;
use super::person::Person;
use super::robot::Figures;
use super::team::Team;

/// How many of the newest events are shown.
const EVENTS: usize = 5;

/// After how many statuses a stream's rate is settled: before, a window is not full.
const SETTLED: u32 = 3;

/// The last that is known of every person, robot and stream.
#[derive(Debug, Default)]
pub struct Board {
    streams: BTreeMap<String, Watched>,
    /// The streams of what happens: one that is silent lacks nothing.
    happenings: BTreeSet<String>,
    team: Team,
    people: BTreeMap<String, Person>,
    robots: BTreeMap<String, Figures>,
    estimates: BTreeMap<String, Estimates>,
    events: VecDeque<String>,
    began: Option<Time>,
    now: Time,
    drawn_at: Time,
}

/// A stream with its last status.
#[derive(Debug)]
struct Watched {
    status: StreamStatus,
    /// Its statuses since it was first seen.
    statuses: u32,
    /// The state that was told last.
    told: State,
}

impl Board {
    /// Takes what is new; gives a line for each state that changed and each event.
    pub fn take(&mut self, record: &Record) -> Option<String> {
        self.now = record.sample.log_time;
        self.began.get_or_insert(self.now);
        match &record.sample.data {
            Data::Status(status) => self.take_status(status),
            Data::Event(event) => self.take_event(&record.stream, event),
            Data::Feature(values) => {
                self.take_figures(&record.stream, values, record.sample.measured);
                None
            }
            Data::Description(stream) => {
                if matches!(stream.signal, Signal::Event | Signal::Input) {
                    self.happenings.insert(stream.name.clone());
                }
                None
            }
            _ => None,
        }
    }

    fn take_status(&mut self, status: &StreamStatus) -> Option<String> {
        let stream =
            self.streams.entry(status.name.clone()).or_insert_with(|| Watched::new(status));
        let is_news = stream.take(status);
        is_news.then(|| format!("{} {}", clock_time(self.now), full_line(status)))
    }

    fn take_event(&mut self, stream: &Stream, event: &Event) -> Option<String> {
        self.team.take_event(stream, event);
        let line = format!("{} {}", clock_time(self.now), told(stream, event)?);
        self.events.push_back(line.clone());
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
        Some(line)
    }

    fn take_figures(&mut self, stream: &Stream, values: &FeatureValues, at: Time) {
        self.team.take(stream, values);
        match stream.about {
            _ if stream.id.is_empty() => {}
            About::Robot => {
                self.robots.entry(stream.id.clone()).or_default().take(stream, values);
            }
            About::Person if is_estimate(stream) => {
                self.estimates.entry(stream.id.clone()).or_default().take(stream, values);
            }
            About::Person => {
                self.people.entry(stream.id.clone()).or_default().take(stream, values, at);
            }
            About::Team | About::Session => {}
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

    /// The board in `rows` lines at most: each person and robot with their figures, their streams below
    /// them, the newest events. Where that does not fit, streams that are fine are left out.
    pub fn lines(&self, rows: usize) -> Vec<String> {
        let all = self.lines_of(|_| true);
        if all.len() <= rows {
            return all;
        }
        let mut lines = self.lines_of(|status| self.is_trouble(status));
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
        lines.extend(self.team.line());
        for (id, person) in &self.people {
            lines.push(id.clone());
            lines.extend(person.lines(self.now));
            lines.extend(self.streams_of(|name| within_person(id, name), &shown));
        }
        lines.extend(self.estimates.iter().map(|(id, estimates)| estimates.line(id)));
        for (id, figures) in &self.robots {
            lines.push(figures.line(id));
            lines.extend(self.streams_of(|name| within(id, name), &shown));
        }
        let others = self.statuses().filter(|status| !self.is_of_somebody(&status.name));
        let others: Vec<_> = others.filter(|status| shown(status)).collect();
        if !others.is_empty() {
            lines.push("other streams".into());
            lines.extend(others.into_iter().map(|status| board_line(&status.name, status)));
        }
        lines.extend(self.events.iter().cloned());
        lines
    }

    fn statuses(&self) -> impl Iterator<Item = &StreamStatus> {
        self.streams.values().map(|stream| &stream.status)
    }

    /// A line for each stream that is shown and has a name within its subject.
    fn streams_of<'a>(
        &'a self,
        within: impl Fn(&'a str) -> Option<&'a str>,
        shown: impl Fn(&StreamStatus) -> bool,
    ) -> impl Iterator<Item = String> {
        let own = self.statuses().filter(move |status| shown(status));
        own.filter_map(move |status| Some(board_line(within(&status.name)?, status)))
    }

    fn is_trouble(&self, status: &StreamStatus) -> bool {
        let is_awaited = status.state == State::Never && self.happenings.contains(&status.name);
        status.state != State::Ok && !is_awaited
    }

    fn is_of_somebody(&self, name: &str) -> bool {
        self.robots.keys().any(|id| within(id, name).is_some())
            || self.people.keys().any(|id| within_person(id, name).is_some())
    }

    /// What is said when the session ends.
    pub fn summary(&self) -> Vec<String> {
        let total = |count: fn(&StreamStatus) -> u64| self.statuses().map(count).sum::<u64>();
        let unknown = self.statuses().filter(|each| each.lost_source.is_none()).count();
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
        lines.extend(self.team.line());
        let troubled = self.statuses().filter(|status| self.is_trouble(status));
        lines.extend(troubled.map(|status| format!("  {}", full_line(status))));
        lines
    }

    fn elapsed_secs(&self) -> f64 {
        self.began.map_or(0.0, |began| self.now.secs_since(began))
    }
}

impl Watched {
    fn new(status: &StreamStatus) -> Watched {
        // A stream is declared a moment before its first sample.
        Watched { status: status.clone(), statuses: 0, told: State::Never }
    }

    /// Takes the newest status; says whether it is to be told.
    fn take(&mut self, status: &StreamStatus) -> bool {
        self.status.clone_from(status);
        self.statuses = self.statuses.saturating_add(u32::from(status.state != State::Never));
        let settled = status.state != State::Ok || self.statuses >= SETTLED;
        let is_news = settled && self.told != status.state;
        if is_news {
            self.told = status.state;
        }
        is_news
    }
}

/// The name of a robot's stream within the robot; `None` for a stream of another.
fn within<'a>(id: &str, name: &'a str) -> Option<&'a str> {
    name.strip_prefix('/')?.strip_prefix(id)?.strip_prefix('/')
}

/// The name of a person's stream below the person, wherever people stand: `polar_h10/ecg`.
fn within_person<'a>(id: &str, name: &'a str) -> Option<&'a str> {
    let (_, below) = name.split_once(&format!("/{id}/"))?;
    Some(below)
}

/// A stream on the board: narrow, so that 80 columns show how its reason begins.
fn board_line(name: &str, status: &StreamStatus) -> String {
    let StreamStatus { state, rate_hz, reason, .. } = status;
    let (age, lost) = (age(status), lost(status));
    let remark = if reason.is_empty() { certainty(status) } else { reason.clone() };
    let line = format!(
        "  {name:<20} {state:<10}{rate_hz:>6.1} Hz  age {age:>4} s  lost {lost:<3}  {remark}"
    );
    line.trim_end().to_owned()
}

/// How certain the times of a stream are; empty where that is unknown.
fn certainty(status: &StreamStatus) -> String {
    let millis = 1e3 * status.uncertainty_secs();
    if millis.is_nan() { String::new() } else { format!("±{millis:.1} ms") }
}

/// A stream with its full name, state, rate, age and losses.
fn full_line(status: &StreamStatus) -> String {
    let StreamStatus { name, state, rate_hz, reason, .. } = status;
    let (age, lost) = (age(status), lost(status));
    let line = format!(
        "{name:<34} {state:<10} {rate_hz:>7.1} Hz  age {age:>5} s  lost {lost:>4}  {reason}"
    );
    line.trim_end().to_owned()
}

/// The age of a stream's last sample [s].
fn age(status: &StreamStatus) -> String {
    if status.age_secs.is_nan() { "-".into() } else { format!("{:.1}", status.age_secs) }
}

/// How many samples were lost.
fn lost(status: &StreamStatus) -> String {
    let lost = status.lost_source.map(|lost| lost + status.lost_queue);
    lost.map_or("?".into(), |lost| lost.to_string())
}

/// The time of day in UTC.
fn clock_time(time: Time) -> String {
    time.to_string()[11..19].to_owned()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bytes::Bytes;
    use teampulse_core::data::Reason;
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
            period_ns: 0.0,
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
            sigma_secs: 0.0005,
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
        robot1  OFFLINE  deployed 1:01
          odom                 ok          20.0 Hz  age  0.1 s  lost 2    ±1.0 ms
          wifi                 dead        20.0 Hz  age  0.1 s  lost 2    silent for 9.0 s
        ");
    }

    #[test]
    fn what_is_fine_makes_room_for_what_is_not() {
        insta::assert_snapshot!(board().lines(3).join("\n"), @r"
        00:00:02  2 s  2 streams
        robot1  OFFLINE  deployed 1:01
          wifi                 dead        20.0 Hz  age  0.1 s  lost 2    silent for 9.0 s
        ");
        assert_eq!(board().lines(2).len(), 2);
    }

    #[test]
    fn what_belongs_to_no_robot_keeps_its_name_under_a_heading_of_its_own() {
        let mut board = board();
        board.take(&record(3, "s", status("/tf", State::Ok, "")));
        board.take(&record(3, "s", status("/robot10/odom", State::Ok, "")));
        let lines = board.lines(50);
        let other = lines.iter().position(|line| line == "other streams").unwrap();
        assert!(lines[other + 1].starts_with("  /robot10/odom "));
        assert!(lines[other + 2].starts_with("  /tf "));
    }

    #[test]
    fn that_nothing_happened_yet_is_no_trouble() {
        let mut board = board();
        let stream = Stream::raw("/robot1/goal_pose", Subject::robot("robot1"), Shape::Event);
        let commands = Stream { signal: Signal::Input, ..stream };
        let told = status("/robot1/goal_pose", State::Never, "no sample yet");
        board.take(&record(3, "/teampulse/streams", Data::Description(Arc::new(commands))));
        board.take(&record(3, "s", told));
        assert!(board.lines(50).iter().any(|line| line.contains("goal_pose")));
        assert!(!board.lines(4).iter().any(|line| line.contains("goal_pose")));
        assert!(!board.summary().iter().any(|line| line.contains("goal_pose")));
    }

    #[test]
    fn a_person_stands_above_the_robots_with_what_is_worn() {
        let mut board = board();
        let person = Subject { about: About::Person, id: "p001".into() };
        let ecg = Stream::raw("/humans/persons/p001/strap/ecg", person, Shape::Wave);
        let heart = Stream::derived(&ecg, "heart/w30", Shape::Feature);
        let told = FeatureValues {
            window_secs: 30.0,
            coverage: 1.0,
            quality: 0.9,
            values: vec![72.0],
            sigmas: Vec::new(),
            reasons: vec![Reason::Ok],
        };
        let mut told = record(2, "", Data::Feature(Arc::new(told)));
        told.stream = Arc::new(heart.with_channels(&[("ECG_Rate_Mean", "bpm")]));
        board.take(&told);
        board.take(&record(3, "s", status(&ecg.name, State::Ok, "")));
        insta::assert_snapshot!(board.lines(50)[..5].join("\n"), @r"
        00:00:03  3 s  3 streams
        p001
          heart    72 /min  age  1.0 s  ecg
          strap/ecg            ok          20.0 Hz  age  0.1 s  lost 2    ±1.0 ms
        robot1  OFFLINE  deployed 1:01
        ");
    }

    #[test]
    fn a_reason_begins_within_80_columns() {
        let lines = board().lines(50);
        assert!(lines.iter().any(|line| line.find("silent").is_some_and(|at| at <= 66)));
    }

    #[test]
    fn only_changes_are_told_line_by_line() {
        let mut board = board();
        let ok = || status("/robot1/odom", State::Ok, "");
        assert!(board.take(&record(3, "s", ok())).is_none());
        assert!(board.take(&record(4, "s", ok())).is_some());
        assert!(board.take(&record(5, "s", ok())).is_none());
        let stale = status("/robot1/odom", State::Stale, "silent for 2.0 s");
        assert!(board.take(&record(6, "s", stale)).is_some());
    }

    #[test]
    fn a_stream_is_told_as_fine_once_its_rate_is_settled_and_at_once_when_it_is_not() {
        let mut board = Board::default();
        let mut take = |state| board.take(&record(1, "s", status("/robot1/odom", state, "")));
        let told =
            [State::Never, State::Ok, State::Ok, State::Ok].map(|state| take(state).is_some());
        assert_eq!(told, [false, false, false, true]);
        assert!(take(State::Degraded).is_some());
    }
}
