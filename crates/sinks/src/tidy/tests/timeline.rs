//! Laws of the timeline: phases, values that refer back to them, and their end.

use std::sync::Arc;

use teampulse_core::alerts::{ALERTS, FAMILY};
use teampulse_core::data::{Data, EventKind};
use teampulse_core::reports::Noting;
use teampulse_core::session_streams::session_events;
use teampulse_core::status::State;
use teampulse_core::stream::{Origin, Shape, Stream, Subject};

use super::session::{
    ECG, Files, Session, covered, empty, event, person, status, status_stream, window,
};

/// A row of `events.tsv`, by its label: some of its columns.
fn row(files: &Files, label: &str, columns: &[usize]) -> String {
    let text = files.text("events.tsv");
    let rows = text.lines().map(|line| line.split('\t').collect::<Vec<_>>());
    let row = rows.into_iter().find(|cells| cells[4] == label).unwrap();
    columns.iter().map(|k| row[*k]).collect::<Vec<_>>().join(" ")
}

/// The shares of a stream in the summary: in all, and in each phase.
fn usable(files: &Files, stream: &str) -> Vec<String> {
    let text = files.text("summary.md");
    let line = text.lines().find(|line| line.starts_with(&format!("| {stream} "))).unwrap();
    let cells = line.split('|').map(|cell| cell.trim().to_owned());
    cells.filter(|cell| cell.contains('%')).collect()
}

#[test]
fn what_was_half_silent_is_half_usable() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 60.0);
    session.phase(60.0, "faults", 30.0);
    for secs in 30..=90 {
        let silent_secs = f32::from(u8::try_from(secs).unwrap() - 30).clamp(30.0, 45.0) - 30.0;
        session.window("heart/w30", f64::from(secs), covered(30.0, 1.0 - silent_secs / 30.0));
        session.report(f64::from(secs), &status_stream(), status(ECG, State::Ok, None));
    }
    // Quality is three quarters throughout; windows at the start of a phase still cover the one before.
    assert_eq!(usable(&session.run(), ECG)[1..], ["75 %", "38 %"]);
}

#[test]
fn a_phase_is_judged_as_a_whole_where_it_was() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 40.0);
    session.phase(40.0, "task", 20.0);
    session.windows("heart/w30", 30..=60, 30.0);
    session.window("heart/phases", 40.0, covered(40.0, 0.8));
    session.window("heart/phases", 60.0, covered(20.0, 0.2));
    assert_eq!(usable(&session.run(), ECG), ["45 %", "60 %", "15 %"]);
}

#[test]
fn phases_that_do_not_cover_the_session_do_not_represent_it() {
    let mut session = Session::new();
    session.phase(40.0, "task", 20.0);
    for secs in 0..60 {
        session.report(f64::from(secs), &status_stream(), status(ECG, State::Ok, None));
    }
    session.windows("heart/w30", 30..=60, 30.0);
    session.window("heart/phases", 60.0, covered(20.0, 0.2));
    assert_eq!(usable(&session.run(), ECG), ["75 %", "15 %"]);
}

#[test]
fn a_phase_in_which_no_window_lies_is_judged_by_the_state_of_the_stream() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 40.0);
    session.phase(40.0, "task", 20.0);
    for secs in 0..60 {
        let state = if secs < 50 { State::Ok } else { State::Dead };
        session.report(f64::from(secs), &status_stream(), status(ECG, state, None));
        if secs >= 30 {
            session.window("heart/w30", f64::from(secs), window(30.0));
        }
    }
    assert_eq!(usable(&session.run(), ECG)[1..], ["75 %", "50 %*"]);
}

#[test]
fn windows_too_short_for_any_value_do_not_judge_their_data() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 60.0);
    for secs in 0..60 {
        session.report(f64::from(secs), &status_stream(), status(ECG, State::Ok, None));
        session.window("breath/w10", f64::from(secs), empty(10.0));
    }
    assert_eq!(usable(&session.run(), ECG), ["100 %*", "100 %*"]);
}

