//! Notes on tables: every omission and every choice is reported.

use super::*;

/// The notes on a table with this text that was read with a rate [Hz].
fn notes(signal: Signal, text: impl AsRef<[u8]>, rate_hz: Option<f64>) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noted.csv");
    std::fs::write(&path, text).unwrap();
    let mut table = Table::open(&path, &of(signal), rate_hz).unwrap();
    rows(&mut table);
    let odd: Vec<String> = table.oddities().collect();
    [table.notes().to_vec(), odd].concat()
}

#[test]
fn an_empty_line_is_a_missing_sample_only_where_lines_hold_one_sample() {
    let values = |name: &str, signal, text: &str| {
        let (_, _, values) = reported(name, &of(signal), text);
        values.into_iter().map(|row| row[0]).collect::<Vec<f64>>()
    };
    let filled = |values: &[f64]| values.iter().map(|value| !value.is_nan()).collect::<Vec<_>>();
    let head = "# Sampling Rate: 100 Hz\n";
    let alone = format!("{head}\necg\n\n1\n2\n\n  \n# a comment\n3\n\n\n");
    let found = filled(&values("empty_alone", Signal::Ecg, &alone));
    assert_eq!(found, [true, true, false, false, true]);
    let note = &notes(Signal::Ecg, &alone, None)[0];
    assert!(note.starts_with("2 cells are not numbers, the first in line 7"), "{note}");
    let after = format!("{head}{}\n{}", "1\n".repeat(40), "2\n".repeat(40));
    assert_eq!(values("empty_late", Signal::Ecg, &after).len(), 81);
    // Elsewhere it is no sample: in tables of several columns, in lists of intervals, and where it is spacing.
    let several = format!("{head}ecg,eda\n1,2\n\n3,4\n\n");
    assert_eq!(filled(&values("empty_several", Signal::Ecg, &several)), [true; 2]);
    assert_eq!(filled(&values("empty_rr", Signal::Interval, "800\n810\n\n790\n")), [true; 3]);
    let spaced = format!("{head}ecg\n{}", "1\n\n".repeat(5));
    assert_eq!(filled(&values("empty_spaced", Signal::Ecg, &spaced)), [true; 5]);
}

fn timed(step_ms: usize) -> String {
    let rows = (0..40).map(|k| format!("{},{k}\n", k * step_ms));
    rows.fold("time_ms,ecg\n".to_owned(), |text, row| text + &row)
}

#[test]
fn a_rate_that_overrides_times_is_reported() {
    let [note] = &notes(Signal::Ecg, timed(4), Some(130.0))[..] else { panic!("one note") };
    assert!(note.starts_with("--rate (130 Hz) is used, not the times in column time_ms (250 Hz)"));
    assert!(note.ends_with("give --time \"time_ms\" to use the times"), "{note}");
    assert!(
        notes(Signal::Ecg, timed(4), None)[0].starts_with("times are read from column time_ms")
    );
    // The times of our own tables are followed, whatever the rate.
    let own = (0..40).map(|k| format!("{:.3},{k}\n", f64::from(k) * 0.004));
    let own = own.fold("time_secs,ecg\n".to_owned(), |text, row| text + &row);
    assert_eq!(notes(Signal::Ecg, &own, Some(250.0)), [""; 0]);
    let [note] = &notes(Signal::Ecg, &own, Some(130.0))[..] else { panic!("one note") };
    assert_eq!(note, "--rate (130 Hz) is not the rate of the times in column time_secs (250 Hz)");
}

#[test]
fn a_rate_that_differs_from_the_table_is_reported() {
    let text = "%Sample Rate = 250 Hz\nStamp,ecg,Timestamp\n1,2,0.000\n2,3,0.010\n3,4,0.020\n";
    assert!(
        notes(Signal::Ecg, text, Some(200.0))
            .contains(&"--rate (200 Hz) is used, not the 250 Hz in the table".to_owned())
    );
    let noted = notes(Signal::Ecg, text, None);
    assert!(
        noted.iter().any(|note| note.starts_with("the rate in the table (250 Hz)")),
        "{noted:?}"
    );
    let e4 = "1551453301.0\n4.0\n0.5\n0.6\n";
    let [note] = &notes(Signal::Eda, e4, Some(8.0))[..] else { panic!("one note") };
    assert_eq!(note, "--rate (8 Hz) is used, not the 4 Hz in the table");
    assert_eq!(notes(Signal::Eda, e4, Some(4.0)), [""; 0]);
}

