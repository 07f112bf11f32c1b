//! The meaning of the cells of a column of times.

use super::dates::{DAY_NS, Order, date_ns, has_zone, minutes_ns, order, time_of_day_ns};
use super::line::number;
use super::sampling::Sampling;
use super::times::nanos;
use super::units::in_brackets;

/// Units of time, with their lengths [ns].
const UNITS: [(&str, i64); 4] = [("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000), ("ns", 1)];
/// Words in column names, with the lengths of their units [ns]; a word that contains another one comes before it.
const WORDS: [(&str, i64); 6] = [
    ("nano", 1),
    ("micro", 1_000),
    ("milli", 1_000_000),
    ("second", 1_000_000_000),
    ("minute", 60_000_000_000),
    ("hour", 3_600_000_000_000),
];
/// A number at least this large is a time since 1970, or since 2000, in nanoseconds, microseconds or milliseconds: in a
/// larger unit it would mean thousands of years.
const SINCE_1970: [(f64, i64); 3] = [(1e17, 1), (1e14, 1_000), (1e11, 1_000_000)];
/// The highest sampling rate of a signal of a person [Hz].
const MOST_HZ: f64 = 100_000.0;
/// Spreadsheets store dates as days since 1899-12-30; this is 1970-01-01 [days].
const EXCEL_1970: i64 = 25_569;
/// The range of such dates, 2000 to 2099 [days], and of plausible rates of their rows [Hz]: read as seconds, the same
/// numbers would exceed 17 kHz.
const EXCEL_DAYS: std::ops::Range<f64> = 36_526.0..73_051.0;
const EXCEL_HZ: std::ops::RangeInclusive<f64> = 0.2..=5_000.0;

/// How a column of times is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    form: Form,
    /// Added to every time [ns].
    offset_ns: i64,
    /// The last time of day [ns], and how many midnights have passed.
    last_ns: i64,
    midnights: i64,
    /// A note on how the column was read; empty if there is nothing to note.
    pub note: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// Numbers in a unit of this length [ns].
    Number(i64),
    /// A date with a time of day.
    Date(Order),
    TimeOfDay,
    /// Minutes and seconds since the start.
    Minutes,
}

/// The length of a unit of time [ns].
pub fn unit_ns(unit: &str) -> Option<i64> {
    let conversion = teampulse_core::units::Conversion::between(unit.trim(), "ns")?;
    (!unit.trim().is_empty()).then(|| conversion.of(1.0).round() as i64).filter(|ns| *ns > 0)
}

/// The unit of times in a column with this name [ns], if the name states one: in brackets, at its end, or as a word.
pub fn unit_of_name_ns(name: &str) -> Option<i64> {
    let name = name.to_ascii_lowercase();
    let ending = name.rsplit_once('_').map(|(_, ending)| ending);
    let of_spelling = in_brackets(&name).into_iter().chain(ending).find_map(unit_ns);
    let of_word = WORDS.iter().find(|(word, _)| name.contains(word)).map(|(_, ns)| *ns);
    of_spelling.or(of_word)
}

impl Clock {
    /// Creates a clock for numbers in a unit of this length [ns].
    pub fn of_unit(ns: i64) -> Clock {
        Clock::new(Form::Number(ns), String::new())
    }

    /// Returns the clock for the unit given with a column of times: a unit of time, `excel` or `mm:ss`.
    pub fn named(unit: &str) -> Option<Clock> {
        match unit {
            "mm:ss" => Some(Clock::new(Form::Minutes, String::new())),
            "excel" => Some(Clock::excel(String::new())),
            unit => unit_ns(unit).map(Clock::of_unit),
        }
    }

    /// Creates a clock for days since 1900, as spreadsheets store dates.
    fn excel(note: String) -> Clock {
        let days = Clock::new(Form::Number(DAY_NS), note);
        Clock { offset_ns: -EXCEL_1970 * DAY_NS, ..days }
    }

    fn new(form: Form, note: String) -> Clock {
        Clock { form, offset_ns: 0, last_ns: 0, midnights: 0, note }
    }

    /// Finds how to read these cells of a column without a stated unit: dates and times of day by their form, numbers
    /// by their size and by the lowest plausible rate of a signal [Hz]. Returns `None` if they are not times.
    pub fn recognised(name: &str, cells: &[&str], least_hz: f64) -> Option<Clock> {
        let cells: Vec<&str> = cells.iter().copied().filter(|cell| !cell.is_empty()).collect();
        if let Some((order, is_open)) = order(&cells) {
            let which = match order {
                _ if !is_open => "",
                Order::Month => ", the month first",
                _ => ", the day first",
            };
            let has_zone = cells.iter().all(|cell| has_zone(cell));
            let zone = if has_zone { "" } else { ", taken as UTC" };
            let note = format!("the times in column {name} are dates{which}{zone}");
            return Some(Clock::new(
                Form::Date(order),
                if has_zone && !is_open { String::new() } else { note },
            ));
        }
        if cells.is_empty() {
            return None;
        }
        if cells.iter().all(|cell| time_of_day_ns(cell).is_some()) {
            return Some(Clock::of_day_or_minutes(name, &cells, least_hz));
        }
        if cells.iter().all(|cell| minutes_ns(cell).is_some()) {
            return Some(Clock::minutes(name));
        }
        let numbers = cells.iter().map(|cell| nanos(cell, 1).ok().flatten());
        let first = numbers.collect::<Option<Vec<i64>>>()?.first().copied()? as f64;
        if let Some((_, ns)) = SINCE_1970.iter().find(|(least, _)| first.abs() >= *least) {
            return Some(Clock::of_unit(*ns));
        }
        if let Some(excel) = Clock::of_spreadsheet(name, &cells, least_hz) {
            return Some(excel);
        }
        let rate_of_unit_hz = |ns: i64| {
            let times = cells.iter().filter_map(|cell| nanos(cell, ns).ok().flatten());
            rate_hz(&times.collect::<Vec<_>>())
        };
        let fits = |(_, ns): &&(&str, i64)| {
            rate_of_unit_hz(*ns).is_some_and(|rate_hz| (least_hz..=MOST_HZ).contains(&rate_hz))
        };
        // Steps of exactly one may also be row numbers.
        let counts =
            rate_of_unit_hz(UNITS[0].1).is_some_and(|rate_hz| (rate_hz - 1.0).abs() < 1e-9);
        let unit = UNITS.iter().find(fits).filter(|(unit, _)| *unit == "s" || !counts);
        let (unit, ns) = unit.copied().unwrap_or(UNITS[0]);
        let note =
            format!("the times in column {name} are read as {unit}, which gives a plausible rate");
        Some(Clock::new(Form::Number(ns), if unit == "s" { String::new() } else { note }))
    }

    /// Reads cells as times of day, or as minutes and seconds if the signal needs more than one row per minute.
    /// Otherwise, times that start at zero are those of a stopwatch.
    fn of_day_or_minutes(name: &str, cells: &[&str], least_hz: f64) -> Clock {
        let note = format!("the times in column {name} are times of day");
        let of_day = Clock::new(Form::TimeOfDay, note);
        if !cells.iter().all(|cell| minutes_ns(cell).is_some()) {
            return of_day;
        }
        if !of_day.fits(cells, least_hz) || minutes_ns(cells[0]) < Some(60 * UNITS[0].1) {
            return Clock::minutes(name);
        }
        let note = format!(
            "{} (hours and minutes); give --time \"{name}:mm:ss\" if they are minutes and seconds",
            of_day.note
        );
        Clock { note, ..of_day }
    }

    fn minutes(name: &str) -> Clock {
        let note = format!("the times in column {name} are read as minutes and seconds");
        Clock::new(Form::Minutes, note)
    }

    /// Returns a clock for days since 1900 if the numbers can't be anything else.
    fn of_spreadsheet(name: &str, cells: &[&str], least_hz: f64) -> Option<Clock> {
        let is_day = |cell: &&str| number(cell).is_some_and(|days| EXCEL_DAYS.contains(&days));
        let note =
            format!("the times in column {name} are days since 1900, as in Excel, taken as UTC");
        let excel = Clock::excel(note);
        let rate_hz = cells.iter().all(is_day).then(|| excel.rate_hz(cells)).flatten()?;
        (EXCEL_HZ.contains(&rate_hz) && rate_hz >= least_hz).then_some(excel)
    }

    /// Whether these cells are times at a plausible rate, at least `least_hz` [Hz].
    pub fn fits(&self, cells: &[&str], least_hz: f64) -> bool {
        let times = self.times_of(cells);
        !times.is_empty() && rate_hz(&times).is_none_or(|hz| (least_hz..=MOST_HZ).contains(&hz))
    }

    /// The rate of rows with these times [Hz].
    pub fn rate_hz(&self, cells: &[&str]) -> Option<f64> {
        rate_hz(&self.times_of(cells))
    }

    fn times_of(&self, cells: &[&str]) -> Vec<i64> {
        let mut probe = self.clone();
        cells.iter().filter_map(|cell| probe.read(cell).ok().flatten()).collect()
    }

    /// Returns the same clock, shifted so that this cell has this time [ns].
    pub fn shifted(self, cell: &str, at_ns: i64) -> Clock {
        let mut probe = self.clone();
        let own_ns = probe.read(cell).ok().flatten();
        let offset_ns = own_ns.map_or(0, |own_ns| at_ns.saturating_sub(own_ns));
        Clock { offset_ns, ..self }
    }

    /// Reads the time of a cell [ns]; `None` if the cell is marked as missing.
    pub fn read(&mut self, cell: &str) -> Result<Option<i64>, ()> {
        if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
            return Ok(None);
        }
        let at_ns = match self.form {
            Form::Number(unit_ns) => return nanos(cell, unit_ns).map(|at_ns| self.after(at_ns)),
            Form::Date(order) => date_ns(cell, order).ok_or(())?,
            Form::Minutes => minutes_ns(cell).ok_or(())?,
            Form::TimeOfDay => {
                let at_ns = time_of_day_ns(cell).ok_or(())?;
                // A step back by more than half a day means that midnight has passed.
                let back_ns = std::mem::replace(&mut self.last_ns, at_ns) - at_ns;
                self.midnights += i64::from(back_ns > DAY_NS / 2);
                at_ns + self.midnights * DAY_NS
            }
        };
        Ok(self.after(Some(at_ns)))
    }

    fn after(&self, at_ns: Option<i64>) -> Option<i64> {
        at_ns.map(|at_ns| at_ns.saturating_add(self.offset_ns))
    }
}

