//! Writes the latency of a device into a study and leaves the rest unchanged.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value, value};

/// The tolerance within which two intervals are equal [s]: they are whole multiples of 1.25 ms.
const SAME_INTERVAL_SECS: f64 = 0.000_6;

/// A latency as written in a study.
#[derive(Clone, Copy, Debug)]
pub(super) struct Latency {
    pub secs: f64,
    /// Half the width of the 95 % interval.
    pub uncertainty_secs: f64,
    /// The connection interval of the links with this latency; `None` if no interval was recognised.
    pub interval_secs: Option<f64>,
}

impl Latency {
    fn settings(&self) -> [(&'static str, f64); 2] {
        [("latency_secs", self.secs), ("uncertainty_secs", self.uncertainty_secs)]
    }
}

/// Returns the lines of a study that set the latency of a device.
pub(super) fn lines(device: &str, latency: &Latency) -> String {
    with_latency("", device, latency).expect("an empty study takes a table").trim().to_owned()
}

/// Returns the text of a study with the latency in `[clocks.<device>]`.
pub(super) fn with_latency(text: &str, device: &str, latency: &Latency) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    let clocks = document.entry("clocks").or_insert_with(|| Item::Table(unwritten()));
    let clocks = clocks.as_table_like_mut().ok_or("`clocks` is not a table")?;
    let begins = if text.is_empty() { "" } else { "\n" };
    let clock = clocks.entry(device).or_insert_with(|| Item::Table(beginning(begins)));
    let clock = clock.as_table_like_mut().ok_or(format!("`clocks.{device}` is not a table"))?;
    if let Some(interval_secs) = latency.interval_secs {
        let interval = interval_in(clock, interval_secs)
            .ok_or(format!("`clocks.{device}.intervals` is not an array of tables"))?;
        set(interval, "interval_secs", interval_secs);
        for (key, number) in latency.settings() {
            set(interval, key, number);
        }
    }
    // The latency at one interval is also the best estimate for other intervals.
    if latency.interval_secs.is_none() || !clock.contains_key("latency_secs") {
        for (key, number) in latency.settings() {
            set(clock, key, number);
        }
    }
    Ok(document.to_string())
}

/// Finds the table of a connection interval among a clock's `intervals`, or adds one.
fn interval_in(clock: &mut dyn TableLike, interval_secs: f64) -> Option<&mut dyn TableLike> {
    if !clock.contains_key("intervals") {
        clock.insert("intervals", value(Array::new()));
    }
    let is_it = |table: &dyn TableLike| {
        let old = table.get("interval_secs").and_then(Item::as_float);
        old.is_some_and(|old| (old - interval_secs).abs() < SAME_INTERVAL_SECS)
    };
    match clock.get_mut("intervals")? {
        Item::ArrayOfTables(tables) => {
            let place = tables.iter().position(|table| is_it(table));
            let place = place.unwrap_or_else(|| {
                tables.push(Table::new());
                tables.len() - 1
            });
            tables.get_mut(place).map(|table| table as &mut dyn TableLike)
        }
        item => {
            let tables = item.as_array_mut()?;
            let known =
                tables.iter().position(|old| old.as_inline_table().is_some_and(|old| is_it(old)));
            let place = known.unwrap_or_else(|| {
                tables.push(InlineTable::new());
                tables.len() - 1
            });
            let table = tables.get_mut(place).and_then(Value::as_inline_table_mut)?;
            Some(table as &mut dyn TableLike)
        }
    }
}

/// Sets a number and keeps the comments around the old one.
fn set(table: &mut dyn TableLike, key: &str, number: f64) {
    let mut new = value(number);
    let old = table.get(key).and_then(Item::as_value);
    if let (Some(old), Some(new)) = (old, new.as_value_mut()) {
        *new.decor_mut() = old.decor().clone();
    }
    match table.get_mut(key) {
        Some(item) => *item = new,
        None => drop(table.insert(key, new)),
    }
}

/// A table that exists only for its subtables.
fn unwritten() -> Table {
    let mut table = Table::new();
    table.set_implicit(true);
    table
}

