//! Notes on robots, people and topics that are present but not named in the study.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::pattern::Pattern;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Stream;
use teampulse_ros::buses::Buses;
use teampulse_ros::graph::EndpointKind;
use teampulse_sources::hri;
use teampulse_sources::robots::{Choice, Robots};
use teampulse_sources::ros_people::{NAMESPACE, RosPeople};

use crate::commands::scan::robot;

/// The most lines of one kind: there may be thousands of topics.
const MOST: usize = 20;

/// The type of computed features.
const COMPUTED: &str = "teampulse_msgs/msg/Feature";

/// A topic and its type.
pub type Topic = (String, String);

/// Returns all topics that other programs publish on the joined buses.
pub fn topics(buses: &Buses) -> BTreeSet<Topic> {
    let mut topics = BTreeSet::new();
    for bus in buses.joined() {
        let graph = Arc::clone(&bus.graph().borrow());
        let others = graph.endpoints();
        let others = others.filter(|each| each.kind == EndpointKind::Publisher && !each.own);
        topics.extend(others.map(|each| (each.topic.clone(), each.type_name.clone())));
    }
    topics
}

/// Notes the robots, the people and their topics that are present but not recorded.
pub fn notes(
    wanted: &[Robots],
    people: &[RosPeople],
    kinds: &[String],
    (topics, heard): (&BTreeSet<Topic>, &[(Arc<Stream>, StreamStatus)]),
) -> Vec<String> {
    let heard: BTreeSet<&str> = heard.iter().map(|(stream, _)| stream.name.as_str()).collect();
    let are_seen = kinds.iter().any(|kind| kind == "hri");
    let is_left = |(name, type_name): &&Topic| {
        !(heard.contains(name.as_str()) || are_seen && hri::hears(name, type_name))
    };
    let left: Vec<&Topic> = topics.iter().filter(is_left).collect();
    let mut notes = cut(robots(wanted, &left));
    notes.extend(unseen(&left));
    notes.extend(cut(absent_people(people, &left)));
    notes.extend(cut(odd_topics(people, &left)));
    notes
}

/// Notes robots that match no settings.
fn robots(wanted: &[Robots], left: &[&Topic]) -> Vec<String> {
    let choices: Vec<Choice> = wanted.iter().filter_map(|each| Choice::new(each).ok()).collect();
    let of_person = Pattern::parse(NAMESPACE).ok();
    let mut found = BTreeMap::<&str, BTreeSet<&str>>::new();
    for (topic, type_name) in left {
        let is_named = choices.iter().any(|choice| choice.robot(topic).is_some());
        let is_of_person = of_person.as_ref().is_some_and(|each| each.split(topic).is_some());
        if let Some(robot) = robot(topic, type_name).filter(|_| !is_named && !is_of_person) {
            found.entry(robot).or_default().insert(topic);
        }
    }
    let said = found.into_iter().map(|(robot, topics)| {
        let topics = topics.into_iter().collect::<Vec<_>>().join(", ");
        format!("robot {robot} is present, but the study does not name it: {topics}")
    });
    said.collect()
}

/// Notes people who are present although the study watches no people.
fn absent_people(people: &[RosPeople], left: &[&Topic]) -> Vec<String> {
    if !people.is_empty() {
        return Vec::new();
    }
    let all = RosPeople::default();
    let of_people = left.iter().filter(|(topic, type_name)| all.hears(topic, type_name));
    let ids = of_people.filter_map(|(topic, _)| Some(all.namespace.subject(topic)?.0));
    let ids: BTreeSet<&str> = ids.collect();
    let said = ids.into_iter().map(|id| {
        format!(
            "person {id} is present, but the study watches no people: add [[sources]] with type = \"people\""
        )
    });
    said.collect()
}

/// Notes that other programs detect faces or bodies although the study receives none.
fn unseen(left: &[&Topic]) -> Option<String> {
    let (topic, _) = left.iter().find(|(topic, type_name)| hri::sees(topic, type_name))?;
    Some(format!(
        "people are detected ({topic}), but the study does not read that topic: add [[sources]] with type = \"hri\""
    ))
}

