//! What a study requires of the received streams, both for `check` and for a running session.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use teampulse_core::status::StreamStatus;
use teampulse_core::stream::{About, Signal, Stream};
use teampulse_sinks::Unmet;
use teampulse_sources::lsl::Lsl;
use teampulse_sources::robots::{Robots, conformity, norm};
use teampulse_sources::ros_audio::RosAudio;
use teampulse_sources::ros_people::{RosPeople, second_publishers};
use teampulse_sources::topics::Topics;
use teampulse_sources::{biosensors, hri, wearables};

use crate::study::{Study, StudyError};

/// The streams that were received, each with its newest status.
type Received = [(Arc<Stream>, StreamStatus)];

/// The remedy for a robot or a person that is not present.
const ABSENT: &str =
    "Switch it on, and check its network and ROS domain; `teampulse scan` lists what is in range.";

/// The remedy for a stream of LSL that nothing sends.
const NO_SENDER: &str =
    "Start its program, on the same network; `teampulse scan` lists the streams in range.";

/// The remedy for two publishers of one person's topic.
const TWICE: &str =
    "Stop one of the two: a driver was started twice, or one person has two devices.";

/// What a study requires.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// Settings of the sources of robots.
    pub robots: Vec<Robots>,
    /// Settings of the sources of people on ROS.
    pub people: Vec<RosPeople>,
    /// Settings of the microphones on ROS.
    pub voices: Vec<RosAudio>,
    /// Settings of the sources that read topics by name.
    pub topics: Vec<Topics>,
    /// Settings of the sources that read LSL streams.
    pub lsl: Vec<Lsl>,
    /// The types of all sources of the study.
    pub kinds: Vec<String>,
}

impl Requirements {
    /// Reads the requirements of a study.
    pub fn of(study: &Study) -> Result<Requirements, StudyError> {
        Ok(Requirements {
            robots: study.settings_of("sources", "robots")?,
            people: study.settings_of("sources", "people")?,
            voices: study.settings_of("sources", "ros_audio")?,
            topics: study.settings_of("sources", "topics")?,
            lsl: study.settings_of("sources", "lsl")?,
            kinds: study.kinds("sources"),
        })
    }

    /// Returns the sources of robots from which nothing was received.
    pub fn absent_robots(&self, received: &[&Stream]) -> Vec<&Robots> {
        self.robots.iter().filter(|wanted| !is_there(wanted, received)).collect()
    }

    /// Returns the sources of people from which nothing was received.
    pub fn absent_people(&self, received: &[&Stream]) -> Vec<&RosPeople> {
        self.people.iter().filter(|wanted| !are_there(wanted, received)).collect()
    }

    /// Returns the sources of LSL streams from which none was received, each with a remedy. Markers are streams, too,
    /// but have no health status.
    pub fn absent_lsl(&self, raw: &[&Stream]) -> Vec<Unmet> {
        let is_absent = |lsl: &&Lsl| !raw.iter().any(|stream| lsl.is_read(stream));
        let absent = self.lsl.iter().filter(is_absent);
        let queries = absent.filter_map(|lsl| lsl.query().ok());
        queries.map(|query| lacking(no_lsl(&query), NO_SENDER)).collect()
    }

    /// Returns everything that is missing, each with a remedy.
    pub fn missing(&self, received: &Received) -> Vec<Unmet> {
        let streams: Vec<&Stream> = received.iter().map(|(stream, _)| &**stream).collect();
        let mut missing = self.absent(&streams);
        missing.extend(silent_of_robots(&self.robots, received));
        missing.extend(missing_fields(&self.robots, &streams));
        let twice = second_publishers(streams.into_iter());
        missing.extend(twice.into_iter().map(|what| lacking(what, TWICE)));
        missing
    }

    /// Returns the devices, robots and people from which nothing was received, each with a remedy.
    pub fn absent(&self, received: &[&Stream]) -> Vec<Unmet> {
        let (absent, away) = (self.absent_robots(received), self.absent_people(received));
        let is_nobody = absent.len() == self.robots.len() && away.len() == self.people.len();
        let mut missing = missing_robots(&self.robots, received);
        let absent = absent.into_iter().filter(|each| is_nobody || requires(each));
        missing.extend(absent.map(|each| lacking(no_robot(each), ABSENT)));
        missing.extend(unoffered(&self.robots, received));
        let away = away.into_iter().filter(|_| is_nobody);
        missing.extend(away.map(|each| lacking(no_person(each), ABSENT)));
        missing.extend(nothing(&self.kinds, received));
        missing.extend(unpublished(&self.kinds, received));
        missing.extend(unseen(&self.kinds, received));
        missing.extend(unworn(&self.kinds, received));
        missing.extend(unheard(&self.voices, received));
        missing
    }
}

