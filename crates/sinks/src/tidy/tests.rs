mod timeline;
mod session;

use std::fs;

use teampulse_core::alerts::ALERTS;
use teampulse_core::data::EventKind;
use teampulse_core::session_streams::session_events;
use teampulse_core::status::State;
use teampulse_core::stream::{Signal, Subject, Window};
use tempfile::tempdir;

use super::*;
use session::{ECG, Session, event, is_of_intervals, person, status, status_stream, window, write};

const PPG: &str = "/humans/persons/p001/polar_h10/ppg";

#[test]
fn what_happens_is_a_row_as_bids_writes_it() {
    let mut session = Session::new();
    session.phase(0.5, "baseline", 60.0);
    session.phase(70.0, "2-back", f64::NAN);
    let reports = Stream::raw("/humans/persons/p001/task/reports", person(), Shape::Event);
    session.report(71.25, &reports, event(EventKind::Report, "isa", 4.0, 0.0));
    let mark = event(EventKind::Marker, "coffee\tand\nbiscuits", f64::NAN, 0.0);
    session.report(72.0, &session_events(), mark);
    insta::assert_snapshot!(session.run().text("events.tsv").replace('\t', " | "), @r"
    onset | duration | trial_type | value | label | subject | stream | phase | time | channel
    0.500 | 60 | phase | n/a | baseline | session | /session/events | baseline | 2026-11-18T11:06:40.500Z | n/a
    70.000 | 3 | phase | n/a | 2-back | session | /session/events | 2-back | 2026-11-18T11:07:50.000Z | n/a
    71.250 | 0 | report | 4 | isa | p001 | /humans/persons/p001/task/reports | 2-back | 2026-11-18T11:07:51.250Z | n/a
    72.000 | 0 | marker | n/a | coffee and biscuits | session | /session/events | 2-back | 2026-11-18T11:07:52.000Z | n/a
    73.000 | 0 | clock | n/a | end | session | /session/events | n/a | 2026-11-18T11:07:53.000Z | n/a
    ");
}

#[test]
fn what_comes_late_stands_at_its_place() {
    let mut session = Session::new();
    for (measured_secs, log_secs, label) in [(1.0, 1.0, "a"), (3.0, 3.0, "c"), (2.0, 9.0, "b")] {
        let mark = event(EventKind::Marker, label, f64::NAN, 0.0);
        session.take_at(measured_secs, log_secs, &session_events(), mark);
    }
    let text = session.run().text("events.tsv");
    let labels: Vec<&str> = text.lines().map(|line| line.split('\t').nth(4).unwrap()).collect();
    assert_eq!(labels, ["label", "a", "b", "c", "end"]);
}

#[test]
fn what_comes_minutes_late_stands_at_its_place_in_the_end() {
    let mut session = Session::new();
    for (measured_secs, log_secs, label) in [(1.0, 1.0, "a"), (90.0, 90.0, "c"), (2.0, 120.0, "b")]
    {
        let mark = event(EventKind::Marker, label, f64::NAN, 0.0);
        session.take_at(measured_secs, log_secs, &session_events(), mark);
    }
    let text = session.run().text("events.tsv");
    let labels: Vec<&str> = text.lines().map(|line| line.split('\t').nth(4).unwrap()).collect();
    assert_eq!(labels, ["label", "a", "b", "c", "end"]);
}

#[test]
fn no_label_is_run_by_a_spreadsheet() {
    let mut session = Session::new();
    session.phase(0.0, "-1 back", 60.0);
    let mark = |label| event(EventKind::Marker, label, f64::NAN, 0.0);
    for (secs, label) in
        [(1.0, "=cmd|' /C calc'!A0"), (2.0, "+1+A1"), (3.0, "@SUM(A1)"), (4.0, "1-back")]
    {
        session.report(secs, &session_events(), mark(label));
    }
    session.windows("heart/w30", 30..=30, 30.0);
    let files = session.run();
    let text = files.text("events.tsv");
    let labels: Vec<&str> = text.lines().map(|line| line.split('\t').nth(4).unwrap()).collect();
    assert_eq!(
        labels,
        ["label", "'-1 back", "'=cmd|' /C calc'!A0", "'+1+A1", "'@SUM(A1)", "1-back", "end"]
    );
    assert_eq!(files.columns(&[3]), ["'-1 back"]);
}

#[test]
fn what_happened_is_reported_once() {
    let mut session = Session::new();
    let own = Stream::raw("/humans/persons/p001/task/phases", person(), Shape::Event);
    let phase = |label| event(EventKind::Phase, label, f64::NAN, f64::NAN);
    for (secs, label) in [(0.0, "baseline"), (60.0, "1-back")] {
        session.phase(secs, label, f64::NAN);
        session.report(secs + 0.01, &own, phase(label));
    }
    session.report(90.0, &own, phase("break"));
    let alerts = Stream::raw("/team/alerts", Subject::team(), Shape::Event);
    let alert = |kind, label| event(kind, label, f64::NAN, 0.0);
    for (kind, label) in [
        (EventKind::Fault, "robot2 needs someone: offline"),
        (EventKind::Fault, "robot2 needs someone: battery below 20 %"),
        (EventKind::Marker, "robot2 was answered: offline"),
    ] {
        session.report(100.0, &alerts, alert(kind, label));
    }
    let text = session.run().text("events.tsv");
    let rows = text.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split('\t').collect();
        format!("{} {}", cells[5], cells[4])
    });
    assert_eq!(
        rows.collect::<Vec<_>>(),
        [
            "session baseline",
            "session 1-back",
            "p001 1-back",
            "p001 break",
            "team robot2 needs someone: battery below 20 %",
            "team robot2 was answered: offline",
            "session end"
        ]
    );
}

