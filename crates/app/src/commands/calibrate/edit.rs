//! Writes the latency of a device into a study; all else stays as it is.

use toml_edit::{DocumentMut, Item, Table, TableLike, value};

/// A latency as written in a study.
#[derive(Clone, Copy, Debug)]
pub(super) struct Latency {
    pub secs: f64,
    /// Half the width of the 95 % interval.
    pub uncertainty_secs: f64,
}

impl Latency {
    fn settings(&self) -> [(&'static str, f64); 2] {
        [("latency_secs", self.secs), ("uncertainty_secs", self.uncertainty_secs)]
    }
}

/// The lines of a study that set the latency of a device.
pub(super) fn lines(device: &str, latency: &Latency) -> String {
    with_latency("", device, latency).expect("an empty study takes a table").trim().to_owned()
}

/// The text of a study with `[clocks.<device>]`.
pub(super) fn with_latency(text: &str, device: &str, latency: &Latency) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    let clocks = document.entry("clocks").or_insert_with(|| Item::Table(unwritten()));
    let clocks = clocks.as_table_like_mut().ok_or("`clocks` is not a table")?;
    let begins = if text.is_empty() { "" } else { "\n" };
    let clock = clocks.entry(device).or_insert_with(|| Item::Table(beginning(begins)));
    let clock = clock.as_table_like_mut().ok_or(format!("`clocks.{device}` is not a table"))?;
    for (key, number) in latency.settings() {
        set(clock, key, number);
    }
    Ok(document.to_string())
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

    const LATENCY: Latency = Latency { secs: 0.0613, uncertainty_secs: 0.004 };

    fn edited(text: &str) -> String {
        with_latency(text, "polar_h10", &LATENCY).unwrap()
    }

    #[test]
    fn a_new_table_stands_behind_all_that_there_was() {
        let text = "# ours\n[session]\nname = \"a\"   # short\n\n[[sinks]]\ntype='bag'\n";
        let added = "\n[clocks.polar_h10]\nlatency_secs = 0.0613\nuncertainty_secs = 0.004\n";
        assert_eq!(edited(text), format!("{text}{added}"));
    }

    #[test]
    fn in_a_table_that_there_was_only_the_numbers_change() {
        let text = "[clocks.polar_h10]  # chest\nlatency_secs = 1e-2 # guessed\nwraps_secs = 512\n\n\
                    [clocks.myo]\nlatency_secs = 0.02\n[session]\nname = \"a\"\n";
        let expected = "[clocks.polar_h10]  # chest\nlatency_secs = 0.0613 # guessed\n\
                        wraps_secs = 512\nuncertainty_secs = 0.004\n\n\
                        [clocks.myo]\nlatency_secs = 0.02\n[session]\nname = \"a\"\n";
        assert_eq!(edited(text), expected);
    }

    #[test]
    fn tables_in_one_line_and_odd_names_are_edited_too() {
        let text = "clocks = { polar_h10 = { latency_secs = 1.0, uncertainty_secs = 1.0 } }\n";
        assert_eq!(
            edited(text),
            "clocks = { polar_h10 = { latency_secs = 0.0613, uncertainty_secs = 0.004 } }\n"
        );
        assert!(lines("my strap", &LATENCY).starts_with("[clocks.\"my strap\"]\n"));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert!(with_latency("clocks = 3\n", "a", &LATENCY).is_err());
        assert!(with_latency("[clocks]\na = 3\n", "a", &LATENCY).is_err());
        assert!(with_latency("[clocks\n", "a", &LATENCY).is_err());
    }

    proptest! {
        #[test]
        fn no_text_and_no_name_make_it_panic(text in ".*", device in ".*") {
            drop(with_latency(&text, &device, &LATENCY));
            drop(lines(&device, &LATENCY));
        }
    }
}
