//! The contents of small files of each format.

mod files;

use teampulse_formats::{Content, FormatError, Quantity, Recording, Signal, StatedDate, read};

fn recording(file: &[u8]) -> Recording {
    read(file).expect("its format is known").expect("it is right")
}

fn signal<'a>(recording: &'a Recording, name: &str) -> &'a Signal {
    recording.signals.iter().find(|signal| signal.name == name).expect("it is in the file")
}

/// The start [ns], the rate [Hz] and the samples of each run.
fn runs(signal: &Signal) -> Vec<(i64, f64, &[f64])> {
    let Content::Even(runs) = &signal.content else { panic!("{signal:?}") };
    runs.iter()
        .map(|run| (run.start_ns, (1e9 / run.period_ns * 1e6).round() / 1e6, &*run.samples))
        .collect()
}

fn marks(signal: &Signal) -> Vec<(i64, &str)> {
    let Content::Marks(marks) = &signal.content else { panic!("{signal:?}") };
    marks.iter().map(|mark| (mark.at_ns, &*mark.label)).collect()
}

const START_NS: i64 = 1_700_000_000_000_000_000;

#[test]
fn an_e4_has_its_signals_in_their_units() {
    let e4 = recording(&files::e4());
    assert_eq!((&*e4.device, e4.is_dated), ("empatica_e4", true));
    assert_eq!(runs(signal(&e4, "acc")), [(START_NS, 32.0, &[0.0, 0.0, 1.0, -0.5, 0.0, 1.0][..])]);
    assert_eq!(runs(signal(&e4, "bvp")), [(START_NS, 64.0, &[-0.5, 1.25][..])]);
    assert_eq!(runs(signal(&e4, "hr"))[0].0, START_NS + 10_000_000_000);
    let intervals = Content::Uneven {
        at_ns: vec![START_NS + 1_500_000_000, START_NS + 2_300_000_000],
        values: vec![812.5, 800.0],
    };
    assert_eq!(signal(&e4, "ibi").content, intervals);
    assert_eq!(marks(signal(&e4, "tags")), [(START_NS + 1_250_000_000, "tag")]);
}

#[test]
fn empty_and_missing_files_of_an_e4_are_left_out() {
    let e4 =
        recording(&files::zipped(&[("E4_session/EDA.csv", "1700000000\n4\n1\n"), ("IBI.csv", "")]));
    assert_eq!(e4.signals.iter().map(|signal| &*signal.name).collect::<Vec<_>>(), ["eda"]);
    assert_eq!(e4.notes, ["IBI.csv has no samples"]);
    let e4 = recording(&files::zipped(&[
        ("EDA.csv", "1700000000\n4\n"),
        ("TEMP.csv", ""),
        ("HR.csv", "1700000000\n1\n61\n"),
    ]));
    assert_eq!(e4.signals.len(), 1);
    assert_eq!(e4.notes, ["EDA.csv has no samples", "TEMP.csv has no samples"]);
}

#[test]
fn a_zip_without_signals_and_one_with_other_text_are_refused() {
    let of = |files: &[(&str, &str)]| {
        read(&files::zipped(files)).expect("a zip").expect_err("not of an E4")
    };
    assert!(matches!(of(&[("a.txt", "b")]), FormatError::Empty(_)));
    let error = of(&[("EDA.csv", "1700000000\n4\n1;5\n")]);
    assert_eq!(error.to_string(), "a line of EDA.csv: \"1;5\"; expected the numbers of one sample");
}

#[test]
fn an_embrace_plus_is_read_by_the_schema_in_the_file() {
    let embrace = recording(&files::embrace_plus());
    assert_eq!(runs(signal(&embrace, "eda")), [(START_NS, 4.0, &[0.25, 0.5][..])]);
    assert_eq!(runs(signal(&embrace, "temperature")), [(START_NS, 4.0, &[33.0][..])]);
    assert_eq!(marks(signal(&embrace, "tags")), [(START_NS + 500_000_000, "tag")]);
}

