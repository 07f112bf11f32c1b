//! Annotations: `+onset[\x15duration]\x14text\x14…\x00`, of which the first of a record has no text and is the
//! record's start.

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
        let onset = parts.next().and_then(|onset| onset.split(|byte| *byte == 0x15).next());
        let onset = onset.and_then(|onset| std::str::from_utf8(onset).ok()?.parse::<f64>().ok());
        let Some((at_ns, secs)) = onset.and_then(|secs| Some((nanos(secs)?, secs))) else {
            continue;
        };
        let labels = parts.map(|text| String::from_utf8_lossy(text).trim().to_owned());
        let before = found.marks.len();
        let labels = labels.filter(|label| !label.is_empty());
        found.marks.extend(labels.map(|label| Mark { at_ns, label }));
        if found.marks.len() == before && found.start_secs.is_none() {
            found.start_secs = Some(secs);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_list_without_a_text_is_the_start_of_the_record() {
        let found = annotations(b"+12.5\x14\x14\0+13.25\x150.5\x14tap\x14left\x14\0\0\0junk\0");
        assert_eq!(found.start_secs, Some(12.5));
        let marks: Vec<_> = found.marks.iter().map(|mark| (mark.at_ns, &*mark.label)).collect();
        assert_eq!(marks, [(13_250_000_000, "tap"), (13_250_000_000, "left")]);
    }
}
