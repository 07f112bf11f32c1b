//! Associates faces and bodies with people.

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::pattern::Pattern;
use teampulse_core::time::Time;

use super::Hri;
use super::topic::{Part, Topic};

/// The time without messages after which a face or body counts as out of view, so that another may be assigned to the
/// person [s].
const LOST_SECS: f64 = 1.0;
/// The largest number of people accepted from a person manager.
const MOST_PEOPLE: usize = 64;
/// The longest ID [bytes].
const LONGEST_ID: usize = 64;

/// The people of a source, and their current faces and bodies.
#[derive(Debug)]
pub(super) struct People {
    whose: Whose,
    has_position: Option<Arc<str>>,
    /// The ID of the face or body assigned to each person on ROS.
    matched: BTreeMap<(String, Part), String>,
    /// The person's face and body currently in view, and when they were last seen.
    present: BTreeMap<Part, (String, Seen)>,
}

/// The time of a detection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The arrival of the message.
    pub came: Time,
    /// The stamp of the picture, if known: delayed messages arrive all at once.
    pub stamp: Option<Time>,
}

impl Seen {
    /// Whether enough time has passed since an earlier detection that its face or body counts as out of view.
    fn is_lost_since(&self, before: &Seen) -> bool {
        let stamps = self.stamp.zip(before.stamp);
        let by_stamp = stamps.is_some_and(|(now, before)| now.secs_since(before) > LOST_SECS);
        by_stamp || self.came.secs_since(before.came) > LOST_SECS
    }
}

/// How faces and bodies are matched to people.
#[derive(Debug)]
enum Whose {
    /// All faces and bodies with matching IDs belong to one person.
    Named { person: Arc<str>, face: Option<Pattern>, body: Option<Pattern> },
    /// Faces and bodies that a person manager assigns to the person with this ID on ROS.
    Matched { person: Arc<str>, id: String },
    /// Everyone whom a person manager publishes, under the IDs that it assigns.
    Everyone,
}

/// The owner of a face or body.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// A person of the study.
    Person(Arc<str>),
    /// Someone who is not a person of the study.
    Nobody,
    /// No person, because another face or body is in view at the same time.
    Beside,
}

impl People {
    pub fn new(settings: &Hri) -> People {
        let pattern =
            |id: &Option<String>| id.as_ref().and_then(|id| Pattern::parse(&format!("/{id}")).ok());
        let person: Option<Arc<str>> = settings.person.as_deref().map(Arc::from);
        let whose = match (&person, &settings.id) {
            (None, _) => Whose::Everyone,
            (Some(person), Some(id)) => {
                Whose::Matched { person: Arc::clone(person), id: id.clone() }
            }
            (Some(person), None) => {
                let (mut face, mut body) = (pattern(&settings.face), pattern(&settings.body));
                if face.is_none() && body.is_none() && settings.position.is_none() {
                    (face, body) = (Pattern::parse("/*").ok(), Pattern::parse("/*").ok());
                }
                Whose::Named { person: Arc::clone(person), face, body }
            }
        };
        let has_position = person.filter(|_| settings.position.is_some());
        People { whose, has_position, matched: BTreeMap::new(), present: BTreeMap::new() }
    }

    /// Assigns a face or body to a person; an empty ID removes the assignment. Returns `false` if there was no room.
    pub fn learn(&mut self, person: &str, part: Part, id: &str) -> bool {
        let key = (person.to_owned(), part);
        if id.is_empty() {
            self.matched.remove(&key);
            return true;
        }
        let is_wanted = match &self.whose {
            Whose::Matched { id, .. } => id == person,
            Whose::Everyone => true,
            Whose::Named { .. } => return true,
        };
        let is_full = self.matched.len() >= 2 * MOST_PEOPLE && !self.matched.contains_key(&key);
        if person.len() > LONGEST_ID || id.len() > LONGEST_ID || is_full {
            return false;
        }
        if is_wanted {
            self.matched.insert(key, id.to_owned());
        }
        true
    }

    /// Returns the owner of a message on a topic. A gaze message names who looks.
    pub fn owner(&mut self, topic: &Topic, sender: &str, now: Seen) -> Owner {
        match topic {
            Topic::Face { id, .. } => self.of_part(Part::Face, id, now),
            Topic::Body { id, .. } | Topic::BodyPosition { id, .. } => {
                self.of_part(Part::Body, id, now)
            }
            Topic::Person { id, .. } => self.of_person(id),
            Topic::Gazing => match self.of_person(sender) {
                Owner::Nobody => self.of_part(Part::Face, sender, now),
                person => person,
            },
            Topic::Position { .. } => {
                self.has_position.clone().map_or(Owner::Nobody, Owner::Person)
            }
            Topic::Match { .. } => Owner::Nobody,
        }
    }

    /// Returns the owner of messages about a person with this ID on ROS.
    fn of_person(&self, id: &str) -> Owner {
        match &self.whose {
            Whose::Matched { person, id: wanted } if wanted == id => {
                Owner::Person(Arc::clone(person))
            }
            Whose::Everyone if self.matched.keys().any(|(person, _)| person == id) => named(id),
            _ => Owner::Nobody,
        }
    }

