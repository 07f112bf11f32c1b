//! What commas in a table mean: decimal separators, or separators of cells.

use clap::ValueEnum;

use super::error::TableError;
use super::line::{Separator, number};
use super::line_reader::TextLine;

/// The decimal separator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Decimal {
    /// 33.4
    Point,
    /// 33,4
    Comma,
}

/// Returns the separator of lines of numbers below `names` names (0 for none); `takes_one` is set if one column is
/// wanted and none is named.
///
/// Only commas are ambiguous. They are decimal between numbers that are separated by spaces, below a single name, or
/// where lines have at most one of them, as in `-0,05` and `33,07`; they separate cells where there are decimal points.
pub fn separator(
    lines: &[TextLine],
    names: usize,
    takes_one: bool,
    decimal: Option<Decimal>,
) -> Result<Separator, TableError> {
    let Some(first) = lines.first() else { return Ok(Separator::Spaces) };
    let usual = Separator::of(&first.text);
    if usual != Separator::Mark(',') || decimal == Some(Decimal::Point) {
        return Ok(usual);
    }
    let texts = || lines.iter().map(|line| line.text.trim());
    if texts().all(is_decimals_between_spaces) {
        return Ok(Separator::Spaces);
    }
    if names > 1 && texts().all(|line| is_pairs(line, names)) {
        return Ok(Separator::SecondComma);
    }
    let is_ragged = |line: &&TextLine| {
        (names + 1..=2 * names).contains(&usual.width(&line.text)) && is_digits(line.text.trim())
    };
    if names > 1
        && let Some(line) = lines.iter().find(is_ragged)
    {
        let (line, cells) = (line.number, usual.width(&line.text));
        return Err(TableError::Ragged { line, cells, names });
    }
    // Text cells, points, signs and spaces after a comma, and two commas in a line, show that it separates cells.
    let Some(parts) = texts().map(halves).collect::<Option<Vec<_>>>() else { return Ok(usual) };
    let is_one = match (decimal, names) {
        (Some(Decimal::Comma), _) | (_, 1) => true,
        (_, 2..) => false,
        _ => match evidence(&parts) {
            Some(is_one) => is_one,
            None if !takes_one => false,
            None => {
                let (line, text) = (first.number, first.text.chars().take(40).collect());
                return Err(TableError::WhichComma { line, text });
            }
        },
    };
    Ok(if is_one { Separator::Spaces } else { usual })
}

/// Whether a line consists of several numbers with decimal commas, separated by spaces.
fn is_decimals_between_spaces(line: &str) -> bool {
    let is_number = |cell: &str| {
        let bare = cell.trim_start_matches(['-', '+']);
        bare.starts_with(|c: char| c.is_ascii_digit())
            && bare.ends_with(|c: char| c.is_ascii_digit())
            && number(cell).is_some()
    };
    line.split_whitespace().count() > 1 && line.split_whitespace().all(is_number)
}

/// Whether every cell between the commas of a line is a run of digits.
fn is_digits(line: &str) -> bool {
    line.split(',').all(|cell| {
        let bare = cell.trim_start_matches('-');
        !bare.is_empty() && bare.bytes().all(|byte| byte.is_ascii_digit())
    })
}

/// Whether a line has two runs of digits for each name.
fn is_pairs(line: &str, names: usize) -> bool {
    let is_digits = |cell: &str| !cell.is_empty() && cell.bytes().all(|byte| byte.is_ascii_digit());
    let mut cells = line.split(',').enumerate();
    line.split(',').count() == 2 * names
        && cells.all(|(place, cell)| {
            is_digits(if place % 2 == 0 { cell.trim_start_matches('-') } else { cell })
        })
}

/// Splits a line at its only comma; a line without a comma stays whole. Returns `None` if the line is not a number with
/// a decimal comma.
fn halves(line: &str) -> Option<(&str, Option<&str>)> {
    let line = line.trim_matches('"');
    let (whole, part) = line.split_once(',').map_or((line, None), |(one, two)| (one, Some(two)));
    let bare = whole.trim_start_matches(['-', '+']);
    let is_whole = !bare.is_empty() && bare.bytes().all(|byte| byte.is_ascii_digit());
    let is_part = part.is_none_or(|part| {
        let digits = part.split(['e', 'E']).next().unwrap_or_default();
        !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
    });
    (is_whole && is_part && number(line).is_some()).then_some((whole, part))
}

/// Whether each of these lines is one number; `None` if each may also be two integers.
fn evidence(parts: &[(&str, Option<&str>)]) -> Option<bool> {
    let decimals = || parts.iter().filter_map(|(_, part)| *part);
    let is_certain = parts.iter().any(|(whole, part)| part.is_none() || *whole == "-0")
        || decimals()
            .any(|part| part.len() > 1 && part.starts_with('0') || part.contains(['e', 'E']));
    if is_certain {
        return Some(true);
    }
    // A column that counts up: row numbers, or times.
    let counts: Vec<i64> = parts.iter().filter_map(|(whole, _)| whole.parse().ok()).collect();
    let is_counting = counts.len() > 2 && counts.windows(2).all(|pair| pair[1] > pair[0]);
    let length = decimals().next().map_or(0, str::len);
    if is_counting {
        return Some(false);
    }
    (length > 2 && decimals().all(|part| part.len() == length)).then_some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, names: usize) -> Option<Separator> {
        let lines = text.lines().enumerate();
        let line = |(number, text): (usize, &str)| TextLine { number, text: text.to_owned() };
        separator(&lines.map(line).collect::<Vec<_>>(), names, true, None).ok()
    }

    #[test]
    fn commas_are_decimal_where_they_can_not_separate() {
        for one in [
            "0,00 33,40\n0,25 33,41",
            "0,512\n-0,113\n-1,020",
            "33,07\n33,1",
            "33,4\n33\n33,6",
            "5,12\n5,2e-1",
            "-0,5\n1,5",
        ] {
            assert_eq!(of(one, 0), Some(Separator::Spaces), "{one}");
        }
        assert_eq!(of("33,4\n33,5", 1), Some(Separator::Spaces));
        assert_eq!(of("0,00,33,4\n0,25,33,5", 2), Some(Separator::SecondComma));
        assert_eq!(of("0,5;1\n", 0), Some(Separator::Mark(';')));
    }

    #[test]
    fn commas_separate_where_they_can_not_be_decimal() {
        for several in [
            "1.5,2\n1.6,3",
            "1, 2\n3, 4",
            "-1,65,5\n-1,65,4",
            "1,-2\n3,4",
            "0,512\n1,514\n2,498",
            "2021-04-05,1",
            ",5\n1,6",
        ] {
            assert_eq!(of(several, 0), Some(Separator::Mark(',')), "{several}");
        }
        assert_eq!(of("33,07\n33,1", 2), Some(Separator::Mark(',')));
    }

    #[test]
    fn an_ambiguous_comma_is_an_error() {
        assert_eq!(of("12,65\n13,64\n12,7", 0), None);
        let line = TextLine { number: 1, text: "12,65".to_owned() };
        let chosen = |decimal| separator(std::slice::from_ref(&line), 0, true, Some(decimal));
        assert_eq!(chosen(Decimal::Comma).ok(), Some(Separator::Spaces));
        assert_eq!(chosen(Decimal::Point).ok(), Some(Separator::Mark(',')));
    }
}
