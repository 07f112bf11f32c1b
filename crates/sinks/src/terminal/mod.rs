//! The terminal: recording, troubles, team and log on one screen, or a line per change; and a summary at the
//! end.

mod styled_line;
mod format;
mod natural;
mod view;
mod screen;
mod header;
mod faults;
mod trouble;
mod team;
mod person;
mod robot;
mod estimates;
mod event_text;
mod board;
mod layout;

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Clock;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError, Wants};
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::time::Time;

use crate::{Announcements, SinkContext};

pub use board::Board;
pub use header::Kept;
use header::Recording;
use layout::Shown;
use screen::{Screen, Size, size};
pub use screen::{WarningOutput, leave_screen};
pub use styled_line::Colours;
use styled_line::harmless;
pub use view::{Scroll, View};

/// The longest wait for input; a key is answered within this.
const PATIENCE: Duration = Duration::from_millis(100);
/// How long readings gather before they are processed.
const GATHER: Duration = Duration::from_millis(50);
/// The interval between redraws [s].
const REDRAW_SECS: f64 = 1.0;

/// Shows the state of the team on standard error: on a full screen or, without a terminal, as a line whenever a state
/// changes. Every session has this sink.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Terminal {
    /// Prints lines even if a screen could be drawn.
    pub plain: bool,
}

impl Component<dyn Sink, SinkContext> for Terminal {
    const EXAMPLE: &'static str = "plain = true";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let mut settings = context.terminal.clone();
        settings.plain |= self.plain;
        Ok(Box::new(Display::new(settings, context.announcements.clone())))
    }
}

/// The settings of the display.
#[derive(Clone, Default)]
pub struct TerminalContext {
    /// Whether estimates about people are shown.
    pub estimates: Estimates,
    /// What the session stores.
    pub kept: Kept,
    /// The scroll positions and questions, set by keys.
    pub view: View,
    /// Whether colours are used.
    pub colours: Colours,
    /// Whether lines are printed even if a screen could be drawn.
    pub plain: bool,
    /// Notes on the study, shown from the start.
    pub notes: Vec<String>,
    /// The source of the next phase.
    pub next: Option<NextPhase>,
}

/// Returns the name of the next phase.
pub type NextPhase = Arc<dyn Fn() -> Option<String> + Send + Sync>;

/// Whether estimates about people are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimates {
    /// Hidden: an experimenter remains blind.
    #[default]
    Hidden,
    /// Shown.
    Shown,
}

impl Estimates {
    /// Whether a stream is hidden on the terminal, and from viewers of the dashboard.
    pub fn hide(self, stream: &Stream) -> bool {
        self == Estimates::Hidden && estimates::unblinds(stream)
    }
}

/// The running terminal.
struct Display {
    board: Board,
    recording: Recording,
    settings: TerminalContext,
    clock: Clock,
    drawn: Option<(Time, Size)>,
    announcements: Announcements,
}

impl Sink for Display {
    fn name(&self) -> &'static str {
        "terminal"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn wants(&self) -> Wants {
        let estimates = self.settings.estimates;
        let is_wanted = move |stream: &Stream| is_shown(stream) && !estimates.hide(stream);
        Wants::Only(Box::new(is_wanted))
    }

    fn run(mut self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let is_screen = screen::is_ours() && !self.settings.plain;
        let mut screen = is_screen.then(Screen::take_over);
        let began = self.clock.now();
        self.board.know(inbox.streams());
        loop {
            match inbox.receive_gathered(GATHER, PATIENCE) {
                Received::Batch(batch) => {
                    let news = batch.iter().flat_map(|record| self.board.take(record));
                    let news: Vec<String> = news.collect();
                    if !is_screen {
                        say(&news);
                    }
                }
                Received::Silence => {}
                Received::Closed => break,
            }
            let announced = self.announcements.take();
            for line in &announced {
                self.board.note(line);
            }
            if !is_screen {
                say(&announced);
            }
            self.board.watch(self.clock.now().secs_since(began));
            if let Some(screen) = &mut screen {
                self.show(screen);
            }
        }
        drop(screen);
        say(&self.board.summary());
        Ok(())
    }
}

impl Display {
    fn new(settings: TerminalContext, announcements: Announcements) -> Display {
        let mut board = Board::default();
        for note in &settings.notes {
            board.note(&format!("note: {note}"));
        }
        let recording = Recording::of(settings.kept.clone());
        let (clock, drawn) = (Clock::host(), None);
        Display { board, recording, settings, clock, drawn, announcements }
    }

    /// Redraws the screen when a second has passed, a key was pressed, or its size changed.
    fn show(&mut self, screen: &mut Screen) {
        let (now, size) = (self.clock.now(), size());
        let is_due = self.drawn.is_none_or(|(drawn, drawn_size)| {
            now.secs_since(drawn) >= REDRAW_SECS || drawn_size != size
        });
        if !self.settings.view.take_changed() && !is_due {
            return;
        }
        for line in Screen::take_aside() {
            self.board.note(&line);
        }
        if self.settings.view.take_seen() {
            self.board.see_faults();
        }
        self.recording.look(now);
        let question = self.settings.view.question(now);
        let next = self.settings.next.as_ref().and_then(|next| next());
        let shown = Shown {
            board: &self.board,
            recording: &self.recording,
            view: &self.settings.view,
            question: question.as_deref(),
            next: next.as_deref(),
            has_keys: self.settings.view.has_keys(),
        };
        screen.draw(&layout::draw(shown, size), self.settings.colours);
        self.drawn = Some((now, size));
    }
}

fn is_shown(stream: &Stream) -> bool {
    matches!(stream.shape, Shape::Status | Shape::Event | Shape::Feature)
}

/// Writes lines to standard error, ignoring errors: a closed terminal must not end the session.
fn say(lines: &[String]) {
    let mut out = std::io::stderr().lock();
    for line in lines {
        if writeln!(out, "{}", harmless(line)).is_err() {
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
        let wants = |estimates, family: &str| {
            let settings = TerminalContext { estimates, ..TerminalContext::default() };
            let Wants::Only(wants) = Display::new(settings, Announcements::default()).wants()
            else {
                panic!()
            };
            let name = "/humans/persons/p001/any";
            wants(&Stream::concluded(name, subject.clone(), family, Shape::Feature))
        };
        assert!(!wants(Estimates::Hidden, "estimates") && wants(Estimates::Shown, "estimates"));
        assert!(wants(Estimates::Hidden, "heart") && wants(Estimates::Hidden, "state"));
    }
}