/// Notes topics of people that have unsupported types.
fn odd_topics(people: &[RosPeople], left: &[&Topic]) -> Vec<String> {
    let is_odd = |each: &&&Topic| {
        let (topic, type_name) = &**each;
        let is_below = |people: &RosPeople| people.namespace.split(topic).is_some();
        // Features that another session computed are recorded by that other session.
        type_name != COMPUTED
            && people.iter().any(is_below)
            && !people.iter().any(|people| people.hears(topic, type_name))
    };
    let said = left.iter().filter(is_odd).map(|(topic, type_name)| {
        format!(
            "{topic} is not recorded: `people` receives teampulse_msgs/Wave, Sample and Event at <namespace>/<device>/<signal>, but its type is {type_name}; to record it unchanged, name it in [[sources]] with \
             type = \"topics\""
        )
    });
    said.collect()
}

/// Shortens a list of notes to a readable length.
fn cut(mut lines: Vec<String>) -> Vec<String> {
    if lines.len() > MOST {
        let more = lines.len() + 1 - MOST;
        lines.truncate(MOST - 1);
        lines.push(format!("… and {more} more like these"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    const BATTERY: &str = "sensor_msgs/msg/BatteryState";

    fn said(wanted: &str, people: Option<&str>, topics: &[(&str, &str)]) -> Vec<String> {
        let wanted: Robots = toml::from_str(wanted).expect("settings");
        let people: Vec<RosPeople> =
            people.iter().map(|each| toml::from_str(each).expect("settings")).collect();
        let topics = topics.iter().map(|(topic, name)| ((*topic).to_owned(), (*name).to_owned()));
        notes(&[wanted], &people, &[], (&topics.collect(), &[]))
    }

    #[test]
    fn robots_that_the_study_does_not_name_are_listed() {
        let topics = [
            ("/robot1/battery", BATTERY),
            ("/turtle7/battery", BATTERY),
            ("/turtle7/odom", "nav_msgs/msg/Odometry"),
            ("/turtle8/scan", "sensor_msgs/msg/LaserScan"),
            ("/battery", BATTERY),
            ("/humans/persons/p001/temperature", "sensor_msgs/msg/Temperature"),
        ];
        assert_eq!(
            said("namespace = \"/robot*\"", Some(""), &topics[..5]),
            [
                "robot turtle7 is present, but the study does not name it: /turtle7/battery, /turtle7/odom"
            ]
        );
        let of_person = said("namespace = \"/robot*\"", Some(""), &topics[5..]);
        assert!(of_person[0].starts_with("/humans/persons/p001/temperature is not recorded"));
    }

    #[test]
    fn people_s_topics_of_other_types_are_named() {
        let topics = [
            ("/humans/persons/p001/h10/ecg", "teampulse_msgs/msg/Wave"),
            ("/humans/persons/p001/h10/hr", "std_msgs/msg/Float32"),
        ];
        let notes = said("", Some(""), &topics);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(
            notes[0].contains("/h10/hr") && notes[0].contains("its type is std_msgs/msg/Float32")
        );
        let unwatched = said("", None, &topics);
        assert_eq!(unwatched.len(), 1, "{unwatched:?}");
        assert!(
            unwatched[0].starts_with("person p001 is present, but the study watches no people")
        );
    }

    #[test]
    fn faces_that_nobody_receives_are_named_once() {
        let topics = [
            ("/humans/faces/a/landmarks", "hri_msgs/msg/FacialLandmarks"),
            ("/humans/faces/b/landmarks", "hri_msgs/msg/FacialLandmarks"),
        ];
        let notes = said("", None, &topics);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].contains("/humans/faces/a/landmarks") && notes[0].contains("\"hri\""));
        let owned = topics.map(|(topic, name)| (topic.to_owned(), name.to_owned())).into();
        assert!(super::notes(&[], &[], &["hri".to_owned()], (&owned, &[])).is_empty());
    }

    #[test]
    fn long_lists_are_shortened() {
        let all: Vec<(String, &str)> =
            (0..500).map(|number| (format!("/turtle{number}/battery"), BATTERY)).collect();
        let topics: Vec<(&str, &str)> = all.iter().map(|(topic, of)| (&**topic, *of)).collect();
        let notes = said("namespace = \"/robot*\"", Some(""), &topics);
        assert_eq!(notes.len(), MOST);
        assert_eq!(notes[MOST - 1], "… and 481 more like these");
    }
}
