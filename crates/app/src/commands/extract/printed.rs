//! Results of `extract` as text.

use teampulse_core::counted::counted;
use teampulse_core::text::on_one_line;
use teampulse_core::units;
use teampulse_signal::analysis::{Event, Measured, Span, Value};

use super::around::Around;
use super::report::{Score, secs};
use crate::output;

/// The columns of every table of events.
const EVENT: [&str; 3] = ["kind", "sample", "time_secs"];

/// The header of a table of events, from the first event.
#[derive(Default)]
pub struct Heading {
    names: Option<Vec<&'static str>>,
}

impl Heading {
    /// Prints the header if there was no event: only events show the columns of their details.
    pub fn end(&self) {
        if self.names.is_none() {
            output::line(EVENT.join(","));
        }
    }

    /// Prints an event as a line of comma-separated values; before the first one, the header.
    pub fn show(&mut self, event: &Event) {
        let names = self.names.get_or_insert_with(|| {
            let names: Vec<&str> = event.details.iter().map(|(name, _)| *name).collect();
            output::line([&EVENT, &names[..]].concat().join(","));
            names
        });
        let mut cells = vec![event.kind.to_owned(), event.sample.to_string()];
        cells.push(secs(event.at_ns).to_string());
        cells.extend(names.iter().map(|name| {
            let detail = event.details.iter().find(|(each, _)| each == name);
            let value = detail.map(|(_, value)| *value).filter(|value| value.is_finite());
            value.map_or_else(String::new, |value| value.to_string())
        }));
        output::line(cells.join(","));
    }
}

/// Prints a window with its values.
pub fn window(values: &[Value], span: Span, measured: &Measured) {
    output::line(format!(
        "{} to {} s   {:.0} % of the data   quality {:.2}",
        shown_secs(secs(span.begin_ns)),
        shown_secs(secs(span.end_ns)),
        100.0 * measured.coverage,
        measured.quality
    ));
    each(values, measured);
}

/// Prints the values around each event.
pub fn around(around: &Around) {
    for ((event_secs, measured), label) in around.events.iter().zip(&around.labels) {
        let label =
            if label.is_empty() { String::new() } else { format!(": {}", on_one_line(label)) };
        output::line(format!("event at {} s{label}", shown_secs(*event_secs)));
        each(&around.values, measured);
    }
}

fn each(values: &[Value], measured: &Measured) {
    output::lines(values.iter().zip(&measured.values).map(|(value, found)| {
        let text = match found {
            Ok(number) => format!("{:>12} {}", shown(*number), units::shown(&value.unit)),
            Err(reason) => format!("{:>12} {reason}", "-"),
        };
        format!("  {}{text}", padded(&value.name)).trim_end().to_owned()
    }));
}

/// Prints how each value was computed; what several recipes have in common is printed once.
pub fn recipes(values: &[Value], method: &str) {
    if values.is_empty() {
        return;
    }
    let mut groups: Vec<(&str, Vec<(&str, &str)>)> = Vec::new();
    for value in values {
        let (recipe, common) = value.method.split_once("; ").unwrap_or((&value.method, ""));
        // The recipe is the same for every channel of a value.
        let (name, _) = Value::parts(&value.name);
        match groups.iter_mut().find(|(each, _)| *each == common) {
            Some((_, recipes)) if recipes.contains(&(name, recipe)) => {}
            Some((_, recipes)) => recipes.push((name, recipe)),
            None => groups.push((common, vec![(name, recipe)])),
        }
    }
    output::line(format!("\nhow, {method}:"));
    for (common, recipes) in groups {
        output::lines(recipes.iter().map(|(name, recipe)| format!("  {}{recipe}", padded(name))));
        if !common.is_empty() {
            output::line(format!("      all of these: {common}"));
        }
    }
}

/// Pads the name of a value to the width of its column; a longer name is followed by a space, too.
fn padded(name: &str) -> String {
    format!("{name:<31} ")
}

/// Formats the number of events of each kind.
pub fn counts(counts: &[(&'static str, usize)]) -> String {
    let words = counts.iter().map(|(kind, count)| counted(*count, kind, &format!("{kind}s")));
    let words: Vec<String> = words.collect();
    if words.is_empty() { "0 events".to_owned() } else { words.join(", ") }
}

impl Score {
    /// Describes the agreement in words.
    pub fn shown(&self) -> String {
        let percent = |share: Option<f64>| {
            share.map_or("-".into(), |share| format!("{:.2} %", 100.0 * share))
        };
        format!(
            "within {:.0} ms of the truth: F1 {}, sensitivity {}, precision {} ({} found, {} missed, {} extra), median offset {} ms",
            self.tolerance_ms,
            percent(self.f1),
            percent(self.sensitivity),
            percent(self.precision),
            self.tp,
            self.missed,
            self.fp,
            self.median_offset_ms.map_or("-".into(), |offset| format!("{offset:.1}")),
        )
    }
}

/// Formats a time to the millisecond.
fn shown_secs(secs: f64) -> String {
    format!("{secs:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a number with six significant digits.
fn shown(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = 5 - value.abs().log10().floor() as i32;
    if !(0..=12).contains(&digits) {
        return format!("{value:.5e}");
    }
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_and_what_follows_it_are_apart() {
        assert_eq!(padded("RMSSD").len(), padded("RSP_Phase_Duration_Inspiration").len());
        assert!(padded(&"x".repeat(40)).ends_with("x "));
    }

    #[test]
    fn numbers_are_shown_with_six_digits() {
        let numbers = [0.0, 72.0, 72.123_456, -0.001_234_567, 123_456.7, 1e-20, 3e20];
        let expected = ["0", "72", "72.1235", "-0.00123457", "123457", "1.00000e-20", "3.00000e20"];
        assert_eq!(numbers.map(shown), expected);
    }
}
