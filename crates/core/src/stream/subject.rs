//! The subjects of streams.

use crate::words::words;

/// The subject of a stream.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Subject {
    /// The kind of subject.
    pub about: About,
    /// The subject's id; empty for the team and the session.
    pub id: String,
}

impl Subject {
    /// The person with the given pseudonym.
    pub fn person(id: impl Into<String>) -> Subject {
        Subject { about: About::Person, id: id.into() }
    }

    /// The robot with the given id.
    pub fn robot(id: impl Into<String>) -> Subject {
        Subject { about: About::Robot, id: id.into() }
    }

    /// The team as a whole.
    pub fn team() -> Subject {
        Subject { about: About::Team, id: String::new() }
    }

    /// The session itself.
    pub fn session() -> Subject {
        Subject { about: About::Session, id: String::new() }
    }

    /// The name of a topic within the subject's namespace, for people: `polar_h10/ecg`,
    /// `battery_state`; any other topic keeps its whole name.
    pub fn within<'a>(&self, topic: &'a str) -> &'a str {
        match topic.split_once(&format!("/{}/", self.id)) {
            Some((_, within)) if !self.id.is_empty() => within,
            _ => topic,
        }
    }
}

words! {
    /// The kinds of subjects.
    About {
        /// A person, by pseudonym.
        Person = "person",
        /// A robot.
        Robot = "robot",
        /// The team as a whole.
        Team = "team",
        /// The session: its phases, its losses, its own health.
        Session = "session",
    }
}