#[test]
fn the_end_of_something_is_a_moment_that_gives_how_long_it_lasted() {
    let mut session = Session::new();
    let of = |name: &str, subject| {
        let stream = Stream::raw(name, subject, Shape::Event);
        Stream { origin: Origin::Derived, ..stream }
    };
    let deployment = of("/robot2/deployment/events", Subject::robot("robot2"));
    let alerts = of("/team/alerts", Subject::team());
    let marker = |label, duration_secs| event(EventKind::Marker, label, f64::NAN, duration_secs);
    session.phase(50.0, "before", 20.0);
    session.phase(70.0, "after", 20.0);
    session.report(75.0, &deployment, marker("robot2 online", 15.0));
    session.report(76.5, &alerts, marker("robot2 no longer needs someone: poor link", 11.5));
    let person_s = Stream::raw("/humans/persons/p001/task/notes", person(), Shape::Event);
    session.report(80.0, &person_s, marker("lasts", 9.0));
    let files = session.run();
    // What nobody set is no marker.
    let online = row(&files, "robot2 online", &[0, 1, 2, 3, 7, 8]);
    assert_eq!(online, "75.000 0 notice 15 after 2026-11-18T11:07:55.000Z");
    let alert = row(&files, "robot2 no longer needs someone: poor link", &[0, 1, 2, 3, 7]);
    assert_eq!(alert, "76.500 0 notice 11.5 after");
    assert_eq!(row(&files, "lasts", &[0, 1, 2]), "80.000 9 marker");
}

#[test]
fn a_phase_lasted_as_long_as_it_was_and_not_as_announced() {
    let mut session = Session::new();
    session.phase(0.5, "baseline", 60.0);
    session.phase(40.0, "1-back", f64::NAN);
    session.phase(50.0, "rest", 60.0);
    let mark = event(EventKind::Marker, "last", f64::NAN, 0.0);
    session.report(70.25, &session_events(), mark);
    let files = session.run();
    let of = |label| row(&files, label, &[0, 1]);
    assert_eq!(of("baseline"), "0.500 39.5");
    assert_eq!(of("1-back"), "40.000 10");
    assert_eq!(of("rest"), "50.000 21.25");
}

#[test]
fn own_phases_that_began_before_the_session_s_have_their_length() {
    let mut session = Session::new();
    session.phase(2.0, "baseline", 60.0);
    let own = Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event);
    session.take_at(1.0, 2.5, &own, event(EventKind::Phase, "baseline", f64::NAN, 60.0));
    session.report(50.0, &own, event(EventKind::Phase, "1-back", f64::NAN, f64::NAN));
    assert_eq!(row(&session.run(), "baseline", &[0, 1, 5]), "1.000 49 p001");
}

#[test]
fn values_of_own_phases_that_began_before_the_session_s_are_in_their_row() {
    let mut session = Session::new();
    session.phase(2.0, "all rest", 60.0);
    let own = Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event);
    session.take_at(1.0, 2.5, &own, event(EventKind::Phase, "baseline", f64::NAN, 60.0));
    session.window("heart/phases", 50.0, window(48.0));
    session.report(50.0, &own, event(EventKind::Phase, "1-back", f64::NAN, f64::NAN));
    let table = session.run().text("phases.csv");
    assert!(table.contains("\np001,baseline,1,2.000,48.000,"), "{table}");
}

#[test]
fn a_report_belongs_to_the_phase_that_has_just_ended() {
    let mut session = Session::new();
    let reports = Stream::raw("/humans/persons/p001/task/reports", person(), Shape::Event);
    session.phase(0.0, "1-back", 30.0);
    session.phase(30.0, "rest", 30.0);
    let kinds = [(EventKind::Report, 30.0), (EventKind::Report, 39.0), (EventKind::Report, 41.0)];
    for (kind, secs) in
        kinds.into_iter().chain([(EventKind::Marker, 32.0), (EventKind::Report, 69.0)])
    {
        session.report(secs, &reports, event(kind, &format!("at {secs}"), 3.0, 0.0));
    }
    let files = session.run();
    let of = |secs: u32| row(&files, &format!("at {secs}"), &[7]);
    assert_eq!([30, 39, 41, 32, 69].map(of), ["1-back", "1-back", "rest", "rest", "rest"]);
}

