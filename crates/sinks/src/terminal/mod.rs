//! The terminal: one line for each robot and stream while running, and a summary at the end.

mod board;

use std::io::{IsTerminal, Write};
use std::time::Duration;

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
        Wants::Only(is_shown)
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
            let lines = self.board.lines();
            let mut text = String::new();
            if self.drawn > 0 {
                text = format!("\x1b[{}A\x1b[J", self.drawn);
            }
            text.push_str(&lines.join("\n"));
            say(&[text]);
            self.drawn = lines.len();
        }
    }
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
