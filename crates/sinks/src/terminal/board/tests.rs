//! Tests of what the board shows, and of the changes that it reports.

use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::alerts::ALERTS;
use teampulse_core::sample::Turn;
use teampulse_core::stream::{Shape, StreamId, Window};

use super::*;

pub(in crate::terminal) fn record(second: i64, stream: Stream, data: Data) -> Record {
    let time = Time::from_nanos(second * 1_000_000_000);
    let id = stream.name.bytes().fold(7u32, |id, byte| id.wrapping_mul(31) ^ u32::from(byte));
    let sample = Sample {
        stream: StreamId(id),
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

pub(in crate::terminal) fn status(
    second: i64,
    name: &str,
    (state, reason): (State, &str),
    age_secs: f64,
) -> Record {
    let status = StreamStatus {
        name: name.into(),
        state,
        reason: reason.into(),
        rate_hz: 20.0,
        age_secs,
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
    };
    let stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    record(second, stream, Data::Status(Arc::new(status)))
}

pub(in crate::terminal) fn figures(second: i64, stream: Stream, values: &[f64]) -> Record {
    let values = FeatureValues {
        window_secs: 30.0,
        coverage: 1.0,
        quality: 0.97,
        values: values.to_vec(),
        sigmas: Vec::new(),
        reasons: vec![teampulse_core::data::Reason::Ok; values.len()],
    };
    record(second, stream, Data::Feature(Arc::new(values)))
}

pub(in crate::terminal) fn robot(second: i64, id: &str, channels: &[(&str, f64)]) -> Record {
    let named: Vec<(&str, &str)> = channels.iter().map(|(name, _)| (*name, "1")).collect();
    let values: Vec<f64> = channels.iter().map(|(_, value)| *value).collect();
    let stream = Stream::raw(format!("/{id}/deployment"), Subject::robot(id), Shape::Feature);
    figures(second, stream.with_channels(&named), &values)
}

pub(in crate::terminal) fn happens(
    second: i64,
    stream: Stream,
    (kind, label): (EventKind, &str),
    duration_secs: f64,
) -> Record {
    let event = Event { kind, label: label.into(), value: f64::NAN, duration_secs };
    record(second, stream, Data::Event(Arc::new(event)))
}

pub(in crate::terminal) fn person() -> Subject {
    Subject { about: About::Person, id: "p001".into() }
}

pub(in crate::terminal) fn heart(second: i64, per_min: f64) -> Record {
    let ecg = Stream::raw("/humans/persons/p001/strap/ecg", person(), Shape::Wave);
    let heart = Stream::derived(&ecg, "heart", Shape::Feature).over(Window::of_secs(30.0));
    figures(second, heart.with_channels(&[("ECG_Rate_Mean", "bpm")]), &[per_min])
}

const OK: (State, &str) = (State::Ok, "");
const DEAD: (State, &str) = (State::Dead, "silent for 9.7 s");

fn board(records: impl IntoIterator<Item = Record>) -> Board {
    let mut board = Board::default();
    records.into_iter().for_each(|record| drop(take(&mut board, &record)));
    board
}

/// Takes a record; the stream of a status is declared first, about a person, a robot or neither.
pub(in crate::terminal) fn take(board: &mut Board, record: &Record) -> Vec<String> {
    if let Data::Status(status) = &record.sample.data {
        let name = &status.name;
        let tokens: Vec<&str> = name.split('/').skip(1).collect();
        let subject = match tokens[..] {
            ["humans", ..] => person(),
            [robot, _] => Subject::robot(robot),
            _ => Subject::session(),
        };
        if board.known.find(name).is_none() {
            board.known.declare(Stream::raw(name, subject, Shape::Sample));
        }
    }
    board.take(record)
}

fn text(lines: &[StyledLine]) -> String {
    lines.iter().map(StyledLine::text).collect::<Vec<_>>().join("\n")
}

#[test]
fn of_a_robot_that_is_offline_no_stream_is_a_trouble_of_its_own() {
    let online = |online| robot(0, "robot1", &[("online", online), ("deployed_secs", 61.0)]);
    let streams = || [status(1, "/robot1/odom", OK, 0.1), status(2, "/robot1/wifi", DEAD, 9.7)];
    let there = board([online(1.0)].into_iter().chain(streams()));
    assert_eq!(text(&there.troubles()), "☒ robot1  wifi  dead, silent 9.7 s");
    assert!(text(&there.team_lines(Detail::Whole)).ends_with("1 of 2 ok"));
    let gone = board([online(0.0)].into_iter().chain(streams()));
    assert_eq!(text(&gone.troubles()), "☒ robot1  offline");
    assert_eq!(text(&gone.team_lines(Detail::Whole)), "robot1  OFFLINE    1:01");
}

#[test]
fn robots_stand_in_the_order_in_which_people_count() {
    let ids = ["robot10", "robot2", "robot1"];
    let board = board(ids.map(|id| robot(0, id, &[("online", 1.0)])));
    let lines = board.team_lines(Detail::Whole);
    let first = lines.iter().map(|line| line.text().split(' ').next().unwrap().to_owned());
    assert_eq!(first.collect::<Vec<_>>(), ["robot1", "robot2", "robot10"]);
}

#[test]
fn many_streams_in_one_state_are_one_trouble() {
    let streams = ["a", "b", "c"].map(|name| status(1, &format!("/robot1/{name}"), DEAD, 9.7));
    let board = board([robot(0, "robot1", &[("online", 1.0)])].into_iter().chain(streams));
    assert_eq!(text(&board.troubles()), "☒ robot1  3 streams dead, silent 9.7 s: a, b, c");
}

#[test]
fn what_is_of_nobody_keeps_its_whole_name() {
    let board = board([
        robot(0, "robot1", &[("online", 1.0)]),
        status(1, "/robot10/odom", DEAD, 9.7),
        status(1, "/tf", OK, 0.1),
    ]);
    assert_eq!(text(&board.troubles()), "☒ other  /robot10/odom  dead, silent 9.7 s");
    assert!(text(&board.team_lines(Detail::Whole)).contains("1 of 2 ok"));
}

#[test]
fn that_nothing_happened_yet_is_no_trouble() {
    let stream = Stream::raw("/robot1/goal_pose", Subject::robot("robot1"), Shape::Event);
    let commands = Stream { signal: Signal::Input, ..stream };
    let never = || status(3, "/robot1/goal_pose", (State::Never, "no sample yet"), f64::NAN);
    let mut board = Board::default();
    board.known.declare(commands);
    for record in [never(), never()] {
        board.take(&record);
    }
    assert_eq!(text(&board.troubles()), "");
    assert!(!board.summary().iter().any(|line| line.contains("goal_pose")));
}

#[test]
fn that_no_stream_ever_appeared_is_said() {
    let begun = |second| happens(second, session_events(), (EventKind::Clock, "a"), 0.0);
    let mut board = board([begun(0), begun(9)]);
    assert_eq!(text(&board.troubles()), "");
    board.take(&begun(10));
    assert!(text(&board.troubles()).starts_with("◌ nothing  no stream has appeared"));
    assert!(board.summary()[1].starts_with("no stream ever appeared"));
    board.take(&happens(11, session_events(), (EventKind::Marker, "trial 1"), 0.0));
    assert_eq!((text(&board.troubles()).as_str(), board.summary().len()), ("", 1));
}

#[test]
fn a_session_without_any_stream_lasted_as_long_as_it_was_watched() {
    let mut board = board([happens(60, session_events(), (EventKind::Clock, "end"), 0.0)]);
    board.watch(60.0);
    assert!(board.summary()[0].starts_with("60 s, 0 streams"), "{:?}", board.summary());
    assert!(text(&board.troubles()).starts_with("◌ nothing  no stream has appeared"));
}

#[test]
fn a_stream_that_is_advertised_and_never_comes_is_reported() {
    let mut board = Board::default();
    let never = |second| status(second, "/robot1/wifi", (State::Never, "no sample yet"), f64::NAN);
    let log: Vec<String> = (0..12).flat_map(|second| board.take(&never(second))).collect();
    assert_eq!(log.len(), 1);
    assert!(log[0].contains("/robot1/wifi") && log[0].contains("never seen"), "{}", log[0]);
}

#[test]
fn faults_of_the_session_are_pinned_and_in_the_summary() {
    let fault = "bag: failed to record to /d: the disk is full";
    let mut board = board([happens(41, session_events(), (EventKind::Fault, fault), f64::NAN)]);
    assert_eq!(text(&board.troubles()), format!("■ 00:00:41  {fault}"));
    board.see_faults();
    assert_eq!(text(&board.troubles()), "");
    assert!(board.summary().contains(&format!("fault: {fault}")));
}

#[test]
fn an_alert_that_watches_nothing_is_in_the_summary_and_one_that_is_raised_is_no_fault() {
    let alerts = || Stream {
        shape: Shape::Event,
        ..Stream::concluded(ALERTS, Subject::team(), "alerts", Shape::Event)
    };
    let idle = "alert 1 of the study watches nothing: no stream so far matches its name and number";
    let raised = "robot1 needs someone: offline";
    let board = board([
        happens(5, alerts(), (EventKind::Fault, raised), f64::NAN),
        happens(6, alerts(), (EventKind::Fault, idle), f64::NAN),
    ]);
    let summary = board.summary();
    assert!(summary.contains(&format!("fault: {idle}")), "{summary:?}");
    assert!(!summary.contains(&format!("fault: {raised}")), "{summary:?}");
}

#[test]
fn the_phase_is_that_of_the_participant_with_what_is_left_of_it() {
    let of_session =
        |second, label, secs| happens(second, session_events(), (EventKind::Phase, label), secs);
    let own = Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event);
    let mut board = board([of_session(0, "baseline", 60.0), heart(12, 70.0)]);
    assert_eq!(board.phase(None).text(), "p001  baseline, 0:48 left");
    let log = board.take(&happens(20, own, (EventKind::Phase, "2-back"), f64::NAN));
    let override_said = "00:00:20 p001 has separate phases: \
                         the session's phases don't apply to p001";
    assert_eq!(log, ["00:00:20 p001: phase: 2-back", override_said]);
    board.take(&heart(32, 70.0));
    let both = "p001  2-back for 0:12   session: baseline, 0:28 left   next rest";
    assert_eq!(board.phase(Some("rest")).text(), both);
    board.take(&of_session(40, "2-back", 60.0));
    assert_eq!(board.phase(None).text(), "p001  2-back for 0:20");
}

#[test]
fn only_changes_are_reported_line_by_line() {
    let mut board = Board::default();
    let mut take = |state| board.take(&status(1, "/robot1/odom", (state, ""), 0.1)).len();
    let states = [State::Never, State::Ok, State::Ok, State::Ok, State::Ok];
    assert_eq!(states.map(&mut take), [0, 0, 0, 1, 0]);
    assert_eq!([State::Stale, State::Stale, State::Degraded].map(&mut take), [1, 0, 1]);
}