#[test]
fn samples_of_an_embrace_plus_without_a_rate_are_noted() {
    let embrace = recording(&files::embrace_plus_at(0.0));
    assert!(embrace.signals.iter().all(|signal| signal.name != "eda"));
    assert_eq!(
        embrace.notes,
        ["eda has a rate of 0 Hz: its 2 samples have no times and were left out"]
    );
}

#[test]
fn streams_of_xdf_are_on_the_clock_of_the_recorder() {
    let xdf = recording(&files::xdf());
    let ecg = signal(&xdf, "ECG");
    assert_eq!((ecg.quantity, xdf.is_dated), (Quantity::Ecg, false));
    assert_eq!(runs(ecg), [(60_000_000_000, 100.0, &[5.0, -6.0, 7.0][..])]);
    assert_eq!(marks(signal(&xdf, "Markers")), [(61_000_000_000, "tap")]);
    // The first sample lies at the date of the header.
    let zero_ns = 1_767_608_100_000_000_000 - 60_000_000_000;
    assert_eq!(xdf.date, Some(StatedDate { zero_ns, has_zone: true }));
}

#[test]
fn stamps_of_xdf_that_go_back_begin_another_run() {
    let stamps: Vec<f64> = (0..100).map(|k| f64::from(k) / 4.0).collect();
    let back: Vec<f64> = stamps.iter().map(|secs| secs + 5.0).collect();
    let xdf = recording(&files::xdf_with_stamps(&[&stamps[..], &back].concat(), 4.0));
    let found = runs(signal(&xdf, "EDA"));
    let starts: Vec<(i64, f64)> = found.iter().map(|run| (run.0, run.1)).collect();
    assert_eq!(starts, [(0, 4.0), (5_000_000_000, 4.0)]);
    assert!(xdf.notes[0].contains("EDA go back by more than a second once"), "{:?}", xdf.notes);
    // Jitter does not.
    let jitter = (0..100).map(|k| f64::from(k) / 4.0 + 0.4 * f64::from(k % 2));
    let jitter: Vec<f64> = jitter.collect();
    assert_eq!(runs(signal(&recording(&files::xdf_with_stamps(&jitter, 4.0)), "EDA")).len(), 1);
}

#[test]
fn streams_of_xdf_are_on_the_clock_of_the_recorder_after_a_reset_too() {
    // The sender was restarted between 30 and 60 s.
    let stamps = |from: i32, until: i32, behind_secs: f64| {
        (4 * from..4 * until).map(move |at| f64::from(at) / 4.0 - behind_secs)
    };
    let stamps: Vec<f64> = stamps(0, 30, -900.0).chain(stamps(60, 90, 55.0)).collect();
    let offsets = |from: i32, behind_secs: f64| {
        (from..from + 30).step_by(5).map(move |at| (f64::from(at) - behind_secs, behind_secs))
    };
    let offsets: Vec<_> = offsets(0, -900.0).chain(offsets(60, 55.0)).collect();
    let xdf = recording(&files::xdf_with_offsets(&stamps, 4.0, &offsets));
    let found = runs(signal(&xdf, "EDA"));
    let found: Vec<_> = found.iter().map(|run| (run.0, run.1, run.2.len())).collect();
    assert_eq!(found, [(0, 4.0, 120), (60_000_000_000, 4.0, 120)]);
    let note =
        "the clock of EDA was reset once: its times before and after are converted separately";
    assert_eq!(xdf.notes, [note, "samples of EDA are missing once, for 30.000 s"]);
}

#[test]
fn a_short_gap_in_xdf_does_not_stretch_the_samples_around_it() {
    let stamps = (0..6000).filter(|at| !(3000..3040).contains(at));
    let stamps: Vec<f64> = stamps.map(|at| f64::from(at) / 100.0).collect();
    let xdf = recording(&files::xdf_with_stamps(&stamps, 100.0));
    let found = runs(signal(&xdf, "EDA"));
    let starts: Vec<_> = found.iter().map(|run| (run.0, run.1.round(), run.2.len())).collect();
    assert_eq!(starts, [(0, 100.0, 3000), (30_400_000_000, 100.0, 2960)]);
    assert_eq!(xdf.notes, ["samples of EDA are missing once, for 0.400 s"]);
}