/// The rate of rows at these times [Hz].
fn rate_hz(times_ns: &[i64]) -> Option<f64> {
    Sampling::of(times_ns).map(|sampling| sampling.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;

    fn read(cells: &[&str], least_hz: f64) -> Vec<i64> {
        let mut clock = Clock::recognised("t", cells, least_hz).unwrap();
        cells.iter().map(|cell| clock.read(cell).unwrap().unwrap()).collect()
    }

    #[test]
    fn times_since_1970_give_their_unit_by_their_size() {
        for cells in [
            ["1595933810.034", "1595933810.057"],
            ["1595933810034", "1595933810057"],
            ["1595933810034000", "1595933810057000"],
            ["1595933810034000000", "1595933810057000000"],
            ["1.595933810034E12", "1.595933810057E12"],
        ] {
            let times = read(&cells, 10.0);
            assert!((times[0] - 1_595_933_810_034_000_000).abs() < 1000, "{cells:?}: {times:?}");
            assert!((times[1] - times[0] - 23_000_000).abs() < 1000, "{cells:?}: {times:?}");
        }
    }

    #[test]
    fn the_unit_of_times_since_the_start_follows_from_their_rate() {
        let clock = |cells: &[&str]| Clock::recognised("t", cells, 50.0).unwrap();
        assert_eq!(clock(&["0", "0,004", "0,008"]), Clock::of_unit(SEC));
        for (cells, ns) in [
            (["0", "4", "8"], 1_000_000),
            (["0", "7,8125", "15,625"], 1_000_000),
            (["0", "4000", "8000"], 1_000),
            (["0", "4000000", "8000000"], 1),
        ] {
            assert_eq!(clock(&cells).form, Form::Number(ns), "{cells:?}");
            assert!(clock(&cells).note.contains("column t"), "{cells:?}");
        }
        // Row numbers are not milliseconds.
        assert_eq!(clock(&["0", "1", "2"]), Clock::of_unit(SEC));
    }

    #[test]
    fn a_unit_in_the_name_is_recognised() {
        for (name, ns) in [
            ("time_ms", Some(1_000_000)),
            ("timestamp [ms]", Some(1_000_000)),
            ("sensor timestamp [ns]", Some(1)),
            ("Time (s)", Some(SEC)),
            ("time_secs", Some(SEC)),
            ("Milliseconds", Some(1_000_000)),
            ("seconds", Some(SEC)),
            ("time [min]", Some(60 * SEC)),
            ("Time (minutes)", Some(60 * SEC)),
            ("time_min", Some(60 * SEC)),
            ("Time (h)", Some(3600 * SEC)),
            ("time_hours", Some(3600 * SEC)),
            ("timestamp_sec", Some(SEC)),
            ("timestamp", None),
            ("columns", None),
        ] {
            assert_eq!(unit_of_name_ns(name), ns, "{name}");
        }
        assert_eq!((unit_ns("ms"), unit_ns("uV"), unit_ns("")), (Some(1_000_000), None, None));
    }

    #[test]
    fn frequent_rows_have_minutes_and_seconds_not_hours_and_minutes() {
        let form = |cells: &[&str]| Clock::recognised("t", cells, 0.0).unwrap().form;
        assert_eq!(form(&["00:00.000", "00:00.250"]), Form::Minutes);
        assert_eq!(form(&["59:59", "60:00", "60:01"]), Form::Minutes);
        assert_eq!(form(&["00:00", "00:01", "00:02"]), Form::Minutes);
        assert_eq!(form(&["08:15", "08:16", "08:17"]), Form::TimeOfDay);
        let of_eda = Clock::recognised("t", &["08:15", "08:16", "08:17"], 0.9).unwrap();
        assert_eq!(of_eda.form, Form::Minutes);
        assert_eq!(form(&["00:00:00", "00:00:01", "00:00:02"]), Form::TimeOfDay);
        assert_eq!(read(&["59:59.5", "60:00.0"], 1.0), [3_599_500_000_000, 3600 * SEC]);
    }

    #[test]
    fn days_of_spreadsheets_are_dates() {
        // 5 April 2021, 15:48:04 and half a second later.
        let cells = ["44291.6583796296", "44291.6583854167"];
        let times = read(&cells, 0.0);
        assert!((times[0] - 1_617_637_684_000_000_000).abs() < 10_000_000, "{times:?}");
        assert!((times[1] - times[0] - SEC / 2).abs() < 100_000, "{times:?}");
        let with_comma = cells.map(|cell| cell.replace('.', ","));
        assert_eq!(read(&with_comma.each_ref().map(String::as_str), 0.0), times);
        // Seconds since a device was switched on, half a day ago.
        let form = |cells: &[&str]| Clock::recognised("t", cells, 50.0).unwrap();
        assert_eq!(form(&["44291.004", "44291.008", "44291.012"]), Clock::of_unit(SEC));
        assert_eq!(Clock::named("excel").unwrap().read("25569.5"), Ok(Some(43_200 * SEC)));
        assert_eq!(Clock::named("mm:ss").unwrap().read("1:02"), Ok(Some(62 * SEC)));
        assert_eq!(Clock::named("parsec"), None);
    }

    #[test]
    fn midnight_is_not_a_step_back() {
        let times = read(&["23:59:59.9", "00:00:00.1"], 1.0);
        assert_eq!(times[1] - times[0], SEC / 5);
    }

    #[test]
    fn other_cells_are_not_taken_as_times() {
        for cells in [&["a", "b"][..], &[], &["1", "x"]] {
            assert_eq!(Clock::recognised("t", cells, 1.0), None, "{cells:?}");
        }
    }
}
