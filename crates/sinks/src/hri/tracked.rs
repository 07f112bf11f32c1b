//! Who is in view.

use std::collections::{BTreeMap, BTreeSet};

use teampulse_core::time::Time;
use teampulse_messages::standard::hri_msgs::IdsList;
use teampulse_messages::standard::std_msgs::{Flag, Header, Text};

use super::Message;
use super::view::Part;

/// The time after which a face or body that was not found again is out of view [s].
const LOST_SECS: f64 = 1.0;
/// The interval after which the lists are published again, for late subscribers [s].
const AGAIN_SECS: f64 = 1.0;

/// The faces and bodies in view, and the people to whom they belong.
#[derive(Debug, Default)]
pub(super) struct Tracked {
    seen: BTreeMap<(Part, String), Seen>,
    known: BTreeSet<String>,
    last: Option<Lists>,
    published: Option<Time>,
}

#[derive(Debug)]
struct Seen {
    person: String,
    at: Time,
}

/// The lists of what is in view at a time.
#[derive(Clone, Debug, Default, PartialEq)]
struct Lists {
    faces: Vec<String>,
    bodies: Vec<String>,
    persons: BTreeSet<String>,
    /// The face and the body of each known person; empty if it is not in view.
    matched: BTreeMap<(String, Part), String>,
}

impl Tracked {
    /// Notes that a face or body of a person was found.
    pub fn see(&mut self, part: Part, id: &str, person: &str, at: Time) {
        self.known.insert(person.to_owned());
        self.seen.insert((part, id.to_owned()), Seen { person: person.to_owned(), at });
    }

    /// Returns what must be published now: lists that have changed or are due, and ids that have changed.
    pub fn look(&mut self, now: Time) -> Vec<Message> {
        self.seen.retain(|_, seen| now.secs_since(seen.at) <= LOST_SECS);
        if self.known.is_empty() {
            return Vec::new();
        }
        let lists = self.lists();
        let is_due = self.published.is_none_or(|last| now.secs_since(last) >= AGAIN_SECS);
        if self.last.as_ref() == Some(&lists) && !is_due {
            return Vec::new();
        }
        self.published = Some(now);
        let mut messages = self.newly_matched(&lists);
        let list = |topic: &str, ids: Vec<String>| {
            Message::new(topic.to_owned(), &IdsList { header: Header::at(now), ids })
        };
        messages.push(list("faces/tracked", lists.faces.clone()));
        messages.push(list("bodies/tracked", lists.bodies.clone()));
        messages.push(list("persons/tracked", lists.persons.iter().cloned().collect()));
        messages.push(list("persons/known", self.known.iter().cloned().collect()));
        self.last = Some(lists);
        messages
    }

    fn lists(&self) -> Lists {
        let of = |part: Part| {
            let ids = self.seen.keys().filter(move |(of, _)| *of == part);
            ids.map(|(_, id)| id.clone()).collect()
        };
        let matched = |(person, part): (&String, Part)| {
            let theirs =
                self.seen.iter().filter(|((of, _), seen)| *of == part && seen.person == *person);
            // If several cameras see the person, the one that saw the person last counts.
            let newest = theirs.max_by_key(|(_, seen)| seen.at);
            let id = newest.map(|((_, id), _)| id.clone()).unwrap_or_default();
            ((person.clone(), part), id)
        };
        let parts = [Part::Face, Part::Body];
        let pairs = self.known.iter().flat_map(|person| parts.map(|part| (person, part)));
        Lists {
            faces: of(Part::Face),
            bodies: of(Part::Body),
            persons: self.seen.values().map(|seen| seen.person.clone()).collect(),
            matched: pairs.map(matched).collect(),
        }
    }

    fn newly_matched(&self, lists: &Lists) -> Vec<Message> {
        let before = self.last.as_ref().map(|last| &last.matched);
        let is_new = |((person, part), id): &(&(String, Part), &String)| {
            let known = before.and_then(|before| before.get(&(person.clone(), *part)));
            known.map_or(!id.is_empty(), |known| known != *id)
        };
        let mut messages = Vec::new();
        for ((person, part), id) in lists.matched.iter().filter(is_new) {
            let text = Text { data: id.clone() };
            let topic = format!("persons/{person}/{}", part.id_topic());
            messages.push(Message::new(topic, &text).latched());
        }
        let is_first = |person: &&String| {
            before.is_none_or(|before| !before.contains_key(&((*person).clone(), Part::Face)))
        };
        for person in self.known.iter().filter(is_first) {
            let flag = Flag { data: false };
            messages.push(Message::new(format!("persons/{person}/anonymous"), &flag).latched());
        }
        messages
    }
}