#[test]
fn odd_rows_are_counted_with_the_first_line_of_each_kind() {
    let mut lines = vec!["x,ecg,note".to_owned()];
    lines.extend((0..30).map(|k| format!("{k},{k},")));
    lines[20] = "19".into();
    lines[23] = "22,,".into();
    lines[25] = "24,NaN,".into();
    lines[26] = "25,1,a,b".into();
    lines[28] = "27,1,5,a".into();
    let noted = notes(Signal::Ecg, lines.join("\n"), Some(250.0));
    assert_eq!(
        noted,
        [
            "1 row has fewer cells than the others, in line 21: absent cells count as missing \
             (of 30 rows)",
            "2 rows have more cells than the others, the first in line 27: all cells of such a row count as missing \
             (of 30 rows)",
            "2 cells are not numbers, the first in line 24: counted as missing samples (of 30 rows)",
        ]
    );
}

#[test]
fn a_row_with_unassignable_cells_holds_no_number() {
    let mut lines = vec!["time,temp".to_owned()];
    lines.extend((0..40).map(|k| format!("{},{:02},33,{:02}", k / 4, k % 4 * 25, 40 + k % 7)));
    lines[30] = "7,25,33".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("commas.csv");
    std::fs::write(&path, lines.join("\n")).unwrap();
    let mut table = Table::open(&path, &of(Signal::Temperature), None).unwrap();
    let read = rows(&mut table);
    assert!(read[29][0].is_nan() && read.iter().filter(|row| row[0].is_nan()).count() == 1);
    assert!(table.oddities().any(|note| note.contains("in line 31")));
}

#[test]
fn a_separator_at_the_end_of_the_names_does_not_begin_a_column() {
    let text = "Phone timestamp;HR [bpm];HRV [ms];\n2026-04-24T14:10:15.270;72;;\n2026-04-24T14:10:16.270;73;;\n";
    let (table, ..) = reported("psl_hr.txt", &of(Signal::Other), text);
    assert_eq!(table.names(), ["HR [bpm]", "HRV [ms]"]);
    assert!(table.oddities().all(|note| note.contains("2 cells are not numbers")));
}

#[test]
fn times_that_are_not_those_of_samples_give_no_rate() {
    let coarse = |k: usize| format!("05.04.2021 15:48:{:02},{k}\n", k / 40);
    let burst = |k: usize| format!("2021-04-05 15:48:04.{:03},{k}\n", k / 12 * 47 + k % 12);
    for (name, row) in [("coarse.csv", &coarse as &dyn Fn(usize) -> String), ("burst.csv", &burst)]
    {
        let text = (0..200).map(row).fold("time,v\n".to_owned(), |text, row| text + &row);
        let file = File::new(name, text);
        let open = |wanted: &Wanted, rate_hz| Table::open(&file.0, wanted, rate_hz).map(|_| ());
        let is_refused =
            |opened| matches!(opened, Err(TableError::Coarse { .. } | TableError::Bursts { .. }));
        assert!(is_refused(open(&of(Signal::Other), None)), "{name}");
        let table = Table::open(&file.0, &of(Signal::Other), Some(4.0)).unwrap();
        // At a rate the rows follow each other from the first time on.
        assert_eq!(table.begin_ns().map(|ns| ns / 60_000_000_000), Some(26_960_628), "{name}");
        let named = Wanted { time: Some("time".into()), ..of(Signal::Other) };
        assert!(open(&named, None).is_ok(), "{name}");
    }
}

#[test]
fn rows_that_share_times_are_spread_evenly() {
    let row = |k: usize| format!("05.04.2021 15:48:{:02},{k}\n", k / 4);
    let text = (0..200).map(row).fold("time,v\n".to_owned(), |text, row| text + &row);
    let (table, ..) = reported("shared.csv", &of(Signal::Other), &text);
    assert!((table.rate_hz() - 4.0).abs() < 1e-9, "{}", table.rate_hz());
    assert!(table.notes().iter().any(|note| note.contains("spread evenly")), "{:?}", table.notes());
}

#[test]
fn ambiguous_decimal_commas_are_refused() {
    let text = "time,temp\n0,33,40\n0,25,33,41\n0,5,33,42\n0,75,33\n1,33,43\n";
    let file = File::new("ragged.csv", text);
    let opened = Table::open(&file.0, &of(Signal::Temperature), None);
    assert!(matches!(opened, Err(TableError::Ragged { line: 2, names: 2, cells: 3 })));
}