#[test]
fn windows_do_not_overlap_and_lie_within_one_phase() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 60.0);
    session.windows("heart/w30", 1..=64, 30.0);
    session.phase(65.0, "1-back", 60.0);
    session.windows("heart/w30", 65..=200, 30.0);
    let rows = session.run().columns(&[0, 1, 3]);
    let expected = [
        "0.000 30 baseline",
        "30.000 30 baseline",
        "65.000 30 1-back",
        "95.000 30 1-back",
        "125.000 30 ",
        "155.000 30 ",
    ];
    assert_eq!(rows, expected);
}

#[test]
fn short_windows_have_a_row_each_half_minute() {
    let mut session = Session::new();
    session.windows("level/w10", 10..=80, 10.0);
    assert_eq!(session.run().columns(&[0]), ["0.000", "30.000", "60.000"]);
}

#[test]
fn every_window_that_is_a_phase_has_its_rows() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 20.0);
    session.phase(20.0, "1-back", 20.0);
    session.windows("heart/phases", 20..=20, 20.0);
    session.windows("heart/phases", 40..=40, 20.0);
    let rows = session.run().columns(&[0, 1, 3]);
    assert_eq!(rows, ["0.000 20 baseline", "20.000 20 1-back"]);
}

#[test]
fn of_statistics_of_raw_signals_there_are_phases_only() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 20.0);
    session.windows("statistics/w10", 10..=20, 10.0);
    session.windows("statistics/phases", 20..=20, 20.0);
    assert_eq!(session.run().columns(&[0, 1]), ["0.000 20"]);
}

#[test]
fn a_phase_is_a_row_and_a_measure_a_column() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 20.0);
    session.phase(20.0, "1-back", 20.0);
    session.phase(40.0, "baseline", 20.0);
    session.windows("heart/phases", 20..=20, 20.0);
    session.windows("heart/phases", 40..=40, 20.0);
    session.windows("heart/phases", 60..=60, 20.0);
    let files = session.run();
    insta::assert_snapshot!(files.text("phases.csv"), @r"
    subject,phase,occurrence,start_secs,duration_secs,coverage.polar_h10_ecg,quality.polar_h10_ecg,ECG_Rate_Mean
    p001,baseline,1,0.000,20.000,1,0.75,71.5
    p001,1-back,1,20.000,20.000,1,0.75,71.5
    p001,baseline,2,40.000,20.000,1,0.75,71.5
    ");
    let described: serde_json::Value = serde_json::from_str(&files.text("phases.json")).unwrap();
    assert_eq!(described["ECG_Rate_Mean"]["Description"], "Mean heart rate from an ECG.");
    assert_eq!(described["ECG_Rate_Mean"]["Units"], "bpm");
}