    fn of_part(&mut self, part: Part, id: &str, now: Seen) -> Owner {
        match &self.whose {
            Whose::Named { person, face, body } => {
                let pattern = if part == Part::Face { face } else { body };
                let is_theirs =
                    pattern.as_ref().is_some_and(|pattern| pattern.matches(&format!("/{id}")));
                if !is_theirs || id.len() > LONGEST_ID {
                    return Owner::Nobody;
                }
                let present = self.present.entry(part).or_insert_with(|| (id.to_owned(), now));
                if present.0 != id && !now.is_lost_since(&present.1) {
                    return Owner::Beside;
                }
                *present = (id.to_owned(), now);
                Owner::Person(Arc::clone(person))
            }
            Whose::Matched { .. } | Whose::Everyone => {
                let is_it = |((_, of), matched): &(&(String, Part), &String)| {
                    *of == part && matched.as_str() == id
                };
                let owner = self.matched.iter().find(is_it).map(|((person, _), _)| person.as_str());
                owner.map_or(Owner::Nobody, |person| self.of_person(person))
            }
        }
    }
}

/// Returns a person with an ID on ROS; `Nobody` if the ID is not a valid topic token.
fn named(id: &str) -> Owner {
    match crate::wearables::check_person(id) {
        Ok(()) => Owner::Person(Arc::from(id)),
        Err(_) => Owner::Nobody,
    }
}

#[cfg(test)]
mod tests {
    use teampulse_messages::hri::Kind;

    use super::*;

    fn people(settings: &str) -> People {
        People::new(&toml::from_str(settings).expect("settings"))
    }

    fn face(id: &str) -> Topic {
        Topic::Face { id: id.to_owned(), kind: Kind::Landmarks }
    }

    fn at(secs: f64) -> Seen {
        Seen { came: Time::from_nanos((secs * 1e9) as i64), stamp: None }
    }

    fn p001() -> Owner {
        Owner::Person("p001".into())
    }

    #[test]
    fn the_next_face_is_the_persons_once_the_last_one_is_lost() {
        let mut people = people("person = \"p001\"\nface = \"*\"");
        assert_eq!(people.owner(&face("a"), "", at(0.0)), p001());
        assert_eq!(people.owner(&face("b"), "", at(0.5)), Owner::Beside);
        assert_eq!(people.owner(&face("a"), "", at(1.0)), p001());
        assert_eq!(people.owner(&face("b"), "", at(2.5)), p001());
        assert_eq!(people.owner(&face("a"), "", at(2.6)), Owner::Beside);
        let body = Topic::Body { id: "a".into(), kind: Kind::Skeleton };
        assert_eq!(people.owner(&body, "", at(2.6)), Owner::Nobody, "no bodies were requested");
    }

    #[test]
    fn messages_that_were_held_up_count_by_their_stamps() {
        let mut people = people("person = \"p001\"\nface = \"*\"");
        let held_up = |secs: f64| Seen { stamp: Some(at(secs).came), ..at(9.0) };
        assert_eq!(people.owner(&face("a"), "", held_up(1.0)), p001());
        assert_eq!(people.owner(&face("b"), "", held_up(1.5)), Owner::Beside);
        assert_eq!(people.owner(&face("b"), "", held_up(2.5)), p001());
    }

    #[test]
    fn a_person_alone_has_all_faces_and_bodies() {
        let mut people = people("person = \"p001\"");
        let body = Topic::Body { id: "x".into(), kind: Kind::Skeleton };
        assert_eq!(people.owner(&body, "", at(0.0)), p001());
        assert_eq!(people.owner(&face("y"), "", at(0.0)), p001());
    }

    #[test]
    fn a_person_manager_says_which_face_is_whose() {
        let mut people = people("person = \"p001\"\nid = \"gvbec\"");
        assert_eq!(people.owner(&face("a"), "", at(0.0)), Owner::Nobody);
        people.learn("other", Part::Face, "a");
        assert_eq!(people.owner(&face("a"), "", at(0.0)), Owner::Nobody);
        people.learn("gvbec", Part::Face, "a");
        assert_eq!(people.owner(&face("a"), "", at(0.0)), p001());
        people.learn("gvbec", Part::Face, "b");
        assert_eq!(people.owner(&face("a"), "", at(0.0)), Owner::Nobody);
        assert_eq!(people.owner(&face("b"), "", at(0.0)), p001());
        assert_eq!(people.owner(&Topic::Gazing, "gvbec", at(0.0)), p001());
        people.learn("gvbec", Part::Face, "");
        assert_eq!(people.owner(&face("b"), "", at(0.0)), Owner::Nobody);
    }

    #[test]
    fn everyone_has_the_id_of_the_person_manager() {
        let mut people = people("");
        people.learn("anonymous_person_1", Part::Face, "a");
        people.learn("a-b", Part::Face, "c");
        let expected = Owner::Person("anonymous_person_1".into());
        assert_eq!(people.owner(&face("a"), "", at(0.0)), expected);
        assert_eq!(people.owner(&face("c"), "", at(0.0)), Owner::Nobody, "not a valid topic name");
    }

    #[test]
    fn ids_are_bounded() {
        let mut people = people("");
        let kept = (0..10_000).filter(|each| people.learn(&format!("p{each}"), Part::Face, "a"));
        assert_eq!(kept.count(), 2 * MOST_PEOPLE);
        assert!(!people.learn(&"x".repeat(100), Part::Face, "a"));
    }
}
