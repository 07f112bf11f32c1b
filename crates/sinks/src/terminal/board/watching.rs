//! The indicator of which cameras and microphones are on.

use std::collections::BTreeSet;

use teampulse_core::status::State;
use teampulse_core::stream::{Origin, Signal};

use super::{Board, Style, StyledLine};
use crate::terminal::natural::Name;

/// The maximum number of names shown.
const NAMES: usize = 3;

impl Board {
    /// The people and robots whose pictures or sound are being received; `None` if there are none.
    pub(in crate::terminal) fn watching(&self) -> Option<StyledLine> {
        let kinds = [("camera", Signal::Image), ("microphone", Signal::Audio)];
        let lights: Vec<String> =
            kinds.iter().filter_map(|(kind, signal)| self.light(kind, *signal)).collect();
        let text = format!("◉ {}", lights.join("   ◉ "));
        (!lights.is_empty()).then(|| StyledLine::of(Style::Strong, &text))
    }

    fn light(&self, kind: &str, signal: Signal) -> Option<String> {
        let mut of = BTreeSet::new();
        for status in self.statuses() {
            let is_on = matches!(status.state, State::Ok | State::Degraded);
            let stream = self.stream(status).filter(|_| is_on);
            if let Some(stream) = stream
                && stream.signal == signal
                && stream.origin == Origin::Raw
            {
                let id = if stream.id.is_empty() { "the team" } else { &stream.id };
                of.insert(Name(id.to_owned()));
            }
        }
        let names: Vec<&str> = of.iter().take(NAMES).map(|name| name.0.as_str()).collect();
        let more = of.len().saturating_sub(NAMES);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        (!of.is_empty()).then(|| format!("{kind} on: {}{more}", names.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Stream, Subject};

    use super::super::tests::{person, status};
    use super::*;

    fn board(streams: Vec<(Stream, State)>) -> Board {
        let mut board = Board::default();
        for (stream, state) in streams {
            board.known.declare(stream.clone());
            board.take(&status(1, &stream.name, (state, ""), 0.1));
        }
        board
    }

    fn stream(name: &str, subject: Subject, signal: Signal) -> Stream {
        Stream { signal, ..Stream::raw(name, subject, Shape::Sample) }
    }

    fn text(board: &Board) -> Option<String> {
        board.watching().map(|line| line.text())
    }

    #[test]
    fn the_light_says_whose_cameras_and_microphones_are_on() {
        let streams = vec![
            (stream("/cameras/door/image", Subject::team(), Signal::Image), State::Ok),
            (stream("/robot1/image", Subject::robot("robot1"), Signal::Image), State::Degraded),
            (stream("/robot2/image", Subject::robot("robot2"), Signal::Image), State::Dead),
            (stream("/humans/persons/p001/voice", person(), Signal::Audio), State::Ok),
            (stream("/humans/persons/p001/ecg", person(), Signal::Ecg), State::Ok),
        ];
        let light = "◉ camera on: robot1, the team   ◉ microphone on: p001";
        assert_eq!(text(&board(streams)).as_deref(), Some(light));
    }

    #[test]
    fn of_many_the_first_are_named() {
        let robot = |n| {
            let id = format!("robot{n}");
            (stream(&format!("/{id}/image"), Subject::robot(id), Signal::Image), State::Ok)
        };
        let light = "◉ camera on: robot1, robot2, robot3 and 7 more";
        assert_eq!(text(&board((1..=10).map(robot).collect())).as_deref(), Some(light));
    }

    #[test]
    fn without_any_there_is_no_light() {
        let dead = stream("/robot2/image", Subject::robot("robot2"), Signal::Image);
        assert_eq!(text(&board(vec![(dead, State::Stale)])), None);
    }
}