#[test]
fn integers_of_xdf_that_are_rounded_are_counted() {
    let notes = |numbers: &[i64]| recording(&files::xdf_with_integers(numbers)).notes;
    assert_eq!(notes(&[1 << 53, -(1 << 53), i64::MIN, 1 << 62]), [""; 0]);
    let note = "2 integers of EDA are beyond 2^53 and were rounded";
    assert_eq!(notes(&[0, (1 << 53) + 1, i64::MAX]), [note]);
}

#[test]
fn uneven_stamps_of_xdf_that_go_back_are_noted() {
    let notes = |stamps: &[f64]| recording(&files::xdf_with_stamps(stamps, 0.0)).notes;
    assert_eq!(notes(&[1.0, 2.5, 2.4, 7.0]), [""; 0]);
    let back =
        "the stamps of EDA go back by more than a second once: its samples are sorted by time";
    assert_eq!(notes(&[1.0, 2.5, 7.0, 2.6, 3.0]), [back]);
}

#[test]
fn xdf_that_ends_early_is_read_to_its_last_whole_chunk() {
    let mut file = files::xdf();
    file.truncate(file.len() - 3);
    let xdf = recording(&file);
    assert_eq!(xdf.signals.len(), 1);
    assert!(xdf.notes[0].contains("ends within a chunk"), "{:?}", xdf.notes);
}

/// The start [s] of each run in an XDF with boundaries that is damaged, and its notes on the damage.
fn damaged(damage: impl Fn(&mut Vec<u8>, &[usize])) -> (Vec<i64>, Vec<String>) {
    let (mut file, starts) = files::xdf_with_boundaries(1000.0);
    damage(&mut file, &starts);
    let xdf = recording(&file);
    let starts = runs(signal(&xdf, "EDA")).iter().map(|run| run.0 / 1_000_000_000).collect();
    let is_on_gaps = |note: &String| note.starts_with("samples of EDA are missing ");
    (starts, xdf.notes.into_iter().filter(|note| !is_on_gaps(note)).collect())
}

#[test]
fn xdf_with_a_damaged_part_is_read_from_the_next_boundary_on() {
    assert_eq!(damaged(|_, _| {}), (vec![0, 1000, 2000, 3000], vec![]));
    let missing = |bytes: usize| {
        vec![format!("{bytes} bytes in one place could not be read: the samples there are missing")]
    };
    // A chunk of samples has 51 bytes, and 7 of the boundary precede its fixed ones.
    let length = damaged(|file, starts| file[starts[1]] = 7);
    assert_eq!(length, (vec![0, 2000, 3000], missing(58)));
    let too_long = damaged(|file, starts| file[starts[1] + 4] = 0x7f);
    assert_eq!(too_long, length);
    let overwritten = damaged(|file, starts| file[starts[1]..starts[2] - 4].fill(0x55));
    assert_eq!(overwritten, (vec![0, 3000], missing(132)));
    let lost = damaged(|file, starts| drop(file.drain(starts[1] + 20..starts[2] + 21)));
    assert_eq!(lost.0, [0, 3000]);
    // A chunk that another one follows is skipped alone.
    let tag = damaged(|file, starts| file[starts[1] + 5] = 9);
    assert_eq!(tag, (vec![0, 2000, 3000], missing(51)));
    let count = damaged(|file, starts| file[starts[1] + 12] = 9);
    assert_eq!(count, tag);
}

#[test]
fn samples_of_xdf_that_are_missing_do_not_stretch_those_around_them() {
    let (mut file, starts) = files::xdf_with_boundaries(2.5);
    file[starts[1]] = 7;
    let xdf = recording(&file);
    let found: Vec<_> = runs(signal(&xdf, "EDA")).iter().map(|run| (run.0, run.1)).collect();
    assert_eq!(found, [(0, 4.0), (5_000_000_000, 4.0)]);
    // Without a sample missing, the damage is no gap.
    let (mut file, starts) = files::xdf_with_boundaries(2.5);
    file[starts[2] - 1] = 7;
    assert_eq!(runs(signal(&recording(&file), "EDA")).len(), 1);
}

