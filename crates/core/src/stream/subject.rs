//! Whom streams are about.

use crate::words::words;

/// Whom a stream is about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Subject {
    /// The kind of subject.
    pub about: About,
    /// Its id; empty for the team and the session.
    pub id: String,
}

impl Subject {
    /// The person of the given pseudonym.
    pub fn person(id: impl Into<String>) -> Subject {
        Subject { about: About::Person, id: id.into() }
    }

    /// The robot of the given id.
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

    /// What a topic of the subject is called within its namespace, for people to read:
    /// `polar_h10/ecg`, `battery_state`; any other has its whole name.
    pub fn within<'a>(&self, topic: &'a str) -> &'a str {
        match topic.split_once(&format!("/{}/", self.id)) {
            Some((_, within)) if !self.id.is_empty() => within,
            _ => topic,
        }
    }
}

words! {
    /// What kind of subject a stream is about.
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