/// Describes something missing, with its remedy.
pub fn lacking(what: impl Into<String>, fix: impl Into<String>) -> Unmet {
    Unmet { what: what.into(), fix: fix.into() }
}

/// Whether any stream of the wanted robots was received.
fn is_there(wanted: &Robots, received: &[&Stream]) -> bool {
    received.iter().any(|stream| is_of(wanted, stream))
}

/// Whether a stream belongs to one of the wanted robots.
fn is_of(wanted: &Robots, stream: &Stream) -> bool {
    stream.about == About::Robot && wanted.describe(stream)
}

/// Returns the sources that require certain topics of their robots.
fn demanding(wanted: &[Robots]) -> impl Iterator<Item = &Robots> {
    wanted.iter().filter(|wanted| !wanted.required.is_empty())
}

/// The message that none of these robots was received.
pub fn no_robot(wanted: &Robots) -> String {
    format!("no robot matches {}", wanted.namespace)
}

/// The message that no LSL stream matches this query.
pub fn no_lsl(query: &str) -> String {
    format!("an LSL stream with {query}")
}

/// Whether any stream of the wanted people was received.
fn are_there(wanted: &RosPeople, received: &[&Stream]) -> bool {
    received.iter().any(|stream| wanted.describe(stream))
}

/// The message that none of these people was received.
pub fn no_person(wanted: &RosPeople) -> String {
    format!("no person matches {}", wanted.namespace.text())
}

/// Reports that no stream was received although the study names topics.
fn nothing(kinds: &[String], received: &[&Stream]) -> Option<Unmet> {
    let by_name = kinds.iter().any(|kind| kind == "topics");
    let is_nothing = by_name && received.is_empty();
    is_nothing.then(|| {
        let what = "no topic of the study is published";
        lacking(what, "Start the nodes that publish them, and check the ROS domain.")
    })
}

/// Reports that no sensor is published although the study reads sensors of other nodes.
fn unpublished(kinds: &[String], received: &[&Stream]) -> Option<Unmet> {
    let is_wanted = kinds.iter().any(|kind| kind == "biosensors");
    let is_nobody = !received.iter().any(|stream| biosensors::is_published(stream));
    (is_wanted && is_nobody).then(|| {
        let what = "no topic /biosensors/<sensor>/<data> is published";
        lacking(what, "Start the nodes that publish them, and check the ROS domain.")
    })
}

/// Reports that nobody is detected although the study receives detections of people from other programs.
fn unseen(kinds: &[String], received: &[&Stream]) -> Option<Unmet> {
    let is_wanted = kinds.iter().any(|kind| kind == "hri");
    let is_nobody = !received.iter().any(|stream| hri::is_seen(stream));
    (is_wanted && is_nobody).then(|| {
        let what = "no face or body of a person of the study is published below /humans";
        lacking(what, "Start the nodes that publish them, stand in front of the camera, and check `face`, `body` and `id`.")
    })
}

/// Reports microphones on ROS that nothing publishes.
fn unheard(voices: &[RosAudio], received: &[&Stream]) -> Vec<Unmet> {
    let is_absent = |voice: &&RosAudio| !received.iter().any(|stream| voice.is_published(stream));
    let absent = voices.iter().filter(is_absent).map(|voice| {
        let what = format!("{}: no audio is published on this topic", voice.topic);
        lacking(what, "Start the node that publishes it, and check the ROS domain.")
    });
    absent.collect()
}

/// Reports devices of the study that send nothing.
fn unworn(kinds: &[String], received: &[&Stream]) -> Vec<Unmet> {
    let devices = wearables::kinds().filter_map(|device| {
        let wanted = kinds.iter().filter(|kind| *kind == device).count();
        let is_of = |stream: &&&Stream| {
            // The link and battery status of a device do not show that it measures.
            let measures = !matches!(stream.signal, Signal::Link | Signal::Battery);
            measures && wearables::kind_of(&stream.device) == Some(device)
        };
        let streams = received.iter().filter(is_of);
        let sensor =
            |stream: &&Stream| (stream.id.clone(), wearables::sensor_of(&stream.device).to_owned());
        let present = streams.map(sensor).collect::<BTreeSet<_>>().len();
        (present < wanted).then(|| {
            let what = format!("{device}: {present} of {wanted} in the study send samples");
            lacking(
                what,
                "Switch it on, put it on, and close other programs that are connected to it.",
            )
        })
    });
    devices.collect()
}