#[test]
fn damaged_places_of_xdf_are_counted() {
    let (starts, notes) = damaged(|file, starts| {
        file[starts[0] + 5] = 9;
        file[starts[2]] = 0;
    });
    let note = "109 bytes in 2 places could not be read: the samples there are missing";
    assert_eq!((starts, notes), (vec![1000, 3000], vec![note.to_owned()]));
}

#[test]
fn xdf_whose_end_is_damaged_does_not_end_within_a_chunk() {
    let (starts, notes) = damaged(|file, starts| file[starts[3]..].fill(0));
    let note = "the last 74 bytes could not be read";
    assert_eq!((starts, notes), (vec![0, 1000, 2000], vec![note.to_owned()]));
    let (_, notes) = damaged(|file, starts| file.truncate(starts[3] + 40));
    assert_eq!(notes, ["the file ends within a chunk: the last 40 bytes could not be read"]);
}

#[test]
fn samples_of_xdf_without_a_stamp_are_not_placed_by_those_before_the_damage() {
    let unstamped = files::chunk(3, &files::ten_samples(None));
    let (whole, notes) =
        damaged(|file, starts| drop(file.splice(starts[2]..starts[2], unstamped.clone())));
    assert_eq!((whole, notes.len()), (vec![0, 1000, 2000, 3000], 0));
    let (starts, notes) = damaged(|file, starts| {
        file.splice(starts[2]..starts[2], unstamped.clone());
        file[starts[1]] = 7;
    });
    let note = "58 bytes in one place could not be read: the samples there are missing; 10 samples after \
                them were left out, as they have no stamps";
    assert_eq!((starts, notes), (vec![0, 2000, 3000], vec![note.to_owned()]));
}

#[test]
fn a_damaged_header_of_xdf_costs_only_its_stream() {
    let mut file = files::xdf();
    let place = file.windows(5).position(|text| text == b"int16").expect("the format of the ECG");
    file[place] = 0;
    let xdf = recording(&file);
    assert_eq!((xdf.signals.len(), marks(signal(&xdf, "Markers")).len()), (1, 1));
    assert_eq!(xdf.notes.len(), 2, "{:?}", xdf.notes);
    assert_eq!(xdf.notes[1], "a chunk of samples has no stream and was skipped");
}

#[test]
fn samples_of_xdf_without_a_time_are_counted() {
    let xdf = recording(&files::xdf_with_stamps(&[1.0, f64::NAN, 1e300, 1.25], 4.0));
    assert_eq!(runs(signal(&xdf, "EDA")), [(1_000_000_000, 4.0, &[3.0, 3.0][..])]);
    assert_eq!(xdf.notes, ["2 samples of EDA have stamps that are not times and were left out"]);
}

#[test]
fn records_of_edf_that_do_not_follow_each_other_are_runs() {
    let edf = recording(&files::edf());
    let (ecg, lowest) = (signal(&edf, "ecg"), -1.0);
    assert_eq!(ecg.channels[0].unit, "mV");
    let found = runs(ecg);
    assert_eq!(found[0], (0, 4.0, &[0.0, 1.0, 0.0, lowest][..]));
    assert_eq!(found[1], (3_000_000_000, 4.0, &[1.0; 4][..]));
    assert_eq!(marks(signal(&edf, "annotations")), [(3_500_000_000, "tap")]);
    let zero_ns = 1_767_268_800_000_000_000;
    assert_eq!(edf.date, Some(StatedDate { zero_ns, has_zone: false }));
    assert!(edf.notes.is_empty());
}

#[test]
fn a_signal_of_edf_without_a_physical_range_is_noted() {
    let edf = recording(&files::edf_to(-1.0));
    assert_eq!(
        edf.notes,
        ["the physical minimum and maximum of ECG are equal: all its samples are -1"]
    );
}

#[test]
fn only_text_may_have_gone_through_a_spreadsheet() {
    let hint = |file: &[u8]| read(file).expect("known").expect_err("malformed").hint();
    let mut edf = files::edf();
    edf[236..240].copy_from_slice(b"abc ");
    assert!(!hint(&edf).contains("spreadsheet"));
    assert!(hint(&files::zipped(&[("EDA.csv", "5.1.26\n4\n1\n")])).contains("spreadsheet"));
}
