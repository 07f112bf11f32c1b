//! The layout of the screen.

use super::board::{Board, clock_time};
use super::header::Recording;
use super::person::Detail;
use super::screen::Size;
use super::styled_line::{Style, StyledLine};
use super::view::View;

/// The number of rows from which on separators are drawn.
const ROOMY_ROWS: usize = 20;
/// The number of columns from which on the log is beside the team.
const WIDE_COLUMNS: usize = 130;
/// The minimum width of the team beside the log, and the width at which every row of a person fits [columns].
const TEAM_COLUMNS: (usize, usize) = (86, 100);

/// What a screen shows.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    /// The state of the session.
    pub board: &'a Board,
    /// The state of the recording.
    pub recording: &'a Recording,
    /// The scroll positions.
    pub view: &'a View,
    /// The open question.
    pub question: Option<&'a str>,
    /// The next phase.
    pub next: Option<&'a str>,
    /// Whether keys are read.
    pub has_keys: bool,
}

/// The whole screen, one line per row.
pub(super) fn draw(shown: Shown<'_>, size: Size) -> Vec<StyledLine> {
    let Size { columns, rows } = size;
    let mut lines = head(shown, columns);
    if rows >= ROOMY_ROWS {
        lines.push(rule("", columns));
    }
    let body = rows.saturating_sub(lines.len() + 1);
    if columns >= WIDE_COLUMNS {
        let (least, whole) = TEAM_COLUMNS;
        let left = (least + columns - WIDE_COLUMNS).min(whole);
        let right = columns - left - 3;
        let team = troubles_and_team(shown, body, rows);
        let log = log(shown, body, right);
        let blank = || std::iter::repeat(StyledLine::default());
        let pairs = team.into_iter().chain(blank()).zip(log.into_iter().chain(blank())).take(body);
        lines.extend(
            pairs.map(|(row, log)| row.exactly(left).with(Style::Grey, " │ ").with_line(log)),
        );
    } else {
        let least_log = if rows >= ROOMY_ROWS { 6 } else { 2 };
        let team = troubles_and_team(shown, body.saturating_sub(least_log), rows);
        let left = body - team.len();
        lines.extend(team);
        if rows >= ROOMY_ROWS && left > 0 {
            lines.push(rule("log", columns));
            lines.extend(log(shown, left - 1, columns));
        } else {
            lines.extend(log(shown, left, columns));
        }
    }
    lines.resize(rows - 1, StyledLine::default());
    lines.push(foot(shown, columns));
    lines.into_iter().map(|line| line.cut(columns)).collect()
}

/// The recording, the current phases, and which cameras and microphones are on.
fn head(shown: Shown<'_>, columns: usize) -> Vec<StyledLine> {
    let (now, elapsed_secs) = shown.board.now();
    let time = StyledLine::of(Style::Plain, &format!("{} UTC", clock_time(now)));
    let recording = shown.recording.line(elapsed_secs).beside(&time, columns);
    let phase = shown.board.phase(shown.next);
    let lines = [recording, phase.beside(&shown.board.attendance(), columns)];
    lines.into_iter().chain(shown.board.watching()).collect()
}

/// The troubles and then the team, in at most `most` rows.
fn troubles_and_team(shown: Shown<'_>, most: usize, rows: usize) -> Vec<StyledLine> {
    let mut lines = shown.board.troubles();
    let share = (if rows >= ROOMY_ROWS { most / 2 } else { most.div_ceil(2) }).max(1);
    if lines.len() > share {
        let hidden = lines.len() + 1 - share;
        lines.truncate(share - 1);
        lines.push(StyledLine::of(Style::Warning, &format!("▲ … and {hidden} more like these")));
    }
    if rows >= ROOMY_ROWS && !lines.is_empty() {
        lines.push(StyledLine::default());
    }
    lines.extend(window(
        shown,
        shown.board.team_lines(detail(rows)),
        most.saturating_sub(lines.len()),
    ));
    lines
}

/// The detail per person on a screen with this many rows.
fn detail(rows: usize) -> Detail {
    if rows >= ROOMY_ROWS { Detail::Whole } else { Detail::Brief }
}

/// The part of the team that fits, from the scroll position.
fn window(shown: Shown<'_>, team: Vec<StyledLine>, rows: usize) -> Vec<StyledLine> {
    if team.len() <= rows || rows < 2 {
        return team.into_iter().take(rows).collect();
    }
    let (all, fit) = (team.len(), rows - 1);
    let from = shown.view.team_from(all, fit);
    let (above, below) = (from, all - from - fit);
    let mut lines: Vec<StyledLine> = team.into_iter().skip(from).take(fit).collect();
    let more = match (above, below) {
        (0, below) => format!("… {below} more below ↓"),
        (above, 0) => format!("… {above} more above ↑"),
        (above, below) => format!("… {above} more above ↑, {below} below ↓"),
    };
    lines.push(StyledLine::of(Style::Grey, &more));
    lines
}

/// The newest lines of the log, or those at the scroll position, the newest last.
fn log(shown: Shown<'_>, rows: usize, columns: usize) -> Vec<StyledLine> {
    let log = shown.board.log();
    // When scrolled back, a row is reserved for the number of newer lines.
    let least = if log.len() > rows { rows.saturating_sub(1) } else { rows };
    let back = shown.view.log_back(log.len(), least);
    let rows = if back > 0 { least } else { rows };
    let end = log.len() - back;
    let from = end.saturating_sub(rows);
    let line = |line: &String| StyledLine::of(Style::Plain, line).cut(columns);
    let mut lines: Vec<StyledLine> = log.range(from..end).map(line).collect();
    if back > 0 {
        let more = format!("… {back} newer ↓");
        lines.push(StyledLine::of(Style::Grey, &more));
    }
    lines
}

/// The open question, or the explanation of the keys.
fn foot(shown: Shown<'_>, columns: usize) -> StyledLine {
    let long = " a–z space marker   ^N next ^R repeat ^X abort phase   ^P record   ↑↓ PgUp PgDn   ^A seen   q end";
    let short = "a–z marker  ^N next ^R repeat ^X abort  ↑↓ PgUp  q end";
    match shown.question {
        Some(question) => StyledLine::of(Style::Question, &format!(" {question} ")),
        None if !shown.has_keys => StyledLine::of(Style::Grey, "Ctrl-C ends"),
        None if columns >= long.chars().count() => StyledLine::of(Style::Grey, long),
        None => StyledLine::of(Style::Grey, short),
    }
}

/// A separator with a title.
fn rule(word: &str, columns: usize) -> StyledLine {
    let word = if word.is_empty() { String::new() } else { format!("── {word} ") };
    let rest = "─".repeat(columns.saturating_sub(word.chars().count()));
    StyledLine::of(Style::Grey, &format!("{word}{rest}"))
}

#[cfg(test)]
mod tests;