/// Reports fields that the study reads but the topic does not have.
fn missing_fields(wanted: &[Robots], received: &[&Stream]) -> Vec<Unmet> {
    let mut missing = Vec::new();
    let all = wanted.iter().enumerate();
    for (place, field) in all.flat_map(|(place, one)| one.fields().map(move |it| (place, it))) {
        let Some(path) = &field.field else { continue };
        // The first source that takes a topic determines its settings.
        let is_its =
            |stream: &Stream| wanted.iter().position(|one| one.take(stream)) == Some(place);
        let lacks = |stream: &&&Stream| {
            stream.device == field.topic && stream.place_of(path).is_none() && is_its(stream)
        };
        let without = received.iter().filter(lacks);
        missing.extend(without.map(|stream| {
            let what = format!("field `{path}` of {}", stream.name);
            lacking(what, "Name a field of its message type.")
        }));
    }
    missing
}

/// Whether missing robots mean no-go.
fn requires(wanted: &Robots) -> bool {
    !(wanted.required.is_empty() && wanted.robots.is_empty())
}

/// Reports robots that the study names but from which nothing was received.
fn missing_robots(wanted: &[Robots], received: &[&Stream]) -> Vec<Unmet> {
    let is_present = |id: &String| {
        received.iter().any(|stream| stream.about == About::Robot && stream.id == *id)
    };
    let mut named: Vec<&String> = Vec::new();
    for id in wanted.iter().flat_map(|wanted| &wanted.robots) {
        if !named.contains(&id) {
            named.push(id);
        }
    }
    let missing = named.into_iter().filter(|id| !is_present(id));
    missing.map(|id| lacking(format!("robot {id}"), ABSENT)).collect()
}

/// Reports parameters that the study requires of robots but a robot does not offer.
fn unoffered(wanted: &[Robots], received: &[&Stream]) -> Vec<Unmet> {
    const START: &str = "Start the node that publishes it, or remove it from `required`.";
    let mut missing = Vec::new();
    for wanted in demanding(wanted) {
        let mut robots: BTreeMap<&str, BTreeSet<&Signal>> = BTreeMap::new();
        for stream in received.iter().filter(|stream| is_of(wanted, stream)) {
            robots.entry(&stream.id).or_default().insert(&stream.signal);
        }
        for (id, signals) in robots {
            let is_absent = |parameter: &&String| {
                norm(parameter).is_some_and(|norm| !signals.contains(&norm.signal))
            };
            let absent = wanted.required.iter().filter(is_absent);
            missing.extend(absent.map(|it| lacking(format!("{it} of robot {id}"), START)));
        }
    }
    missing
}

