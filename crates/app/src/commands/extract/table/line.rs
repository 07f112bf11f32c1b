//! Lines of a table: cells and numbers.

use super::dates::is_date;

/// The separator of the cells of a line.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Separator {
    /// One character.
    Mark(char),
    /// Any number of spaces.
    Spaces,
    /// Commas that are also the decimal separator: every second comma separates cells.
    SecondComma,
}

impl Separator {
    /// The separator that a line seems to use.
    pub fn of(line: &str) -> Separator {
        let marks = ['\t', ';', '|', ','];
        let is_one = |mark: &char| match mark {
            '|' => is_piped(line),
            mark => line.contains(*mark),
        };
        marks.into_iter().find(is_one).map_or(Separator::Spaces, Separator::Mark)
    }

    /// The number of cells in a line, without empty ones at its end. With [`Separator::SecondComma`], every comma
    /// counts.
    pub fn width(self, line: &str) -> usize {
        let all = if self == Separator::SecondComma { Separator::Mark(',') } else { self };
        let filled = all.cells(line).enumerate().filter(|(_, cell)| !cell.is_empty());
        filled.last().map_or(0, |(place, _)| place + 1)
    }

    /// The cells of a line, without the spaces and quotes around them.
    pub fn cells(self, line: &str) -> Cells<'_> {
        Cells { separator: self, rest: Some(line.trim_matches(' ')) }
    }
}

/// Whether bars separate the cells of a line: it contains some, and each cell with a comma is a number or a date.
fn is_piped(line: &str) -> bool {
    let is_plain = |cell: &str| !cell.contains(',') || number(cell).is_some() || is_date(cell);
    line.contains('|') && Separator::Mark('|').cells(line).all(is_plain)
}

/// The cells of a line, from left to right.
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    separator: Separator,
    rest: Option<&'a str>,
}

impl<'a> Iterator for Cells<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest?;
        let mark = match self.separator {
            Separator::Mark(mark) => mark,
            Separator::Spaces => {
                let (cell, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                self.rest = Some(after.trim_start()).filter(|after| !after.is_empty());
                return Some(cell.trim_matches('"'));
            }
            Separator::SecondComma => {
                let second = rest.match_indices(',').nth(1).map(|(at, _)| at);
                self.rest = second.map(|at| &rest[at + 1..]);
                return Some(second.map_or(rest, |at| &rest[..at]).trim());
            }
        };
        let spaces = |c: char| c == ' ' || (c == '\t' && mark != '\t');
        let quoted = rest.trim_start_matches(spaces).strip_prefix('"');
        let (cell, after) = match quoted.and_then(|quoted| quoted.split_once('"')) {
            Some((cell, after)) => (cell, after.split_once(mark).map(|(_, after)| after)),
            None => match rest.split_once(mark) {
                Some((cell, after)) => (cell, Some(after)),
                None => (rest, None),
            },
        };
        self.rest = after;
        Some(cell.trim_matches(spaces))
    }
}

/// Parses the number in a cell: NaN for a cell marked as missing, `None` for text. A comma in a cell is decimal: where
/// commas separate cells, the cell was quoted.
pub fn number(cell: &str) -> Option<f64> {
    // The last ones are error values of spreadsheets.
    const NONE: [&str; 12] = [
        "", "na", "n/a", "null", "none", "-", "?", "#n/a", "#div/0!", "#value!", "#num!", "#null!",
    ];
    if let Ok(number) = cell.parse::<f64>() {
        return Some(if number.is_finite() { number } else { f64::NAN });
    }
    if NONE.contains(&cell.to_ascii_lowercase().as_str()) {
        return Some(f64::NAN);
    }
    let has_decimal_comma = cell.matches(',').count() == 1 && !cell.contains('.');
    has_decimal_comma.then(|| cell.replace(',', ".").parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str) -> Vec<&str> {
        Separator::of(line).cells(line).collect()
    }

    #[test]
    fn cells_are_separated_by_commas_semicolons_tabs_or_spaces() {
        assert_eq!(cells("1, 2,,3"), ["1", "2", "", "3"]);
        assert_eq!(cells("1,5;2"), ["1,5", "2"]);
        assert_eq!(cells("a b\t\tc"), ["a b", "", "c"]);
        assert_eq!(cells("  1   2 3 "), ["1", "2", "3"]);
        assert_eq!(cells("\"a, b\",\"c\""), ["a, b", "c"]);
        assert_eq!(cells("\"open, 1"), ["\"open", "1"]);
    }

    #[test]
    fn bars_separate_unless_commas_do() {
        assert_eq!(cells("time | ecg"), ["time", "ecg"]);
        assert_eq!(cells("| 0,5 | 1,2 |"), ["", "0,5", "1,2", ""]);
        assert_eq!(cells("05.04.2021, 15:48:04|1"), ["05.04.2021, 15:48:04", "1"]);
        assert_eq!(cells("time,ecg|raw"), ["time", "ecg|raw"]);
        assert_eq!(cells("a|b;c"), ["a|b", "c"]);
    }

    #[test]
    fn every_second_comma_may_separate() {
        let cells: Vec<&str> = Separator::SecondComma.cells("0,01,-33,5,7").collect();
        assert_eq!(cells, ["0,01", "-33,5", "7"]);
    }

    #[test]
    fn a_mark_of_a_missing_value_is_not_a_number() {
        for cell in ["", "NaN", "NA", "inf", "-inf", "null", "1e999", "#N/A", "#DIV/0!"] {
            assert!(number(cell).is_some_and(f64::is_nan), "{cell}");
        }
        assert_eq!(number("abc"), None);
    }

    #[test]
    fn a_comma_in_a_cell_is_a_decimal_one() {
        assert_eq!(number("1,5"), Some(1.5));
        assert_eq!(number("1,5e-3"), Some(1.5e-3));
        assert_eq!(number("1,500,000"), None);
        assert_eq!(number("1,500.5"), None);
    }
}
