//! The terminal: one line for each robot, signal of a person and stream while running, and a summary at the end.

mod board;
mod robot;
mod person;
mod team;
mod estimates;
mod happening;

use std::io::{IsTerminal, Write};
use std::time::Duration;

use rustix::termios;
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{Shape, Stream};

pub use board::Board;
use estimates::unblinds;

/// How long to wait for something new before looking again.
const PATIENCE: Duration = Duration::from_millis(200);

/// Shows the state of the team on standard error: redrawn each second on a screen; elsewhere a line
/// whenever a state changes.
#[derive(Debug, Default)]
pub struct Terminal {
    board: Board,
    drawn: usize,
    estimates: Estimates,
}

/// Whether estimates about people, and how they differ from their baselines, are on the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimates {
    /// They are not: an experimenter stays blind.
    #[default]
    Hidden,
    /// They are.
    Shown,
}

impl Sink for Terminal {
    fn name(&self) -> &'static str {
        "terminal"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        let estimates = self.estimates;
        let is_wanted = move |stream: &Stream| {
            is_shown(stream) && (estimates == Estimates::Shown || !unblinds(stream))
        };
        Wants::Only(Box::new(is_wanted))
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
    /// A terminal that shows estimates about people, or hides them.
    pub fn new(estimates: Estimates) -> Terminal {
        Terminal { estimates, ..Terminal::default() }
    }

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
    use Shape::{Description, Event, Feature, Status};
    matches!(stream.shape, Status | Event | Feature | Description)
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

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{About, Subject};

    use super::*;

    #[test]
    fn what_unblinds_an_experimenter_is_not_on_the_screen_unless_asked_for() {
        let subject = Subject { about: About::Person, id: "p001".into() };
        let wants = |estimates, name: &str| {
            let Wants::Only(wants) = Terminal::new(estimates).wants() else { panic!() };
            let name = format!("/humans/persons/p001/{name}");
            wants(&Stream::raw(name, subject.clone(), Shape::Feature))
        };
        for name in ["estimates/w30", "estimates/phases", "state/w30"] {
            assert!(!wants(Estimates::Hidden, name) && wants(Estimates::Shown, name), "{name}");
        }
        assert!(wants(Estimates::Hidden, "strap/ecg/heart/w30"));
    }
}
