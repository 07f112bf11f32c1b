//! The alternate screen, restored when the session ends.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::{process, termios};
use teampulse_core::text::on_one_line;

use super::styled_line::{Colours, StyledLine};

/// The size of a screen in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub columns: usize,
    pub rows: usize,
}

/// Output from elsewhere in the process while the screen is taken over; `None` otherwise.
static ASIDE: Mutex<Option<Vec<u8>>> = Mutex::new(None);

/// The maximum size of such output that is kept [bytes].
const MOST_ASIDE: usize = 1 << 20;

fn aside_of_screen() -> MutexGuard<'static, Option<Vec<u8>>> {
    ASIDE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Standard error for warnings. While the screen is taken over, warnings go to its log, as it would be drawn over them.
#[derive(Clone, Copy, Debug, Default)]
pub struct WarningOutput;

/// Removes control characters from output that may quote text from robots and files.
fn harmless(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<_> = text.split('\n').map(on_one_line).collect();
    lines.join("\n").into_bytes()
}

impl Write for WarningOutput {
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
    /// The last frame sent.
    sent: String,
}

impl Screen {
    /// Switches to the alternate screen.
    pub fn take_over() -> Screen {
        *aside_of_screen() = Some(Vec::new());
        // Bracketed paste keeps pasted text apart from keys.
        send("\x1b[?1049h\x1b[?25l\x1b[?2004h");
        Screen { sent: String::new() }
    }

    /// Draws lines, one per row.
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

    /// Takes the output from elsewhere since the last call.
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

/// Restores the screen if it was taken over, also before an immediate exit of the process.
pub fn leave_screen() {
    if aside_of_screen().take().is_some() {
        send("\x1b[?2004l\x1b[?25h\x1b[?1049l");
    }
}

/// Whether standard error is a terminal on which this job may draw, which it may not in the background, as when started
/// with `&`.
pub(super) fn is_ours() -> bool {
    let stderr = io::stderr();
    stderr.is_terminal()
        && termios::tcgetpgrp(&stderr).is_ok_and(|group| group == process::getpgrp())
}

/// The size of standard error's screen.
pub(super) fn size() -> Size {
    let size = termios::tcgetwinsize(io::stderr()).ok();
    let size = size.map(|size| (usize::from(size.ws_col), usize::from(size.ws_row)));
    let known = size.filter(|(columns, rows)| *columns > 0 && *rows > 0);
    let (columns, rows) = known.unwrap_or((80, 24));
    Size { columns: columns.clamp(20, 400), rows: rows.clamp(4, 200) }
}

/// Writes at once, ignoring errors: a closed terminal must not end the session.
fn send(text: &str) {
    let mut out = io::stderr().lock();
    if out.write_all(text.as_bytes()).is_ok() {
        drop(out.flush());
    }
}

/// The sequence that moves the cursor to a row and clears it.
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