fn beginning(before: &str) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix(before);
    table
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LATENCY: Latency = Latency { secs: 0.0613, uncertainty_secs: 0.004, interval_secs: None };
    const OVER_30_MS: Latency = Latency { interval_secs: Some(0.03), ..LATENCY };

    fn edited(text: &str) -> String {
        with_latency(text, "polar_h10", &LATENCY).unwrap()
    }

    #[test]
    fn a_new_table_is_appended() {
        let text = "# ours\n[session]\nname = \"a\"   # short\n\n[[sinks]]\ntype='bag'\n";
        let added = "\n[clocks.polar_h10]\nlatency_secs = 0.0613\nuncertainty_secs = 0.004\n";
        assert_eq!(edited(text), format!("{text}{added}"));
    }

    #[test]
    fn in_an_existing_table_only_the_numbers_change() {
        let text = "[clocks.polar_h10]  # chest\nlatency_secs = 1e-2 # guessed\nwraps_secs = 512\n\n\
                    [clocks.myo]\nlatency_secs = 0.02\n[session]\nname = \"a\"\n";
        let expected = "[clocks.polar_h10]  # chest\nlatency_secs = 0.0613 # guessed\n\
                        wraps_secs = 512\nuncertainty_secs = 0.004\n\n\
                        [clocks.myo]\nlatency_secs = 0.02\n[session]\nname = \"a\"\n";
        assert_eq!(edited(text), expected);
    }

    #[test]
    fn inline_tables_and_odd_names_are_edited_too() {
        let text = "clocks = { polar_h10 = { latency_secs = 1.0, uncertainty_secs = 1.0 } }\n";
        assert_eq!(
            edited(text),
            "clocks = { polar_h10 = { latency_secs = 0.0613, uncertainty_secs = 0.004 } }\n"
        );
        assert!(lines("my strap", &LATENCY).starts_with("[clocks.\"my strap\"]\n"));
    }

    #[test]
    fn the_latency_of_a_connection_interval_is_added_to_those_of_others() {
        let text = "[clocks.myo]\nlatency_secs = 0.05\n";
        let first = with_latency(text, "myo", &OVER_30_MS).unwrap();
        let expected = "[clocks.myo]\nlatency_secs = 0.05\nintervals = [{ interval_secs = 0.03, \
                        latency_secs = 0.0613, uncertainty_secs = 0.004 }]\n";
        assert_eq!(first, expected);
        let other = Latency { secs: 0.05, interval_secs: Some(0.015), ..LATENCY };
        let both = with_latency(&first, "myo", &other).unwrap();
        assert_eq!(both.matches("interval_secs").count(), 2);
        let again = Latency { secs: 0.07, ..OVER_30_MS };
        let again = with_latency(&both, "myo", &again).unwrap();
        assert_eq!(again, both.replace("0.0613", "0.07"));
    }

    #[test]
    fn tables_of_intervals_are_edited_too() {
        let text = "[clocks.myo]\nlatency_secs = 0.05\n\n[[clocks.myo.intervals]]\n\
                    interval_secs = 0.03 # phone\nlatency_secs = 0.04\nuncertainty_secs = 0.01\n";
        let edited = with_latency(text, "myo", &OVER_30_MS).unwrap();
        assert_eq!(edited, text.replace("0.04", "0.0613").replace("0.01", "0.004"));
        assert!(with_latency("[clocks.myo]\nintervals = 3\n", "myo", &OVER_30_MS).is_err());
    }

    #[test]
    fn the_first_latency_of_an_interval_is_also_the_device_s() {
        let text = lines("myo", &OVER_30_MS);
        assert!(
            text.contains("\nlatency_secs = 0.0613\n") && text.contains("interval_secs = 0.03")
        );
    }

    #[test]
    fn anything_but_a_table_is_refused() {
        assert!(with_latency("clocks = 3\n", "a", &LATENCY).is_err());
        assert!(with_latency("[clocks]\na = 3\n", "a", &LATENCY).is_err());
        assert!(with_latency("[clocks\n", "a", &LATENCY).is_err());
    }

    proptest! {
        #[test]
        fn no_text_and_no_name_make_it_panic(text in ".*", device in ".*") {
            drop(with_latency(&text, &device, &LATENCY));
            drop(with_latency(&text, &device, &OVER_30_MS));
            drop(lines(&device, &LATENCY));
        }
    }
}
