//! The terminal: one line for each robot and stream while running, and a summary at the end.

mod board;
mod robot;
mod team;
mod happening;

use std::io::{IsTerminal, Write};
use std::time::Duration;

use rustix::termios;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{Shape, Stream};

pub use board::Board;

/// How long to wait for something new before looking again.
const PATIENCE: Duration = Duration::from_millis(200);

/// Shows the state of the team on standard error: redrawn each second on a screen; elsewhere a line
/// whenever a state changes.
#[derive(Debug, Default)]
pub struct Terminal {
    board: Board,
    drawn: usize,
}

impl Sink for Terminal {
    fn name(&self) -> &'static str {
        "terminal"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        Wants::Only(Box::new(is_shown))
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let screen = std::io::stderr().is_terminal();
        loop {
            match inbox.receive(PATIENCE) {
                Received::Batch(batch) => {
                    let mut news = Vec::new();
                    for record in batch.iter() {
                        news.extend(self.board.take(record));
                    }
                    self.show(screen, &news);
                }
                Received::Silence => {}
                Received::Closed => {
                    say(&self.board.summary());
                    return Ok(());
                }
            }
        }
    }
}

impl Terminal {
    fn show(&mut self, screen: bool, news: &[String]) {
        if !screen {
            say(news);
        } else if self.board.take_redraw() {
            let lines = fit(&self.board);
            let back = match self.drawn {
                0 => String::new(),
                drawn => format!("\x1b[{drawn}A\x1b[J"),
            };
            say(&[back + &lines.join("\n")]);
            self.drawn = lines.len();
        }
    }
}

/// The board as it fits on the screen: no line is wrapped, and none is above the upper edge.
fn fit(board: &Board) -> Vec<String> {
    let size = termios::tcgetwinsize(std::io::stderr());
    let (rows, columns) =
        size.map_or((24, 80), |size| (usize::from(size.ws_row), usize::from(size.ws_col)));
    let lines = board.lines(rows.max(4) - 1);
    lines.into_iter().map(|line| line.chars().take(columns.max(20) - 1).collect()).collect()
}

fn is_shown(stream: &Stream) -> bool {
    matches!(stream.shape, Shape::Status | Shape::Event | Shape::Feature)
}

/// Writes lines to standard error; nobody reading them is no failure of the session.
fn say(lines: &[String]) {
    let mut out = std::io::stderr().lock();
    for line in lines {
        if writeln!(out, "{line}").is_err() {
            return;
        }
    }
}
