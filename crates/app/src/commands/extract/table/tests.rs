use std::path::PathBuf;

use teampulse_core::stream::Signal;
use teampulse_features::analyses::Analysis;

use super::super::analyses;
use super::*;

mod devices;
mod forms;
mod noted;
mod odd;

fn wanted(signal: &'static str, takes_all: bool) -> Wanted {
    Wanted {
        signal,
        words: &[],
        takes_all,
        channels: None,
        unit: None,
        is_even: true,
        least_hz: 0.0,
        columns: Vec::new(),
        time: None,
        decimal: None,
    }
}

/// What `extract --signal` looks for.
fn of(signal: Signal) -> Wanted {
    analyses::wanted(Analysis::of(signal).unwrap(), Vec::new(), None, None)
}

/// The contents of a file with this text: the table, its times [ns] and its numbers.
fn reported(name: &str, wanted: &Wanted, text: &str) -> (Table, Vec<i64>, Vec<Vec<f64>>) {
    let file = File::new(name, text);
    let mut table = Table::open(&file.0, wanted, None).unwrap();
    let (mut times, mut numbers) = (Vec::new(), Vec::new());
    while let Some(row) = table.next_row().unwrap() {
        times.extend(row.at_ns);
        numbers.push(row.values);
    }
    (table, times, numbers)
}

/// A file that is removed at the end of the test.
struct File(PathBuf);

impl File {
    fn new(name: &str, text: impl AsRef<[u8]>) -> File {
        let path = std::env::temp_dir().join(format!("teampulse_{}_{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        File(path)
    }
}

impl Drop for File {
    fn drop(&mut self) {
        std::fs::remove_file(&self.0).unwrap();
    }
}

fn rows(table: &mut Table) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    while let Some(row) = table.next_row().unwrap() {
        rows.push(row.values);
    }
    rows
}

#[test]
fn an_e4_gives_when_it_began_and_its_rate() {
    let file = File::new("e4.csv", "1551453301.0, 1551453301.0\n32.0, 32.0\n-1,65\n-2,64\n");
    let mut table = Table::open(&file.0, &wanted("acceleration", true), None).unwrap();
    assert!((table.rate_hz() - 32.0).abs() < 1e-12);
    assert_eq!(rows(&mut table), [[-1.0, 65.0], [-2.0, 64.0]]);
}

#[test]
fn a_column_may_contain_the_times_and_so_determine_the_rate() {
    let file = File::new("times.csv", "time_ms,ecg\n0,1\n10,2\n20.5,3\n50,4\n");
    let chosen = Wanted { time: Some("time_ms".into()), ..wanted("ecg", false) };
    let mut table = Table::open(&file.0, &chosen, None).unwrap();
    assert!((97.0..=101.0).contains(&table.rate_hz()), "{}", table.rate_hz());
    let times: Vec<Option<i64>> =
        std::iter::from_fn(|| table.next_row().unwrap()).map(|row| row.at_ns).collect();
    assert_eq!(times, [0, 10_000_000, 20_500_000, 50_000_000].map(Some));
}

#[test]
fn a_column_of_times_or_of_text_is_not_a_signal() {
    let file = File::new("text.csv", "Sample Index,EXG Channel 0,Note\n0,1.5,go\n1,2.5,\n");
    let mut table = Table::open(&file.0, &wanted("eeg", true), Some(250.0)).unwrap();
    assert_eq!(table.names(), ["EXG Channel 0"]);
    assert_eq!(rows(&mut table), [[1.5], [2.5]]);
}

#[test]
fn a_short_line_lacks_its_last_cells() {
    let file = File::new("short.csv", "1,2,3\n4\n");
    let mut table = Table::open(&file.0, &wanted("emg", true), Some(200.0)).unwrap();
    let rows = rows(&mut table);
    assert_eq!((&rows[0][..], &rows[1][..1]), (&[1.0, 2.0, 3.0][..], &[4.0][..]));
    assert!(rows[1][1..].iter().all(|cell| cell.is_nan()));
    let notes: Vec<String> = table.oddities().collect();
    assert!(notes[0].contains("1 row has fewer cells than the others, in line 2"), "{notes:?}");
}

#[test]
fn any_bytes_are_a_table_or_an_error() {
    use proptest::prelude::*;
    let number = std::cell::Cell::new(0);
    let line = proptest::collection::vec(
        proptest::sample::select(b"0123456789.,;-e \t\n\n#%abcnN\"\xff\0".to_vec()),
        0..200,
    );
    proptest!(ProptestConfig::with_cases(300), |(bytes in line, takes_all: bool)| {
        number.set(number.get() + 1);
        let file = File::new(&format!("any{}", number.get()), bytes);
        if let Ok(mut table) = Table::open(&file.0, &wanted("ecg", takes_all), Some(100.0)) {
            let width = table.names().len();
            while let Ok(Some(row)) = table.next_row() {
                prop_assert_eq!(row.values.len(), width);
            }
        }
    });
}
