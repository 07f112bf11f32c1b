//! The markers that align a recording with a session, chosen by their labels.

use std::collections::BTreeSet;
use std::str::FromStr;

use teampulse_bag::Bag;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_formats::{Content, Mark};
use teampulse_messages::convert::decode;
use teampulse_messages::standard::Message as _;
use teampulse_messages::standard::teampulse_msgs::Event;

use super::imported::DeviceRecording;
use crate::exit::Exit;
use crate::failure::Failure;

/// The most labels that a hint lists.
const MOST: usize = 8;

/// The labels of `--at LABEL[=LABEL]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Labels {
    session: String,
    /// The label of marks in the file; `None` for all marks.
    file: Option<String>,
}

impl FromStr for Labels {
    type Err = String;

    fn from_str(text: &str) -> Result<Labels, String> {
        let (session, file) = match text.split_once('=') {
            Some((session, file)) => (session, Some(file.to_owned())),
            None => (text, None),
        };
        if session.is_empty() || file.as_ref().is_some_and(String::is_empty) {
            let expected = "expected the label of markers in the session and, after `=`, the label of marks in the file";
            return Err(format!("{expected}: tap, or tap=tag"));
        }
        Ok(Labels { session: session.to_owned(), file })
    }
}

impl Labels {
    /// Names the events of the session with this label, as a stream and its channel.
    pub fn in_session(&self) -> String {
        format!("{SESSION_EVENTS}:{}", self.session)
    }

    /// Returns the times of the marks in a file with this label [ns].
    pub fn in_file(&self, device: &DeviceRecording) -> Result<Vec<i64>, Failure> {
        let is_meant = |mark: &&Mark| self.file.as_ref().is_none_or(|label| *label == mark.label);
        let at_ns: Vec<i64> = marks(device).filter(is_meant).map(|mark| mark.at_ns).collect();
        if !at_ns.is_empty() {
            return Ok(at_ns);
        }
        let known = marks(device).map(|mark| mark.label.clone()).collect();
        let form = |label: &str| format!("{}={label}", self.session);
        Err(none_in(&device.name, self.file.as_deref(), &known, form))
    }

    /// The failure if the session has no marker with this label.
    pub fn none_in_session(&self, bag: &Bag) -> Failure {
        let form = |label: &str| match &self.file {
            Some(file) => format!("{label}={file}"),
            None => label.to_owned(),
        };
        none_in("the session", Some(&self.session), &labels_of(bag), form)
    }
}

/// Builds the failure for missing markers; the hint lists the known ones and shows how to give one of them.
fn none_in(
    which: &str,
    label: Option<&str>,
    known: &BTreeSet<String>,
    form: impl Fn(&str) -> String,
) -> Failure {
    let what = label.map_or("markers".to_owned(), |label| format!("marker {label:?}"));
    let listed: Vec<String> = known.iter().take(MOST).map(|each| format!("`{each}`")).collect();
    let more = if known.len() > MOST { " and others" } else { "" };
    let hint = match known.first() {
        None => "it has no markers: omit --at to match heartbeats or movement".to_owned(),
        Some(first) => {
            format!("its markers are {}{more}: give --at \"{}\"", listed.join(", "), form(first))
        }
    };
    Failure::new(format!("{which} has no {what}")).hint(hint).exit(Exit::BadArguments)
}

fn marks(device: &DeviceRecording) -> impl Iterator<Item = &Mark> {
    let marks = device.signals.iter().filter_map(|signal| match &signal.content {
        Content::Marks(marks) => Some(marks),
        _ => None,
    });
    marks.flatten()
}

/// Returns the labels of the markers in a session.
fn labels_of(bag: &Bag) -> BTreeSet<String> {
    let place = bag.streams().iter().position(|known| known.stream.name == SESSION_EVENTS);
    let events = bag.messages(None).flatten().filter(|message| Some(message.stream) == place);
    let markers = events.filter_map(|message| match decode(Event::NAME, &message.cdr).ok()?.data {
        Data::Event(event) if event.kind == EventKind::Marker => Some(event.label.clone()),
        _ => None,
    });
    markers.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_one_or_two_and_none_is_empty() {
        let labels = |text: &str| text.parse::<Labels>().ok().map(|it| (it.session, it.file));
        assert_eq!(labels("tap"), Some(("tap".into(), None)));
        assert_eq!(labels("tap=tag"), Some(("tap".into(), Some("tag".into()))));
        for wrong in ["", "=", "tap=", "=tag"] {
            assert_eq!(labels(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_label_that_is_missing_is_shown_with_those_that_there_are() {
        let known = BTreeSet::from(["clap".to_owned(), "tag".to_owned()]);
        let form = |label: &str| format!("tap={label}");
        let (message, hint) = none_in("e4.zip", Some("nope"), &known, form).words();
        assert_eq!(message, "e4.zip has no marker \"nope\"");
        assert_eq!(hint, "its markers are `clap`, `tag`: give --at \"tap=clap\"");
        let (_, hint) = none_in("e4.zip", None, &BTreeSet::new(), form).words();
        assert_eq!(hint, "it has no markers: omit --at to match heartbeats or movement");
    }
}
