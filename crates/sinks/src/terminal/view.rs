//! Scroll positions, and questions to the operator.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_core::time::Time;

/// Scroll positions and questions, set by keys and drawn by the terminal. Clones share their state.
#[derive(Clone, Debug, Default)]
pub struct View(Arc<Mutex<Looks>>);

#[derive(Debug, Default)]
struct Looks {
    /// The number of lines of the team above the visible part.
    team_from: usize,
    /// The number of lines of the log below the visible part.
    log_back: usize,
    /// The number of visible lines of the log.
    log_rows: usize,
    question: Option<(String, Time)>,
    has_keys: bool,
    is_seen: bool,
    is_changed: bool,
}

/// A scroll command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scroll {
    /// Scrolls the team up by one line.
    Up,
    /// Scrolls the team down by one line.
    Down,
    /// Scrolls the log back by one page.
    Back,
    /// Scrolls the log forward by one page.
    Forth,
    /// Scrolls to the top of the team and the end of the log.
    Home,
}

/// How long a question stays open [s]: a later key is not an answer to it.
const STANDS_SECS: f64 = 10.0;

impl View {
    /// Scrolls the team or the log.
    pub fn scroll(&self, scroll: Scroll) {
        let mut looks = self.lock();
        let page = looks.log_rows.max(2) - 1;
        match scroll {
            Scroll::Up => looks.team_from = looks.team_from.saturating_sub(1),
            Scroll::Down => looks.team_from += 1,
            Scroll::Back => looks.log_back += page,
            Scroll::Forth => looks.log_back = looks.log_back.saturating_sub(page),
            Scroll::Home => (looks.team_from, looks.log_back) = (0, 0),
        }
        looks.is_changed = true;
    }

    /// Shows the explanation of the keys.
    pub fn explain_keys(&self) {
        self.lock().has_keys = true;
    }

    /// Whether keys are read.
    pub(super) fn has_keys(&self) -> bool {
        self.lock().has_keys
    }

    /// Marks the faults on the screen as seen.
    pub fn see(&self) {
        let mut looks = self.lock();
        (looks.is_seen, looks.is_changed) = (true, true);
    }

    /// Shows a question or a message for a while in place of the explanation of the keys.
    pub fn ask(&self, question: impl Into<String>, now: Time) {
        let mut looks = self.lock();
        looks.question = Some((question.into(), now));
        looks.is_changed = true;
    }

    /// Closes the question; returns whether it was open.
    pub fn take_question(&self, now: Time) -> bool {
        let mut looks = self.lock();
        looks.is_changed = true;
        looks.question.take().is_some_and(|(_, asked)| now.secs_since(asked) < STANDS_SECS)
    }

    /// The open question.
    pub(super) fn question(&self, now: Time) -> Option<String> {
        let mut looks = self.lock();
        looks.question.take_if(|(_, asked)| now.secs_since(*asked) >= STANDS_SECS);
        looks.question.as_ref().map(|(question, _)| question.clone())
    }

    /// The first visible line of the team, given its number of lines and the number of rows.
    pub(super) fn team_from(&self, lines: usize, rows: usize) -> usize {
        let mut looks = self.lock();
        looks.team_from = looks.team_from.min(lines.saturating_sub(rows));
        looks.team_from
    }

    /// The number of lines of the log below the visible part, given its number of lines and the number of rows.
    pub(super) fn log_back(&self, lines: usize, rows: usize) -> usize {
        let mut looks = self.lock();
        looks.log_rows = rows;
        looks.log_back = looks.log_back.min(lines.saturating_sub(rows));
        looks.log_back
    }

    /// Whether faults were seen since the last call.
    pub(super) fn take_seen(&self) -> bool {
        std::mem::take(&mut self.lock().is_seen)
    }

    /// Whether anything changed since the last call.
    pub(super) fn take_changed(&self) -> bool {
        std::mem::take(&mut self.lock().is_changed)
    }

    fn lock(&self) -> MutexGuard<'_, Looks> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_scrolls_beyond_what_there_is() {
        let view = View::default();
        (0..9).for_each(|_| view.scroll(Scroll::Down));
        assert_eq!(view.team_from(10, 6), 4);
        view.scroll(Scroll::Up);
        assert_eq!(view.team_from(10, 6), 3);
        assert_eq!(view.log_back(20, 8), 0);
        (0..9).for_each(|_| view.scroll(Scroll::Back));
        assert_eq!(view.log_back(20, 8), 12);
        view.scroll(Scroll::Home);
        assert_eq!((view.team_from(10, 6), view.log_back(20, 8)), (0, 0));
    }

    #[test]
    fn a_question_does_not_stand_for_ever() {
        let (view, at) = (View::default(), |secs| Time::from_stamp(secs, 0));
        view.ask("end?", at(0));
        assert_eq!(view.question(at(5)).as_deref(), Some("end?"));
        assert!(view.take_question(at(5)) && !view.take_question(at(5)));
        view.ask("end?", at(0));
        assert_eq!(view.question(at(11)), None);
    }
}