/// Reports parameters that the study requires of robots and a robot offers but does not publish.
fn silent_of_robots(wanted: &[Robots], received: &Received) -> Vec<Unmet> {
    const SILENT: &str = "Check the robot's power, its network and the node that publishes it.";
    let mut missing = Vec::new();
    for wanted in demanding(wanted) {
        let of_robots = received.iter().filter(|(stream, _)| is_of(wanted, stream));
        for robot in conformity(of_robots.map(|(stream, status)| (&**stream, status))) {
            let silent = wanted.required.iter().filter(|parameter| robot.is_silent(parameter));
            missing.extend(silent.map(|parameter| {
                let id = &robot.id;
                let what = format!("{parameter} of robot {id}: advertised, but not published");
                lacking(what, SILENT)
            }));
        }
    }
    missing
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use teampulse_core::qos::Qos;
    use teampulse_core::status::State;
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    fn requirements(text: &str) -> Requirements {
        let study = Study::parse(Path::new("study.toml"), text.to_owned()).expect("a study");
        Requirements::of(&study).expect("settings that read")
    }

    fn battery(rate_hz: f64) -> (Arc<Stream>, StreamStatus) {
        let name = "/robot1/battery_state";
        let stream = Stream::raw(name, Subject::robot("robot1"), Shape::Sample);
        let status = StreamStatus {
            name: name.into(),
            state: State::Ok,
            reason: String::new(),
            rate_hz,
            age_secs: 0.0,
            received: 1,
            lost_source: None,
            lost_queue: 0,
            late: 0,
            duplicates: 0,
            clock: 0,
            epoch: 0,
            offset_secs: 0.0,
            skew_ppm: 0.0,
            jitter_secs: 0.0,
            sigma_secs: 0.0,
            latency_secs: 0.0,
        };
        (Arc::new(Stream { signal: Signal::Battery, ..stream }), status)
    }

    #[test]
    fn what_is_required_and_missing_is_named_with_a_remedy() {
        let required = requirements(
            "[[sources]]\ntype = \"robots\"\nnamespace = \"/robot*\"\nrequired = [\"battery\", \"link\"]\n",
        );
        let whats = |received: &Received| -> Vec<String> {
            let missing = required.missing(received);
            assert!(missing.iter().all(|each| !each.fix.is_empty()));
            missing.into_iter().map(|each| each.what).collect()
        };
        assert_eq!(whats(&[]), ["no robot matches /robot*"]);
        assert_eq!(whats(&[battery(1.0)]), ["link of robot robot1"]);
        let silent = "battery of robot robot1: advertised, but not published";
        assert_eq!(whats(&[battery(0.0)]), ["link of robot robot1", silent]);
    }

    #[test]
    fn a_parameter_is_required_of_the_robots_of_its_source_only() {
        let required = requirements(
            "[[sources]]\ntype = \"robots\"\nnamespace = \"/arm*\"\nrequired = [\"link\"]\n\
             [[sources]]\ntype = \"robots\"\nnamespace = \"/robot*\"\n",
        );
        let missing = required.missing(&[battery(0.0)]).into_iter().map(|each| each.what);
        assert!(missing.eq(["no robot matches /arm*"]));
    }

    #[test]
    fn a_robot_that_is_named_twice_is_missed_once() {
        let required = requirements(
            "[[sources]]\ntype = \"robots\"\nnamespace = \"/r*\"\nrobots = [\"r9\", \"r9\"]\n",
        );
        let missing = required.missing(&[battery(1.0)]).into_iter().map(|each| each.what);
        assert!(missing.eq(["robot r9"]));
    }

    #[test]
    fn a_field_is_missing_only_of_the_topics_read_with_its_settings() {
        let field = |namespace: &str, field: &str| {
            format!(
                "[[sources]]\ntype = \"robots\"\nnamespace = \"{namespace}\"\n\
                 numbers = [{{ topic = \"battery_state\", field = \"{field}\" }}]\n"
            )
        };
        let robots = "[[sources]]\ntype = \"robots\"\nnamespace = \"/robot*\"\n";
        let missing = |study: &str| {
            let (stream, status) = battery(1.0);
            let stream = Stream { device: "battery_state".into(), ..Stream::clone(&stream) };
            requirements(study).missing(&[(Arc::new(stream), status)]).len()
        };
        assert_eq!(missing(&field("/robot1", "voltaeg")), 1);
        assert_eq!(missing(&(robots.to_owned() + &field("/robot2", "voltaeg"))), 0);
        assert_eq!(missing(&(robots.to_owned() + &field("/robot1", "voltaeg"))), 0);
        assert_eq!(missing(&(field("/robot1", "voltaeg") + robots)), 1);
    }

    #[test]
    fn wearables_that_other_nodes_are_to_publish_are_missed() {
        let required = requirements("[[sources]]\ntype = \"biosensors\"\nperson = \"p001\"\n");
        let of = |qos: Vec<Qos>| {
            let (stream, status) = battery(1.0);
            let stream = Stream { device: "empatica_e4".into(), qos, ..Stream::clone(&stream) };
            [(Arc::new(stream), status)]
        };
        assert_eq!(required.missing(&[]).len(), 1);
        assert_eq!(required.missing(&of(Vec::new())).len(), 1, "it is read by this computer");
        assert_eq!(required.missing(&of(vec![Qos::reliable(1)])), []);
    }

    #[test]
    fn two_sensors_of_one_person_are_two() {
        let required =
            requirements(&"[[sources]]\ntype = \"polar\"\nperson = \"p001\"\n".repeat(2));
        let of = |device: &str| {
            let (stream, status) = battery(1.0);
            let stream =
                Stream { signal: Signal::Ppg, id: "p001".into(), ..Stream::clone(&stream) };
            (Arc::new(Stream { device: device.into(), ..stream }), status)
        };
        let beats = of("heart_rate_strap_polar_h10");
        assert_eq!(required.missing(&[of("polar_h10"), beats.clone()]).len(), 1);
        assert_eq!(required.missing(&[of("polar_verity_sense"), beats]), []);
    }

    #[test]
    fn people_whom_other_programs_are_to_see_are_missed() {
        let required = requirements("[[sources]]\ntype = \"hri\"\nperson = \"p001\"\n");
        let (stream, status) = battery(1.0);
        let qos = vec![Qos::reliable(1)];
        let seen = |device: &str| {
            let stream =
                Stream { device: device.into(), qos: qos.clone(), ..Stream::clone(&stream) };
            [(Arc::new(stream), status.clone())]
        };
        assert_eq!(required.missing(&[]).len(), 1);
        assert_eq!(required.missing(&seen("hribot")).len(), 1);
        assert_eq!(required.missing(&seen("hri")), []);
        assert_eq!(required.missing(&seen("hri_robot1")), []);
    }

    #[test]
    fn a_study_that_requires_nothing_misses_only_everybody() {
        let required = requirements("[[sources]]\ntype = \"robots\"\nnamespace = \"/robot*\"\n");
        assert_eq!(required.missing(&[]).len(), 1);
        assert_eq!(required.missing(&[battery(0.0)]), []);
    }
}
