//! Tables as written by databases, spreadsheets, stopwatches and old programs.

use super::*;

const MS: i64 = 1_000_000;

fn rows_of(count: u32, row: impl Fn(u32) -> String) -> String {
    (0..count).map(row).collect()
}

#[test]
fn bars_separate_cells_also_in_a_drawn_table() {
    let rows = |row: fn(u32) -> String| rows_of(30, row);
    for (name, text) in [
        ("plain", "time_ms|ecg\n".to_owned() + &rows(|k| format!("{}|{k}\n", k * 4))),
        ("commas", "time_ms|ecg\n".to_owned() + &rows(|k| format!("{},0|{k},0\n", k * 4))),
        (
            "psql",
            " time_ms | ecg \n---------+-----\n".to_owned()
                + &rows(|k| format!(" {:7} | {k} \n", k * 4)),
        ),
        (
            "markdown",
            "| time_ms | ecg |\n|--------:|:----|\n".to_owned()
                + &rows(|k| format!("| {} | {k} |\n", k * 4)),
        ),
        (
            "mysql",
            "+---------+-----+\n| time_ms | ecg |\n+---------+-----+\n".to_owned()
                + &rows(|k| format!("| {} | {k} |\n", k * 4))
                + "+---------+-----+\n",
        ),
    ] {
        let (table, times, numbers) = reported(&format!("bars_{name}"), &of(Signal::Ecg), &text);
        assert_eq!((table.rate_hz(), table.names()), (250.0, &["ecg".to_owned()][..]), "{name}");
        assert_eq!((times[3], &numbers[3][..], numbers.len()), (12 * MS, &[3.0][..], 30), "{name}");
        assert_eq!(table.oddities().count(), 0, "{name}");
        let (all, ..) = reported(&format!("all_{name}"), &wanted("other", true), &text);
        assert_eq!(all.names(), ["ecg"], "{name}: nothing stands outside of the outer bars");
    }
}

#[test]
fn lines_may_end_with_carriage_returns() {
    let text = "time_ms,ecg\n".to_owned() + &rows_of(30, |k| format!("{},{k}\n", k * 4));
    let read = |name: &str, text: &str| {
        let (table, times, numbers) = reported(name, &of(Signal::Ecg), text);
        assert_eq!(table.read_share(), Some(1.0), "{name}");
        (times, numbers)
    };
    let expected = read("feeds", &text);
    assert_eq!(expected.1.len(), 30);
    for (name, end) in [("returns", "\r"), ("both", "\r\n"), ("twice", "\r\r\n")] {
        assert_eq!(read(name, &text.replace('\n', end)), expected, "{name}");
    }
    // A carriage return within a line does not end it where lines end otherwise.
    let file = File::new("within.csv", "ecg;note\n1;\"a\rb\"\n2;c\nx;d\n");
    let mut table = Table::open(&file.0, &of(Signal::Ecg), Some(250.0)).unwrap();
    assert_eq!(table.next_row().unwrap().unwrap().values, [1.0]);
    assert_eq!(table.next_row().unwrap().unwrap().values, [2.0]);
    assert!(matches!(table.next_row(), Err(TableError::Text { line: 4, .. })));
}

#[test]
fn a_stopwatch_s_times_are_minutes_and_seconds() {
    let text = "time;eda\n".to_owned()
        + &rows_of(40, |k| {
            let (minutes, secs, ms) = (59 + (k + 220) / 240, (k / 4 + 55) % 60, k % 4 * 250);
            format!("{minutes:02}:{secs:02}.{ms:03};{k}\n")
        });
    let (table, times, _) = reported("stopwatch.csv", &of(Signal::Eda), &text);
    assert_eq!((table.rate_hz(), times[0]), (4.0, (59 * 60 + 55) * 1000 * MS));
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 250 * MS), "{times:?}");
    assert!(table.notes().iter().any(|note| note.contains("minutes and seconds")));
    // An ambiguous column is taken as times of day, with a note, unless the user names its form.
    let text = "time;temp\n08:15;33.1\n08:16;33.2\n08:17;33.3\n";
    let (table, times, _) = reported("of_day.csv", &of(Signal::Temperature), text);
    assert_eq!(times[1] - times[0], 60_000 * MS);
    assert!(table.notes().iter().any(|note| note.contains("--time \"time:mm:ss\"")));
    let named = Wanted { time: Some("time:mm:ss".into()), ..of(Signal::Temperature) };
    let (_, times, _) = reported("named.csv", &named, text);
    assert_eq!(times[1] - times[0], 1_000 * MS);
}

#[test]
fn days_of_a_spreadsheet_are_its_dates() {
    let day = |k: u32| 44_291.5 + f64::from(k) / 86_400.0 / 4.0;
    let text = "date;eda\n".to_owned()
        + &rows_of(40, |k| format!("{:.10};{k}\n", day(k)).replace('.', ","));
    let (table, times, _) = reported("excel.csv", &of(Signal::Eda), &text);
    assert!((table.rate_hz() - 4.0).abs() < 1e-3, "{}", table.rate_hz());
    assert_eq!(times[0], 1_617_624_000_000 * MS, "5 April 2021, noon");
    assert!(table.notes().iter().any(|note| note.contains("days since 1900")));
    // So slow that they may also be seconds: the user names the form.
    let text = "at;temp\n44291.50;33.1\n44291.75;33.2\n44292.00;33.3\n";
    let named = Wanted { time: Some("at:excel".into()), ..of(Signal::Temperature) };
    let (_, times, _) = reported("named_excel.csv", &named, text);
    assert_eq!(times[1] - times[0], 6 * 3_600_000 * MS);
}
