//! Self-reports: what people say of their own workload, published as events, and parsed again.

use std::ops::RangeInclusive;

use crate::data::{Event, EventKind};

/// What a report of the Instantaneous Self-Assessment is labelled.
const ISA: &str = "isa";
/// Its scale, from idle to too much to do.
pub const SCALE: RangeInclusive<f64> = 1.0..=5.0;

/// Whom a report on the session's events names, if it is one of ISA: `p001` in `isa p001`, nobody
/// (empty) in `isa`.
pub fn named(event: &Event) -> Option<&str> {
    let mut words = event.label.split_whitespace();
    let is_isa = words.next()?.eq_ignore_ascii_case(ISA);
    (event.kind == EventKind::Report && is_isa).then(|| words.next().unwrap_or(""))
}

/// Whether it is a report that stands nowhere on its scale: nobody can use it.
pub fn is_off_scale(event: &Event) -> bool {
    named(event).is_some() && !SCALE.contains(&event.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_names_somebody_and_stands_on_its_scale_or_not() {
        let report = |label: &str, value| {
            let (kind, label) = (EventKind::Report, label.to_owned());
            Event { kind, label, value, duration_secs: 0.0 }
        };
        assert_eq!(named(&report("ISA p001", 3.0)), Some("p001"));
        assert_eq!(named(&report("isa", 3.0)), Some(""));
        assert_eq!(named(&report("tlx", 3.0)), None);
        assert_eq!(
            [0.0, 1.0, 5.0, 7.0, f64::NAN].map(|isa| is_off_scale(&report("isa", isa))),
            [true, false, false, true, true]
        );
        assert!(!is_off_scale(&report("tlx", 80.0)));
    }
}
