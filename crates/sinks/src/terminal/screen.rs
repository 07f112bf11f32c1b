//! The screen: taken over while a session runs, and given back as it was.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::{process, termios};
use teampulse_core::text::on_one_line;

use super::styled_line::{Colours, StyledLine};

/// How large a screen is, in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub columns: usize,
    pub rows: usize,
}

/// What others say meanwhile; `None` while no screen is taken over.
static ASIDE: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// More than this of what others say is not kept [bytes].
const MOST_ASIDE: usize = 1 << 20;

fn aside_of_screen() -> MutexGuard<'static, Option<Vec<u8>>> {
    ASIDE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Standard error for warnings: while the screen is taken over they are kept for its log, where they
/// would be drawn over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aside;

/// Lines of others, in which nothing commands a terminal: they name what came from robots and files.
fn harmless(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<_> = text.split('\n').map(on_one_line).collect();
    lines.join("\n").into_bytes()
}

impl Write for Aside {
    fn write(&mut self, written: &[u8]) -> io::Result<usize> {
        let bytes = &harmless(written)[..];
        match aside_of_screen().as_mut() {
            Some(kept) => {
                let room = MOST_ASIDE.saturating_sub(kept.len());
                kept.extend(bytes.iter().take(room));
            }
            None => io::stderr().write_all(bytes)?,
        }
        Ok(written.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// The screen of standard error, taken over until this is dropped.
#[derive(Debug)]
pub(super) struct Screen {
    /// What is sent in one go.
    sent: String,
}

impl Screen {
    /// Takes the screen over: what stood there comes back later.
    pub fn take_over() -> Screen {
        *aside_of_screen() = Some(Vec::new());
        // Pasted text comes marked as such: it is no key.
        send("\x1b[?1049h\x1b[?25l\x1b[?2004h");
        Screen { sent: String::new() }
    }

    /// Draws its lines, one a row.
    pub fn draw(&mut self, lines: &[StyledLine], colours: Colours) {
        let all = &mut self.sent;
        all.clear();
        for (row, line) in lines.iter().enumerate() {
            let row = row + 1;
            all.push_str(&format_row(row));
            all.push_str(&line.sequences(colours));
        }
        all.push_str("\x1b[J");
        send(all);
    }

    /// What others said since this was last asked.
    pub fn take_aside() -> Vec<String> {
        let mut aside = aside_of_screen();
        let kept = aside.as_mut().map(std::mem::take).unwrap_or_default();
        String::from_utf8_lossy(&kept).lines().map(str::to_owned).collect()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        leave_screen();
    }
}

/// Gives the screen back as it was, if it is taken over: also for who ends the process at once.
pub fn leave_screen() {
    if aside_of_screen().take().is_some() {
        send("\x1b[?2004l\x1b[?25h\x1b[?1049l");
    }
}

/// Whether standard error is a terminal that may be drawn on: not while it is another job's, as when
/// this one was started with `&`.
pub(super) fn is_ours() -> bool {
    let stderr = io::stderr();
    stderr.is_terminal()
        && termios::tcgetpgrp(&stderr).is_ok_and(|group| group == process::getpgrp())
}

/// How large the screen of standard error is.
pub(super) fn size() -> Size {
    let size = termios::tcgetwinsize(io::stderr()).ok();
    let size = size.map(|size| (usize::from(size.ws_col), usize::from(size.ws_row)));
    let known = size.filter(|(columns, rows)| *columns > 0 && *rows > 0);
    let (columns, rows) = known.unwrap_or((80, 24));
    Size { columns: columns.clamp(20, 400), rows: rows.clamp(4, 200) }
}

/// Writes at once; that nobody sees it is no failure of the session.
fn send(text: &str) {
    let mut out = io::stderr().lock();
    if out.write_all(text.as_bytes()).is_ok() {
        drop(out.flush());
    }
}

/// The sequence that empties a row and begins to write there.
fn format_row(row: usize) -> String {
    format!("\x1b[{row};1H\x1b[2K")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_others_say_commands_no_terminal() {
        let said = "WARN \u{1b}[2J/evil\u{202e}\u{9b}5n\r\nWARN µS\n";
        assert_eq!(harmless(said.as_bytes()), "WARN  [2J/evil  5n \nWARN µS\n".as_bytes());
        assert_eq!(harmless(b"\xff\x1b"), "\u{fffd} ".as_bytes());
    }
}