#[test]
fn a_note_belongs_to_the_phase_in_which_it_was_written_and_one_of_the_session_is_nobody_s() {
    let mut session = Session::new();
    session.phase(0.0, "1-back", 30.0);
    session.phase(30.0, "rest", 30.0);
    let note = |label| event(EventKind::Report, label, f64::NAN, 0.0);
    session.report(32.0, &session_events(), note("dashboard note the belt slipped"));
    session.report(33.0, &session_events(), note("isa p001"));
    session.report(34.0, &session_events(), Data::Event(Arc::new(Noting::Bag.event("kept"))));
    let files = session.run();
    let of = |label| row(&files, label, &[2, 7]);
    assert_eq!(of("dashboard note the belt slipped"), "report rest");
    assert_eq!(of("isa p001"), "report 1-back");
    assert_eq!(of("bag note kept"), "notice rest");
    let text = files.text("summary.md");
    assert!(text.contains(" Notes: 1."), "{text}");
}

#[test]
fn an_alert_is_about_the_robot_that_it_names_and_counted_in_the_summary() {
    let mut session = Session::new();
    let odometry = Stream::raw("/robot2/odom", Subject::robot("robot2"), Shape::Event);
    session.report(1.0, &odometry, event(EventKind::Marker, "x", f64::NAN, 0.0));
    let alerts = Stream::concluded(ALERTS, Subject::team(), FAMILY, Shape::Event);
    let raised = "robot2 needs someone soon: battery below 20 %";
    let over = "robot2 no longer needs someone: battery below 20 %";
    let unknown = "robot2 may still need someone, no value comes: battery below 20 %";
    for (secs, kind, label) in [
        (10.0, EventKind::Fault, raised),
        (12.0, EventKind::Marker, unknown),
        (13.0, EventKind::Fault, raised),
        (15.5, EventKind::Marker, over),
        (20.0, EventKind::Fault, raised),
        (25.0, EventKind::Fault, "robot2 needs someone: offline"),
    ] {
        session.report(secs, &alerts, event(kind, label, 0.1, 2.0));
    }
    let files = session.run();
    assert_eq!(row(&files, raised, &[5]), "robot2");
    let text = files.text("summary.md");
    let line = "## Alerts\n\n- robot2: battery below 20 %: 2 times, 11.5 s in all (1.0 s of it without values), not over \
                at the end\n\n##";
    assert!(text.contains(line), "{text}");
}

#[test]
fn phases_that_are_too_short_to_be_listed_are_mentioned() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 30.0);
    session.phase(30.0, "blink", 0.5);
    session.phase(30.5, "task", 20.0);
    let text = session.run().text("summary.md");
    assert!(text.contains("One lasted less than a second: it is in events.tsv only."), "{text}");
}

#[test]
fn a_report_on_the_session_s_events_is_about_whom_it_names() {
    let mut session = Session::new();
    session.phase(0.0, "session's", 300.0);
    let own = Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event);
    session.report(10.0, &own, event(EventKind::Phase, "1-back", f64::NAN, f64::NAN));
    let report = |label| event(EventKind::Report, label, 3.0, 0.0);
    session.report(20.0, &session_events(), report("isa p001"));
    session.report(30.0, &session_events(), report("isa"));
    session.report(40.0, &session_events(), report("isa p007"));
    session.report(50.0, &session_events(), report("nasa_tlx p001"));
    session.report(60.0, &session_events(), report("kss p007"));
    let files = session.run();
    assert_eq!(row(&files, "isa p001", &[5, 7]), "p001 1-back");
    assert_eq!(row(&files, "isa", &[5, 7]), "p001 1-back");
    assert_eq!(row(&files, "isa p007", &[5, 7]), "session session's");
    assert_eq!(row(&files, "nasa_tlx p001", &[5, 7]), "p001 1-back");
    assert_eq!(row(&files, "kss p007", &[5, 7]), "session session's");
}

#[test]
fn reports_that_are_not_used_are_counted_as_such() {
    let summary = |people: &[&str]| {
        let mut session = Session::new();
        for id in people {
            let name = format!("/humans/persons/{id}/task/presses");
            let about = Subject { id: (*id).to_owned(), ..person() };
            let stream = Stream::raw(name, about, Shape::Event);
            session.report(10.0, &stream, event(EventKind::Marker, "match", f64::NAN, 0.0));
        }
        let reports = [("isa p001", 3.0), ("isa P001", 3.0), ("isa p009", 9.0), ("isa", 2.0)];
        for (label, isa) in reports.into_iter().chain([("isa p001", 7.0), ("isa p001", f64::NAN)]) {
            session.report(20.0, &session_events(), event(EventKind::Report, label, isa, 0.0));
        }
        session.run().text("summary.md")
    };
    for (people, about_nobody) in [(&["p001"][..], 2), (&["p001", "p002"], 3)] {
        let unused = format!(
            "Self-reports: 6 (not used: 1 off the scale from 1 to 5, 1 not a number, \
             {about_nobody} about an unknown person)."
        );
        let text = summary(people);
        assert!(text.contains(&unused), "{text}");
    }
}

