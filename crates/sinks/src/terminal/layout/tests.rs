//! The screen at common sizes, with made-up states.

use std::path::Path;

use teampulse_bag::Growth;
use teampulse_core::alerts::{ALERTS, Alert, Stage, Why};
use teampulse_core::data::EventKind;
use teampulse_core::session_streams::session_events;
use teampulse_core::status::State;
use teampulse_core::stream::{Shape, Stream, Subject, Window};
use teampulse_core::time::Time;

use super::super::board::tests::{self, figures, happens, heart, person, robot, status};
use super::super::header::Kept;
use super::super::view::Scroll;
use super::*;

/// A session of twelve minutes, with some troubles.
fn board() -> Board {
    let mut board = Board::default();
    let mut take = |record| drop(tests::take(&mut board, &record));
    let phase = |second, label| happens(second, session_events(), (EventKind::Phase, label), 300.0);
    take(phase(0, "baseline"));
    for (second, key) in (301..320).zip("abcdefghijklmnopqrs".chars()) {
        take(happens(second, session_events(), (EventKind::Marker, &key.to_string()), 0.0));
    }
    take(phase(600, "2-back"));
    let alert = |robot: &str, why| {
        Alert { who: robot.to_owned(), why, stage: Stage::Raised, tier: None }.label()
    };
    let stuck = Why::Stuck("wifi".to_owned());
    let alerts = Stream::raw(ALERTS, Subject::team(), Shape::Event);
    for (second, robot, why) in [(713, "robot2", Why::Offline), (742, "robot3", stuck)] {
        take(happens(second, alerts.clone(), (EventKind::Fault, &alert(robot, why)), f64::NAN));
    }
    let fault = "tidy: failed to write features.csv: permission denied";
    take(happens(750, session_events(), (EventKind::Fault, fault), f64::NAN));
    for (id, online) in [("robot1", 1.0), ("robot2", 0.0), ("robot3", 1.0), ("robot10", 1.0)] {
        let figures = [
            ("online", online),
            ("deployed_secs", 751.0),
            ("power_w", 14.25),
            ("empty_in_secs", 3120.0),
            ("rssi_median", -61.4),
            ("level", f64::from(u8::from(id == "robot3"))),
        ];
        take(robot(753, id, &figures));
        for name in ["battery_state", "odom", "wifi"] {
            let name = format!("/{id}/{name}");
            take(match (id, name.ends_with("odom")) {
                ("robot2", _) => status(753, &name, (State::Dead, "silent for 41.0 s"), 41.0),
                ("robot10", true) => {
                    status(753, &name, (State::Degraded, "2.0 Hz instead of 20.0 Hz"), 0.4)
                }
                _ => status(753, &name, (State::Ok, ""), 0.1),
            });
        }
    }
    take(heart(753, 81.7));
    let eda = Stream::raw("/humans/persons/p001/e4/eda", person(), Shape::Sample);
    let skin = Stream::derived(&eda, "skin", Shape::Feature).over(Window::of_secs(30.0));
    let channels = [("EDA_Tonic_Mean", "uS"), ("SCR_Peaks_Rate", "1/min")];
    take(figures(744, skin.with_channels(&channels), &[3.84, 4.0]));
    take(status(754, &eda.name, (State::Dead, "silent for 9.7 s"), 9.7));
    take(status(754, "/humans/persons/p001/strap/ecg", (State::Ok, ""), 0.1));
    let team = Stream::raw("/team/state", Subject::team(), Shape::Feature);
    let channels = [("people", "1"), ("robots_online", "1")];
    take(figures(754, team.with_channels(&channels), &[1.0, 3.0]));
    board
}

fn recording() -> Recording {
    let growth = Growth::default();
    let mut recording = Recording::of(Kept::Bag(growth.clone()));
    recording.look(Time::from_stamp(1000, 0));
    growth.begin(Path::new("bag"));
    growth.synced(48_200_000, 212_000_000_000);
    recording.look(Time::from_stamp(1754, 0));
    recording
}

fn lines(board: &Board, view: &View, (columns, rows): (usize, usize)) -> Vec<StyledLine> {
    let recording = recording();
    let next = Some("3-back");
    let shown = Shown { board, recording: &recording, view, question: None, next, has_keys: true };
    draw(shown, Size { columns, rows })
}

fn text(lines: &[StyledLine]) -> String {
    lines.iter().map(StyledLine::text).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_small_screen_has_what_matters() {
    insta::assert_snapshot!(text(&lines(&board(), &View::default(), (60, 12))));
}

#[test]
fn a_usual_screen_has_the_team_and_the_log() {
    insta::assert_snapshot!(text(&lines(&board(), &View::default(), (80, 24))));
}

#[test]
fn a_wide_screen_has_the_log_beside_the_team() {
    insta::assert_snapshot!(text(&lines(&board(), &View::default(), (150, 45))));
}

#[test]
fn every_size_is_filled_and_nothing_stands_beyond_it() {
    let board = board();
    for columns in [20, 40, 60, 80, 129, 130, 150, 400] {
        for rows in [4, 5, 12, 19, 20, 24, 45, 200] {
            let lines = lines(&board, &View::default(), (columns, rows));
            assert_eq!(lines.len(), rows, "{columns}×{rows}");
            assert!(lines.iter().all(|line| line.width() <= columns), "{columns}×{rows}");
        }
    }
}

#[test]
fn a_hundred_robots_are_scrolled_through() {
    let mut board = Board::default();
    for number in 1..=100 {
        board.take(&robot(1, &format!("robot{number}"), &[("online", 1.0)]));
    }
    let view = View::default();
    let shown = text(&lines(&board, &view, (80, 24)));
    assert!(shown.contains("robot13 ") && shown.contains("… 87 more below ↓"), "{shown}");
    (0..40).for_each(|_| view.scroll(Scroll::Down));
    let shown = text(&lines(&board, &view, (80, 24)));
    assert!(shown.contains("robot41 ") && shown.contains("40 more above ↑"), "{shown}");
}

#[test]
fn the_log_is_read_back_by_pages() {
    let (board, view) = (board(), View::default());
    assert!(!text(&lines(&board, &view, (80, 24))).contains("marker: a"));
    (0..99).for_each(|_| {
        view.scroll(Scroll::Back);
        lines(&board, &view, (80, 24));
    });
    let shown = text(&lines(&board, &view, (80, 24)));
    assert!(shown.contains("phase: baseline") && shown.contains("newer ↓"), "{shown}");
}

#[test]
fn no_name_label_or_reason_commands_the_terminal() {
    let mut board = Board::default();
    let bad = "\u{1b}]0;x\u{7}\u{9b}2J\u{202e}evil\u{2066}\r\n";
    let long = format!("{bad}{}", "x".repeat(100_000));
    board.take(&robot(1, &long, &[("online", 1.0)]));
    tests::take(&mut board, &status(1, &format!("/{long}/{bad}"), (State::Dead, &long), 9.0));
    board.take(&happens(1, session_events(), (EventKind::Fault, &long), f64::NAN));
    board.take(&happens(1, session_events(), (EventKind::Phase, &long), f64::NAN));
    board.note(&long);
    let lines = lines(&board, &View::default(), (80, 24));
    let drawn: String = lines.iter().map(StyledLine::text).collect();
    let is_bad = |each: char| each.is_control() || "\u{202e}\u{2066}".contains(each);
    assert!(drawn.contains("evil") && !drawn.contains(is_bad), "{drawn}");
    assert!(lines.iter().all(|line| line.width() <= 80));
}