#[test]
fn a_table_in_utf_16_is_read_as_any_other() {
    let text = "time;temp [°C]\r\n0,00;33,1\r\n0,25;33,2\r\n0,50;33,3\r\n";
    let bytes = |unit: u16| unit.to_le_bytes();
    for mark in ["", "\u{feff}"] {
        let wide: Vec<u8> = format!("{mark}{text}").encode_utf16().flat_map(bytes).collect();
        let file = File::new("wide.csv", wide);
        let mut table = Table::open(&file.0, &of(Signal::Temperature), None).unwrap();
        assert_eq!((table.rate_hz(), table.units()), (4.0, &[Some("°C".to_owned())][..]));
        assert_eq!(rows(&mut table), [[33.1], [33.2], [33.3]]);
        assert_eq!(table.read_share(), Some(1.0));
    }
}

#[test]
fn intervals_with_the_times_of_their_beats_need_no_names() {
    let text = "1.443999\t0.754700\n2.172049\t0.728051\n2.899486\t0.727436\n3.629486\t0.730000\n";
    let (table, times, numbers) = reported("intervals.txt", &of(Signal::Interval), text);
    assert_eq!(
        (table.names(), table.units()),
        (&["rr".to_owned()][..], &[Some("s".to_owned())][..])
    );
    assert_eq!((times[0], &numbers[1][..]), (1_443_999_000, &[0.728_051][..]));
}

#[test]
fn a_first_row_with_too_few_cells_is_one_with_missing_cells() {
    let text = "time [s],ecg [mV]\n0.000\n0.010,1.5\n0.020,1.6\n0.030,1.7\n";
    let (table, times, numbers) = reported("first_short.csv", &of(Signal::Ecg), text);
    assert_eq!((times.len(), &numbers[1][..]), (4, &[1.5][..]));
    let [note] = &table.oddities().collect::<Vec<_>>()[..] else { panic!("one note") };
    assert!(note.starts_with("1 row has fewer cells than the others, in line 2"));
    // Without names a line without a comma shows that commas are decimal.
    let file = File::new("decimals.csv", "33,4\n33\n33,6\n");
    let mut table = Table::open(&file.0, &of(Signal::Temperature), Some(4.0)).unwrap();
    assert_eq!(rows(&mut table), [[33.4], [33.0], [33.6]]);
}

#[test]
fn times_that_never_increase_are_named() {
    let rows = (0..40).map(|k| format!("{},{k}\n", 40 - k));
    let text = rows.fold("time [s],eda [uS]\n".to_owned(), |text, row| text + &row);
    let file = File::new("falling.csv", text);
    let error = Table::open(&file.0, &of(Signal::Eda), None).map(|_| ()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "find the sampling rate: the times in column time [s] never increase"
    );
    assert!(error.hint().starts_with("sort the table"));
}

#[test]
fn a_column_with_a_unit_of_time_may_hold_the_times() {
    let file =
        File::new("zeit.csv", "Zeit [s];Hautleitwert [\u{b5}S]\n0,00;3,1\n0,25;3,2\n0,50;3,3\n");
    let chosen = Wanted { columns: vec!["2".into()], ..of(Signal::Eda) };
    let error = Table::open(&file.0, &chosen, None).map(|_| ()).unwrap_err();
    assert_eq!(error.hint(), "give --rate HZ, or --time \"Zeit [s]\" if that column holds times");
    let file = File::new("plain.csv", "3.1\n3.2\n3.3\n");
    let error = Table::open(&file.0, &of(Signal::Eda), None).map(|_| ()).unwrap_err();
    assert!(error.hint().contains("--time NAME"), "{}", error.hint());
}

#[test]
fn a_first_column_without_a_name_that_rises_evenly_is_noted() {
    let text = |step: fn(u32) -> u32| {
        let rows = (0..40).map(|k| format!("{}.5,{}\n", step(k), k * k % 7));
        rows.collect::<String>()
    };
    let noted = notes(Signal::Emg, text(|k| 4 * k), Some(250.0));
    assert!(noted[0].contains("give --time 1 if it holds times"), "{noted:?}");
    assert!(notes(Signal::Emg, text(|k| 4 * k % 9), Some(250.0)).is_empty());
    let named = format!("a,b\n{}", text(|k| 4 * k));
    assert!(notes(Signal::Emg, named, Some(250.0)).is_empty());
}