#[test]
fn notes_are_counted_apart_from_self_reports() {
    let summary = |notes: &[&str]| {
        let mut session = Session::new();
        session.report(10.0, &session_events(), event(EventKind::Report, "effort p001", 40.0, 0.0));
        for note in notes {
            let note = event(EventKind::Report, note, f64::NAN, 0.0);
            session.report(20.0, &session_events(), note);
        }
        session.run().text("summary.md")
    };
    let text = summary(&[]);
    assert!(text.contains("Self-reports: 1. Interventions: 0."), "{text}");
    let text = summary(&["the belt slipped", "p001 drinks"]);
    assert!(text.contains("Self-reports: 1. Notes: 2. Interventions: 0."), "{text}");
}

#[test]
fn a_phase_too_short_for_any_value_has_no_rows() {
    let mut session = Session::new();
    session.window("heart/phases", 20.0, window(0.75));
    session.window("heart/phases", 30.0, empty(10.0));
    session.window("heart/phases", 30.5, empty(0.5));
    assert_eq!(session.run().columns(&[0, 1]), ["19.250 0.75", "20.000 10"]);
}

#[test]
fn a_session_that_was_cut_off_says_so_and_ends_with_what_is_known() {
    let mut session = Session::new();
    session.phase(5.0, "baseline", 60.0);
    session.beats(ECG, teampulse_core::stream::Signal::Ecg, 43.0, 2);
    let files = session.run_cut_off();
    assert_eq!(row(&files, "baseline", &[1]), "38.8");
    let text = files.text("summary.md");
    assert!(text.contains("| all | baseline |      5.0 |   43.8 |       38.8 |"), "{text}");
    assert!(text.contains("- The session was cut off"), "{text}");
}

#[test]
fn an_imported_recording_was_not_cut_off() {
    let mut session = Session::new();
    session.phase(5.0, "baseline", 60.0);
    session.beats(ECG, teampulse_core::stream::Signal::Ecg, 43.0, 2);
    let files = session.import();
    assert_eq!(row(&files, "baseline", &[1]), "38.8");
    assert!(!files.text("summary.md").contains("cut off"));
}

#[test]
fn a_session_that_ended_was_not_cut_off() {
    assert!(!Session::new().run().text("summary.md").contains("cut off"));
}

#[test]
fn what_is_computed_from_a_damaged_bag_says_so_and_counts_no_losses() {
    let mut session = Session::new();
    session.window("heart/w30", 30.0, window(30.0));
    session.report(31.0, &status_stream(), status(ECG, State::Ok, Some(0)));
    let whole = session.run().text("summary.md");
    let mut session = Session::new();
    session.window("heart/w30", 30.0, window(30.0));
    session.report(31.0, &status_stream(), status(ECG, State::Ok, Some(0)));
    session.damage = Some("12 messages are missing".into());
    let damaged = session.run().text("summary.md");
    let line = "- The bag that was replayed is damaged: 12 messages are missing.";
    assert!(damaged.contains(line) && !whole.contains("damaged"), "{damaged}");
    assert!(damaged.contains("|    ? |") && !whole.contains("|    ? |"), "{damaged}\n{whole}");
}

#[test]
fn labels_with_line_breaks_break_no_file() {
    let mut session = Session::new();
    session.phase(0.0, "base\r\nline\u{2028}one", 60.0);
    session.windows("heart/w30", 30..=31, 30.0);
    session.report(31.0, &session_events(), event(EventKind::Fault, "a\nb", f64::NAN, 0.0));
    let files = session.run();
    assert_eq!(files.columns(&[3]), ["base  line one"]);
    let text = files.text("summary.md");
    assert!(text.contains("| all | base  line one |") && text.contains(": a b\n"), "{text}");
    assert!(text.lines().filter(|line| line.contains("line one")).all(|line| line.ends_with('|')));
}
