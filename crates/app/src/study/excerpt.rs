//! The excerpt of a study that is shown with an error.

use std::ops::Range;

use teampulse_core::text::is_unwanted;

/// The most characters of a line that are shown, and the most of them before the error.
const LONGEST_LINE: usize = 400;
const BEFORE: usize = 100;

/// Returns a study's text with lines that fit a terminal and without control characters, and the place of `span` in it.
pub(super) fn excerpt(text: &str, span: &Range<usize>) -> (String, Range<usize>) {
    let mut shown = Shown { text: String::new(), span, start: None, end: None };
    let mut begin = 0;
    for line in text.split_inclusive('\n') {
        shown.take(line, begin);
        begin += line.len();
    }
    let whole = shown.text.len();
    let start = shown.start.unwrap_or(whole);
    (shown.text, start..shown.end.unwrap_or(whole).max(start))
}

struct Shown<'a> {
    text: String,
    span: &'a Range<usize>,
    start: Option<usize>,
    end: Option<usize>,
}

impl Shown<'_> {
    /// Adds a line that starts at a byte of the study.
    fn take(&mut self, line: &str, begin: usize) {
        let body = line.strip_suffix('\n').unwrap_or(line);
        let wrong_at = self.span.start.saturating_sub(begin);
        let before = body.char_indices().take_while(|(at, _)| *at < wrong_at).count();
        let first = match body.chars().count() {
            count if count <= LONGEST_LINE || before >= count => 0,
            _ => before.saturating_sub(BEFORE),
        };
        if first > 0 {
            self.text.push('…');
        }
        for (number, (at, each)) in body.char_indices().enumerate().skip(first) {
            self.reach(begin + at);
            if number == first + LONGEST_LINE {
                self.text.push('…');
                break;
            }
            self.text.push(if is_unwanted(each) { ' ' } else { each });
        }
        if line.len() > body.len() {
            self.reach(begin + body.len());
            self.text.push('\n');
        }
    }

    /// Records where the span starts and ends in the shown text; `at` is the byte of the study that comes next.
    fn reach(&mut self, at: usize) {
        let here = self.text.len();
        if at >= self.span.start {
            self.start.get_or_insert(here);
        }
        if at >= self.span.end {
            self.end.get_or_insert(here);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_study_of_short_lines_stays_unchanged() {
        let text = "a = 1\n\nb = \"ä\"\n[c]";
        for span in [0..1, 3..5, 7..15, 0..text.len(), text.len()..text.len()] {
            assert_eq!(excerpt(text, &span), (text.to_owned(), span));
        }
    }

    #[test]
    fn the_error_in_a_long_line_is_shown() {
        let text =
            format!("a = 1\nb = \"{}\" wrong {}\nc = 2", "x".repeat(70_000), "y".repeat(70_000));
        let at = text.find("wrong").unwrap();
        let (shown, span) = excerpt(&text, &(at..at + 5));
        assert_eq!(&shown[span], "wrong");
        assert!(shown.lines().all(|line| line.chars().count() <= LONGEST_LINE + 2));
        assert!(shown.starts_with("a = 1\n…x") && shown.ends_with("y…\nc = 2"));
    }

    proptest! {
        #[test]
        fn any_place_in_any_text_is_in_what_is_shown(
            pieces in prop::collection::vec(
                (prop::sample::select(vec!["a", "ä", "\n", "\r\n", "\u{1b}[2J", "\u{202e}", "\t", " = "]), 1usize..900),
                0..8,
            ),
            (start, length) in (0usize..5000, 0usize..5000),
        ) {
            let text: String = pieces.iter().map(|(piece, times)| piece.repeat(*times)).collect();
            let start = start.min(text.len());
            let (shown, span) = excerpt(&text, &(start..(start + length).min(text.len())));
            prop_assert!(shown.get(span).is_some());
            prop_assert_eq!(shown.matches('\n').count(), text.matches('\n').count());
            prop_assert!(shown.lines().all(|line| line.chars().count() <= LONGEST_LINE + 2));
            prop_assert!(!shown.replace('\n', "").contains(is_unwanted));
        }
    }
}
