//! Notes on topics that the study names but nothing publishes.

use std::collections::BTreeSet;

use teampulse_core::stream::{About, Stream};
use teampulse_sources::robots::{Robots, unheard};
use teampulse_sources::topics::{Topics, unpublished};

/// Returns a note on each topic that the study names for robots but no present robot has.
pub fn notes<'a>(
    wanted: &[Robots],
    streams: impl Iterator<Item = &'a Stream> + Clone,
) -> Vec<String> {
    let of_robots = streams.filter(|stream| stream.about == About::Robot);
    let notes = wanted.iter().flat_map(|robots| {
        let theirs: Vec<&Stream> =
            of_robots.clone().filter(|stream| robots.describe(stream)).collect();
        let named = if theirs.is_empty() { Vec::new() } else { topics(robots) };
        let is_unheard =
            move |(_, topic): &(_, &str)| !theirs.iter().any(|stream| stream.device == *topic);
        named
            .into_iter()
            .filter(is_unheard)
            .map(|(setting, topic)| unheard(setting, &robots.namespace, topic))
    });
    notes.collect()
}

/// Returns a note on each topic that sources of type `topics` name in full but nothing publishes.
pub fn unpublished_topics<'a>(
    wanted: &[Topics],
    streams: impl Iterator<Item = &'a Stream>,
) -> Vec<String> {
    let received: BTreeSet<&str> = streams.map(|stream| stream.name.as_str()).collect();
    let named = wanted.iter().flat_map(Topics::named);
    named.filter(|topic| !received.contains(topic)).map(unpublished).collect()
}

/// Returns the topics named in the settings, each with the name of its setting.
fn topics(robots: &Robots) -> Vec<(&'static str, &str)> {
    let commands = robots.commands.iter().map(|topic| ("commands", topic.as_str()));
    robots.named().into_iter().chain(commands).collect()
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    #[test]
    fn a_topic_that_no_robot_has_is_named() {
        let settings = "namespace = \"/robot*\"\nimages = [\"camera/image\", \"front/image\"]\n\
                        commands = [\"gaol_pose\"]\nnumbers = [{ topic = \"arm\", field = \"data\" }]";
        let wanted: Robots = toml::from_str(settings).expect("settings");
        let stream = |topic: &str| Stream {
            device: topic.to_owned(),
            ..Stream::raw(format!("/robot1/{topic}"), Subject::robot("robot1"), Shape::Sample)
        };
        let heard = [stream("front/image"), stream("arm")];
        let said = notes(&[wanted], heard.iter());
        assert_eq!(
            said,
            [
                "images: no robot of /robot* has a topic `camera/image`",
                "commands: no robot of /robot* has a topic `gaol_pose`"
            ]
        );
    }

    #[test]
    fn a_topic_named_in_full_that_nothing_publishes_is_named() {
        let names = "names = [\"/truth/robot1\", \"/truht/robot2\", \"/map*\"]";
        let wanted: Topics = toml::from_str(names).expect("settings");
        let heard = Stream::raw("/truth/robot1", Subject::session(), Shape::Sample);
        let said = unpublished_topics(&[wanted], [&heard].into_iter());
        assert_eq!(said, ["topics: nothing publishes `/truht/robot2`"]);
    }

    #[test]
    fn without_a_robot_its_topics_are_not_reported() {
        let wanted: Robots = toml::from_str("images = [\"camera\"]").expect("settings");
        assert_eq!(notes(&[wanted], [].into_iter()), Vec::<String>::new());
    }
}