#[test]
fn a_measure_from_several_sources_has_a_column_for_each() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 20.0);
    for device in ["e4", "shimmer"] {
        let eda = Stream::raw(format!("/humans/persons/p001/{device}/eda"), person(), Shape::Wave);
        let skin = Stream::derived(&eda, "skin", Shape::Feature).over(Window::Phases);
        let skin = skin.with_channels(&[("EDA_Tonic_Mean", "uS"), ("SCR_Peaks_N", "1")]);
        session.report(20.0, &skin, window(20.0));
    }
    let text = session.run().text("phases.csv");
    let head = text.lines().next().unwrap();
    assert!(head.ends_with(
        "EDA_Tonic_Mean.e4_eda,coverage.shimmer_eda,quality.shimmer_eda,EDA_Tonic_Mean.shimmer_eda"
    ), "{head}");
}

#[test]
fn files_about_people_are_their_owner_s_alone() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 20.0);
    session.beats(ECG, Signal::Ecg, 1.0, 4);
    session.windows("heart/phases", 20..=20, 20.0);
    let files = session.run();
    for name in &files.names {
        let mode = files.mode(name) & 0o777;
        assert_eq!(mode, 0o600, "{name}");
    }
}

#[test]
fn a_value_has_its_unit_and_what_has_none_its_reason() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 60.0);
    session.windows("heart/w30", 30..=30, 30.0);
    insta::assert_snapshot!(session.run().text("features.csv"), @r"
    start_secs,window_secs,subject,phase,source,measure,value,unit,sigma,reason,span
    0.000,30,p001,baseline,polar_h10/ecg,coverage,1,1,,,
    0.000,30,p001,baseline,polar_h10/ecg,quality,0.75,1,,,
    0.000,30,p001,baseline,polar_h10/ecg,ECG_Rate_Mean,71.5,bpm,,,
    0.000,30,p001,baseline,polar_h10/ecg,HRV_LF,,ms^2,,window too short,
    ");
}

#[test]
fn missing_data_are_no_interval() {
    let mut session = Session::new();
    session.beats(ECG, Signal::Ecg, 1.0, 4);
    session.beats(ECG, Signal::Ecg, 60.0, 3);
    let files = session.run();
    assert_eq!(
        files.text("intervals.txt"),
        "1.800000\t0.801000\n2.600000\t0.802000\n3.400000\t0.803000\n60.800000\t0.801000\n\
         61.600000\t0.802000\n",
        "the time shows the gap"
    );
    assert!(files.text("summary.md").contains("data are missing in 1 place"));
}

