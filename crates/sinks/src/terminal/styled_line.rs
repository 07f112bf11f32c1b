//! Lines of the screen, made of styled pieces of text.

use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// The style of a piece of a line. Colour only repeats what the text says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Style {
    /// The terminal's default.
    #[default]
    Plain,
    /// For what should be noticed first.
    Strong,
    /// For old or minor information.
    Grey,
    /// For something that is not as it should be.
    Warning,
    /// For something that needs somebody now.
    Alarm,
    /// For a question to the user.
    Question,
}

impl Style {
    /// The sequence that starts the style; without colours, it is bold, reversed or empty.
    fn begin(self, colours: Colours) -> &'static str {
        match (self, colours) {
            (Style::Plain, _) | (Style::Grey | Style::Warning, Colours::None) => "",
            (Style::Strong, _) | (Style::Alarm, Colours::None) => "\x1b[1m",
            (Style::Grey, Colours::Some) => "\x1b[2m",
            (Style::Warning, Colours::Some) => "\x1b[33m",
            (Style::Alarm, Colours::Some) => "\x1b[1;31m",
            (Style::Question, _) => "\x1b[7m",
        }
    }
}

/// Whether a screen uses colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colours {
    /// Colours that repeat what the text says.
    #[default]
    Some,
    /// `NO_COLOR` is set.
    None,
}

/// A line of the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct StyledLine(Vec<(Style, String)>);

impl StyledLine {
    /// A line of one piece.
    pub fn of(style: Style, text: &str) -> StyledLine {
        StyledLine::default().with(style, text)
    }

    /// Appends a piece, without control characters.
    #[must_use]
    pub fn with(mut self, style: Style, text: &str) -> StyledLine {
        self.add(style, text);
        self
    }

    /// Appends another line.
    #[must_use]
    pub fn with_line(mut self, other: StyledLine) -> StyledLine {
        for (style, text) in other.0 {
            self.add(style, &text);
        }
        self
    }

    /// Adds a piece; see [`StyledLine::with`].
    pub fn add(&mut self, style: Style, text: &str) {
        let text = harmless(text);
        match self.0.last_mut() {
            Some((last, whole)) if *last == style => whole.push_str(&text),
            _ => self.0.push((style, text)),
        }
    }

    /// Pads the line to a column, or with two spaces if it is already longer.
    #[must_use]
    pub fn up_to(self, column: usize) -> StyledLine {
        let blanks = column.saturating_sub(self.width()).max(if self.0.is_empty() { 0 } else { 2 });
        self.with(Style::Plain, &" ".repeat(blanks))
    }

    /// Cuts or pads the line to an exact width.
    #[must_use]
    pub fn exactly(self, columns: usize) -> StyledLine {
        let cut = self.cut(columns);
        let blanks = " ".repeat(columns - cut.width());
        cut.with(Style::Plain, &blanks)
    }

    /// Adds another line at the right edge, if there is room.
    #[must_use]
    pub fn beside(mut self, right: &StyledLine, columns: usize) -> StyledLine {
        let room = columns.saturating_sub(self.width() + right.width());
        if room >= 2 && right.width() > 0 {
            self.add(Style::Plain, &" ".repeat(room));
            return self.with_line(right.clone());
        }
        self
    }

    /// The width in columns.
    pub fn width(&self) -> usize {
        self.0.iter().map(|(_, text)| text.width()).sum()
    }

    /// Cuts the line to a width, with an ellipsis if it is longer.
    #[must_use]
    pub fn cut(self, columns: usize) -> StyledLine {
        if self.width() <= columns {
            return self;
        }
        let mut left = columns.saturating_sub(1);
        let mut cut = StyledLine::default();
        for (style, text) in self.0 {
            let is_whole = text.width() <= left;
            let kept = first_columns(&text, left);
            left -= kept.width();
            cut.add(style, kept);
            if !is_whole {
                cut.add(style, "…");
                break;
            }
        }
        cut
    }

    /// The text alone, without trailing spaces.
    #[cfg(test)]
    pub fn text(&self) -> String {
        let text: String = self.0.iter().map(|(_, text)| text.as_str()).collect();
        text.trim_end().to_owned()
    }

    /// The text with escape sequences for its styles.
    pub fn sequences(&self, colours: Colours) -> String {
        let mut written = String::new();
        for (style, text) in &self.0 {
            let begin = style.begin(colours);
            written.push_str(begin);
            written.push_str(text);
            written.push_str(if begin.is_empty() { "" } else { "\x1b[0m" });
        }
        written
    }
}

/// The start of a text that fits into a number of columns.
pub(super) fn first_columns(text: &str, columns: usize) -> &str {
    let mut width = 0;
    let fits = |each: &(usize, char)| {
        width += each.1.width().unwrap_or(0);
        width > columns
    };
    text.char_indices().find(fits).map_or(text, |(end, _)| &text[..end])
}

/// Replaces control characters, and characters that change the direction of text, with spaces.
pub(super) fn harmless(text: &str) -> String {
    text.replace(commands, " ")
}

/// Whether a character controls the terminal, breaks a line, or changes the direction of text.
fn commands(each: char) -> bool {
    let turns = matches!(each, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}')
        || matches!(each, '\u{2066}'..='\u{2069}');
    each.is_control() || matches!(each, '\u{2028}' | '\u{2029}' | '\u{feff}') || turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_by_columns_and_says_so() {
        let line = StyledLine::of(Style::Strong, "robot1").with(Style::Plain, "  漢字漢字");
        assert_eq!(line.width(), 16);
        assert_eq!(line.clone().cut(16), line);
        assert_eq!(line.clone().cut(12).text(), "robot1  漢…");
        assert_eq!(line.cut(4).text(), "rob…");
    }

    #[test]
    fn without_colours_there_is_no_colour_and_the_same_text() {
        let line =
            StyledLine::of(Style::Alarm, "a").with(Style::Warning, "b").with(Style::Grey, "c");
        assert_eq!(line.sequences(Colours::None), "\x1b[1ma\x1b[0mbc");
        assert!(line.sequences(Colours::Some).contains("31m"));
    }

    #[test]
    fn no_text_commands_the_terminal() {
        let line = StyledLine::of(Style::Plain, "a\x1b[2J\u{202e}b\nc\u{9b}d\u{200f}");
        assert_eq!(line.text(), "a [2J b c d");
    }

    #[test]
    fn the_right_part_gives_way() {
        let left = StyledLine::of(Style::Plain, "left");
        let right = StyledLine::of(Style::Plain, "right");
        assert_eq!(left.clone().beside(&right, 12).text(), "left   right");
        assert_eq!(left.beside(&right, 10).text(), "left");
    }
}
