//! Annotations: `+onset[\x15duration]\x14text\x14…\x00`. The first annotation of a record has no text, and gives the
//! start of the record.

use crate::recording::{Mark, nanos};

/// The annotations of one record.
#[derive(Debug, Default)]
pub(super) struct Annotations {
    /// When the record starts [s].
    pub(super) start_secs: Option<f64>,
    pub(super) marks: Vec<Mark>,
}

/// Reads the annotations of a record; anything else is skipped.
pub(super) fn annotations(bytes: &[u8]) -> Annotations {
    let mut found = Annotations::default();
    for list in bytes.split(|byte| *byte == 0).filter(|list| !list.is_empty()) {
        let mut parts = list.split(|byte| *byte == 0x14);
        let mut times = parts.next().unwrap_or_default().split(|byte| *byte == 0x15).map(number);
        let Some((secs, at_ns)) = times.next().flatten() else { continue };
        let duration_ns = times.next().flatten().map_or(0, |(_, ns)| ns.max(0));
        let labels = parts.map(|text| String::from_utf8_lossy(text).trim().to_owned());
        let before = found.marks.len();
        let labels = labels.filter(|label| !label.is_empty());
        found.marks.extend(labels.map(|label| Mark { at_ns, duration_ns, label }));
        if found.marks.len() == before && found.start_secs.is_none() {
            found.start_secs = Some(secs);
        }
    }
    found
}

/// Parses a time; returns it in seconds and in nanoseconds.
fn number(text: &[u8]) -> Option<(f64, i64)> {
    let secs = std::str::from_utf8(text).ok()?.parse().ok()?;
    Some((secs, nanos(secs)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_list_without_a_text_is_the_start_of_the_record() {
        let found = annotations(b"+12.5\x14\x14\0+13.25\x150.5\x14tap\x14left\x14\0\0\0junk\0");
        assert_eq!(found.start_secs, Some(12.5));
        let mark =
            |label: &str| Mark { duration_ns: 500_000_000, ..Mark::new(13_250_000_000, label) };
        assert_eq!(found.marks, [mark("tap"), mark("left")]);
    }

    #[test]
    fn a_duration_that_is_none_is_zero() {
        for duration in ["", "\x15", "\x15x", "\x15-3", "\x15nan", "\x151e300"] {
            let found = annotations(format!("+1{duration}\x14tap\x14\0").as_bytes());
            assert_eq!(found.marks, [Mark::new(1_000_000_000, "tap")], "{duration:?}");
        }
    }
}