#[test]
fn intervals_have_their_times_phases_and_whether_they_are_corrected() {
    let mut session = Session::new();
    session.phase(0.0, "baseline", 3.0);
    session.beats(ECG, Signal::Ecg, 1.0, 4);
    session.beats(ECG, Signal::Ecg, 60.0, 2);
    let files = session.run();
    insta::assert_snapshot!(files.text("intervals.csv"), @r"
    time_secs,rr_ms,phase,corrected
    1.800000,801.000,baseline,0
    2.600000,802.000,baseline,0
    3.400000,803.000,,0
    60.800000,801.000,,0
    ");
    let described: serde_json::Value = serde_json::from_str(&files.text("intervals.json")).unwrap();
    assert_eq!(described["rr_ms"]["Units"], "ms");
    assert!(described["corrected"]["Description"].as_str().unwrap().contains("Tarvainen"));
}

#[test]
fn of_one_device_the_electrocardiogram_is_kept() {
    let mut session = Session::new();
    session.beats(PPG, Signal::Ppg, 0.5, 9);
    session.beats(ECG, Signal::Ecg, 10.0, 2);
    let files = session.run();
    assert_eq!(
        files.names,
        [
            "events.json",
            "events.tsv",
            "features.csv",
            "features.json",
            "intervals.csv",
            "intervals.json",
            "intervals.txt",
            "phases.csv",
            "phases.json",
            "summary.md"
        ]
    );
    assert_eq!(files.text("intervals.txt"), "10.800000\t0.801000\n");
}

#[test]
fn an_electrocardiogram_without_beats_leaves_the_pulse() {
    let mut session = Session::new();
    session.beats(ECG, Signal::Ecg, 10.0, 1);
    session.beats(PPG, Signal::Ppg, 20.0, 2);
    assert_eq!(session.run().text("intervals.txt"), "20.800000\t0.801000\n");
}

#[test]
fn each_of_several_devices_has_its_file() {
    let mut session = Session::new();
    session.beats(ECG, Signal::Ecg, 1.0, 3);
    session.beats("/humans/persons/p001/e4/ppg", Signal::Ppg, 5.0, 2);
    let files = session.run();
    assert_eq!(files.intervals(), ["intervals_p001_e4.txt", "intervals_p001_polar_h10.txt"]);
    assert_eq!(files.text("intervals_p001_e4.txt"), "5.800000\t0.801000\n");
    assert_eq!(files.text("intervals_p001_e4.csv").lines().count(), 2);
}

#[test]
fn each_of_several_electrocardiograms_of_one_device_has_its_file() {
    let mut session = Session::new();
    session.beats("/humans/persons/p001/file/ecg", Signal::Ecg, 1.0, 3);
    session.beats("/humans/persons/p001/file/ecg_2", Signal::Ecg, 5.0, 2);
    session.beats("/humans/persons/p001/file/ppg", Signal::Ppg, 9.0, 2);
    let files = session.run();
    let expected = ["intervals_p001_file.txt", "intervals_p001_file_ecg_2.txt"];
    assert_eq!(files.intervals(), expected);
    assert_eq!(files.text("intervals_p001_file.txt"), "1.800000\t0.801000\n2.600000\t0.802000\n");
    assert_eq!(files.text("intervals_p001_file_ecg_2.txt"), "5.800000\t0.801000\n");
    assert!(files.text("summary.md").contains("intervals_p001_file_ecg_2"));
}

#[test]
fn a_stream_whose_silence_means_nothing_has_no_usable_share() {
    let mut session = Session::new();
    let name = "/humans/persons/p001/polar_h10/battery";
    let battery = Stream::raw(name, person(), Shape::Sample);
    session.streams.declare(Stream { signal: Signal::Battery, ..battery });
    for secs in 0..60 {
        session.report(f64::from(secs), &status_stream(), status(name, State::Ok, None));
    }
    let summary = session.run().text("summary.md");
    let line = summary.lines().find(|line| line.starts_with(&format!("| {name} "))).unwrap();
    assert_eq!(line.split('|').nth(3).map(str::trim), Some("-"), "{line}");
}

#[test]
fn the_summary_says_what_was_usable_of_whom_and_when() {
    let mut session = Session::new();
    let odometry = Stream::raw("/robot1/odom", Subject::robot("robot1"), Shape::Wave);
    session.streams.declare(odometry);
    session.phase(0.0, "baseline", 30.0);
    session.windows("heart/w30", 1..=30, 30.0);
    session.phase(30.0, "task", f64::NAN);
    session.windows("heart/w30", 31..=60, 30.0);
    for secs in 0..60 {
        let odometry_state = if secs < 45 { State::Ok } else { State::Dead };
        session.report(f64::from(secs), &status_stream(), status(ECG, State::Ok, None));
        let of_odometry = status("/robot1/odom", odometry_state, Some(3));
        session.report(f64::from(secs), &status_stream(), of_odometry);
    }
    let fault = || event(EventKind::Fault, "robot1 offline", 5.0, 0.0);
    session.report(50.0, &session_events(), fault());
    session.report(58.0, &session_events(), fault());
    let alerts = Stream::concluded(ALERTS, Subject::team(), "alerts", Shape::Event);
    for label in ["robot1 needs someone: offline", "alert 1 of the study watches nothing"] {
        session.report(59.0, &alerts, event(EventKind::Fault, label, f64::NAN, 0.0));
    }
    session.beats(ECG, Signal::Ecg, 58.0, 3);
    insta::assert_snapshot!(session.run().text("summary.md").split("## Where").next().unwrap(), @r"
    # trial

    2026-11-18 11:06:40 to 2026-11-18 11:07:40 (UTC), 1 min 1 s.
    Markers: 0 in /session/events, 0 in other streams. Self-reports: 0. Interventions: 0.

    ## Phases

    | of  | phase    | from [s] | to [s] | length [s] |
    |-----|----------|---------:|-------:|-----------:|
    | all | baseline |      0.0 |   30.0 |       30.0 |
    | all | task     |     30.0 |   60.6 |       30.6 |

    ## What is usable

    ### p001

    | stream                             | rate [Hz] | usable | baseline | task | lost | ± [ms] |
    |------------------------------------|----------:|-------:|---------:|-----:|-----:|-------:|
    | /humans/persons/p001/polar_h10/ecg |      20.0 |   75 % |     75 % | 75 % |    ? |    1.0 |

    ### robot1

    | stream       | rate [Hz] | usable | baseline |  task | lost | ± [ms] |
    |--------------|----------:|-------:|---------:|------:|-----:|-------:|
    | /robot1/odom |      20.0 |  75 %* |   100 %* | 50 %* |    3 |    1.0 |

    rate: the median over the seconds in which samples arrived. usable: the share of each phase with data good enough
    for values, or else the mean share over the windows in the phase, at most the share of the phase with data; for the
    session, the mean over its phases if they cover it, or else over all windows, at most the share of time in which
    samples arrived. * = without windows: the share of time in which the stream arrived as it should. - = a silence
    would mean nothing, as for a key or the battery of a wearable. lost: on the way here and in our own queue; ? =
    unknown. ± : how far a time may be off (95 %); - = unknown, as neither a model of its clock nor the computer that
    stamps such a stream states it.

    ## What was lost or wrong

    - at 50.0 s: robot1 offline, 2 times
    - at 59.0 s: alert 1 of the study watches nothing
    - /robot1/odom: 15 s not as it should be (dead: silent for 9.0 s)
    ");
}

#[test]
fn a_signal_is_not_judged_by_its_statistics() {
    let mut session = Session::new();
    session.streams.declare(Stream::raw(ECG, person(), Shape::Wave));
    session.report(0.0, &status_stream(), status(ECG, State::Ok, None));
    session.windows("statistics/w30", 30..=60, 30.0);
    session.windows("heart/w30", 61..=61, 30.0);
    session.windows("statistics/w60", 62..=62, 60.0);
    let streams = session.streams.clone();
    let (mut summary, timeline) = (Summary::default(), Timeline::default());
    session.records.iter().for_each(|record| summary.take(record, &timeline, &streams));
    assert!(summary.is_judged_by(ECG, &format!("{ECG}/heart/w30")));
}

#[test]
fn what_a_second_brought_is_on_the_disk_before_the_end() {
    let folder = tempdir().unwrap();
    let mut session = Session::new();
    session.windows("heart/w30", 30..=32, 30.0);
    let mut writing = Writing::begin(&Tidy::default(), folder.path()).unwrap();
    for record in &session.records {
        writing.take(record, &session.streams).unwrap();
    }
    let text = fs::read_to_string(folder.path().join("features.csv")).unwrap();
    assert_eq!(text.lines().count(), 5);
    let described = fs::read_to_string(folder.path().join("features.json")).unwrap();
    assert!(described.contains("HRV_LF"), "{described}");
}

#[test]
fn a_file_that_can_t_be_written_is_an_error_that_says_what_to_do() {
    let session = Session::new();
    fs::create_dir(session.folder.path().join("events.tsv")).unwrap();
    let Err(SinkError::Lost { message, hint }) = write(&session) else { panic!("no error") };
    assert!(message.starts_with("write ") && message.contains("events.tsv"), "{message}");
    assert!(hint.contains("the bag continues"), "{hint}");
    let repair = format!("`teampulse recover {}` writes them", session.folder.path().display());
    assert!(hint.contains(&repair), "{hint}");
}

#[test]
fn no_command_is_named_for_a_folder_that_is_gone() {
    let session = Session::new();
    let folder = session.folder.path().join("deleted");
    assert!(!hint_for(&folder).contains("teampulse recover"));
    assert!(hint_for(session.folder.path()).contains("teampulse recover"));
}

#[test]
fn files_of_intervals_have_at_every_moment_the_names_that_they_have_in_the_end() {
    let folder = tempdir().unwrap();
    let mut session = Session::new();
    session.beats(PPG, Signal::Ppg, 0.5, 3);
    session.beats(ECG, Signal::Ecg, 10.0, 3);
    let of_one_device = session.records.len();
    session.beats("/humans/persons/p001/e4/ppg", Signal::Ppg, 20.0, 3);
    session.windows("heart/w30", 30..=31, 30.0);
    let mut writing = Writing::begin(&Tidy::default(), folder.path()).unwrap();
    let names = || {
        let names = fs::read_dir(folder.path()).unwrap();
        let names = names.map(|each| each.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| is_of_intervals(name)).collect();
        names.sort();
        names
    };
    for (number, record) in session.records.iter().enumerate() {
        writing.take(record, &session.streams).unwrap();
        if number + 1 == of_one_device {
            assert_eq!(names(), ["intervals.txt"]);
        }
    }
    let expected = ["intervals_p001_e4.txt", "intervals_p001_polar_h10.txt"];
    assert_eq!(names(), expected);
    let text = fs::read_to_string(folder.path().join(expected[1])).unwrap();
    assert_eq!(
        text, "10.800000\t0.801000\n11.600000\t0.802000\n",
        "the electrocardiogram takes the place of the pulse"
    );
    writing.finish(folder.path(), "trial").unwrap();
    assert_eq!(names(), expected);
}

#[test]
fn files_end_with_the_bag_that_ended() {
    let mut session = Session::new();
    session.phase(5.0, "baseline", 60.0);
    session.bag_ended.report("failed to record to x: the disk is full");
    let files = session.run();
    let text = files.text("summary.md");
    assert!(text.contains("- The bag ended before the session did"), "{text}");
    assert!(text.contains("failed to record to x: the disk is full"), "{text}");
    assert_eq!(files.text("events.tsv").lines().count(), 1);
}

#[test]
fn each_column_of_a_table_is_reported_in_the_file_beside_it() {
    let files = Session::new().run();
    for (table, beside, separator) in
        [("events.tsv", "events.json", '\t'), ("features.csv", "features.json", ',')]
    {
        let described: serde_json::Value = serde_json::from_str(&files.text(beside)).unwrap();
        let text = files.text(table);
        let columns: Vec<&str> = text.lines().next().unwrap().split(separator).collect();
        let is_described = |column: &&str| described[*column]["Description"].is_string();
        assert!(columns.iter().all(is_described), "{described}");
        assert_eq!(described.as_object().unwrap().len(), columns.len());
    }
    let events: serde_json::Value = serde_json::from_str(&files.text("events.json")).unwrap();
    assert_eq!(events["onset"]["Units"], "s");
    // Beats have no rows, and what is a marker to machines may be a notice.
    let kinds = EventKind::ALL.iter().filter(|kind| **kind != EventKind::Beat);
    let mut levels: Vec<String> =
        kinds.map(EventKind::to_string).chain(["notice".into()]).collect();
    levels.sort();
    let levels_in_file: Vec<&String> =
        events["trial_type"]["Levels"].as_object().unwrap().keys().collect();
    assert!(levels_in_file.iter().copied().eq(&levels), "{levels_in_file:?}");
}

#[test]
fn a_burst_gives_its_channel() {
    let mut session = Session::new();
    let bursts = Stream::raw("/humans/persons/p001/myo/emg/bursts", person(), Shape::Event);
    session.report(5.0, &bursts, event(EventKind::Burst, "flexor", 12.0, 0.4));
    let text = session.run().text("events.tsv");
    let burst = text.lines().find(|line| line.contains("burst\t")).unwrap();
    assert_eq!(burst.rsplit('\t').next(), Some("flexor"));
}

#[test]
fn no_name_in_a_bag_leads_out_of_its_folder() {
    let mut session = Session::new();
    session.beats(ECG, Signal::Ecg, 1.0, 2);
    session.beats("/humans/persons/p001/../ecg", Signal::Ecg, 1.0, 2);
    let files = session.run();
    assert_eq!(files.intervals(), ["intervals_p001___.txt", "intervals_p001_polar_h10.txt"]);
}

#[test]
fn markers_of_files_and_of_wearables_count_as_those_of_the_session_do() {
    let mut session = Session::new();
    let marker = || event(EventKind::Marker, "tap", f64::NAN, 0.0);
    session.report(1.0, &session_events(), marker());
    let button = Stream::raw("/humans/persons/p001/empatica_e4/markers", person(), Shape::Event);
    session.report(2.0, &button, marker());
    let robot = Stream::raw("/robot1/events", Subject::robot("robot1"), Shape::Event);
    session.report(3.0, &robot, marker());
    session.report(4.0, &Stream::derived(&button, "state", Shape::Event), marker());
    let text = session.run().text("summary.md");
    assert!(text.contains("Markers: 1 in /session/events, 1 in other streams."), "{text}");
}
