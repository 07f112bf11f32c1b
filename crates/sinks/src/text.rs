//! Sanitises texts from outside.

use std::borrow::Cow;

use teampulse_core::text;

/// The longest text that is displayed [characters].
const MOST_SHOWN: usize = 200;

/// Puts a text on one line, without tabs and control characters.
pub(crate) fn on_one_line(text: &str) -> String {
    text::on_one_line(text).into_owned()
}

/// Prevents spreadsheets from executing a text: anything that looks like a formula, except for numbers, is preceded by
/// an apostrophe, as OWASP recommends against CSV injection.
pub(crate) fn harmless(text: &str) -> Cow<'_, str> {
    let is_number = text.trim().parse().is_ok_and(f64::is_finite);
    if text.trim_start().starts_with(['=', '+', '-', '@']) && !is_number {
        Cow::Owned(format!("'{text}"))
    } else {
        Cow::Borrowed(text)
    }
}

/// Puts a text on one line, and truncates it to a readable length.
pub(crate) fn shown(text: &str) -> String {
    let mut shown = on_one_line(text);
    if let Some((end, _)) = shown.char_indices().nth(MOST_SHOWN) {
        shown.truncate(end);
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_begins_like_a_formula_is_a_text() {
        for text in ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", " =1"] {
            assert_eq!(harmless(text), format!("'{text}"));
        }
        for text in ["1-back = hard", "-46.00", "+1"] {
            assert_eq!(harmless(text), text);
        }
    }

    #[test]
    fn a_text_from_elsewhere_commands_no_terminal_and_ends() {
        assert_eq!(shown("\u{1b}[2Jred\nline\ttab\u{9b}5n"), " [2Jred line tab 5n");
        assert_eq!(shown(&"ä".repeat(20_000)).chars().count(), MOST_SHOWN + 1);
        assert_eq!(shown("plain"), "plain");
    }
}
