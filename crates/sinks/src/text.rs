//! Texts from elsewhere, made harmless for a line of ours.

/// The most characters of one text that are shown to people.
const MOST_SHOWN: usize = 200;

/// A text on one line, without tabs and without what would command a terminal.
pub(crate) fn on_one_line(text: &str) -> String {
    let is_break = |each: char| each.is_control() || ['\u{2028}', '\u{2029}'].contains(&each);
    text.replace(is_break, " ")
}

/// The same, cut where it is too long to be read.
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
    fn a_text_from_elsewhere_commands_no_terminal_and_ends() {
        assert_eq!(shown("\u{1b}[2Jred\nline\ttab\u{9b}5n"), " [2Jred line tab 5n");
        assert_eq!(shown(&"ä".repeat(20_000)).chars().count(), MOST_SHOWN + 1);
        assert_eq!(shown("plain"), "plain");
    }
}
