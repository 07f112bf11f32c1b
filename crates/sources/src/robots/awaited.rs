//! Robots and topics that a study names but that are missing. Robots are reported after a while, topics once robots
//! have been present for a while.

use std::convert::Infallible;

use teampulse_core::outlet::Outlet;
use teampulse_core::stream::Stream;
use tokio::sync::Notify;

use super::Robots;
use crate::expected::Expected;

/// Stands for any robot among the expected ones; no robot has this id.
const ANY: &str = "*";

/// The robots and topics that a study names and that have not been discovered so far.
pub(super) struct Awaited {
    /// The expected robots, by their ids.
    robots: Expected,
    /// The expected topics, reported only once a robot is present.
    topics: Expected,
    /// Notified when the first topic of a robot is found.
    found: Notify,
}

impl Awaited {
    pub(super) fn new(robots: &Robots) -> Awaited {
        let namespace = &robots.namespace;
        let named = robots.named().into_iter();
        let topics =
            named.map(|(setting, topic)| (topic.to_owned(), unheard(setting, namespace, topic)));
        let (absent, topics) = (absent(robots).into_iter(), Expected::new(topics));
        Awaited { robots: Expected::new(absent), topics, found: Notify::new() }
    }

    /// Records that a topic was discovered, by its stream.
    pub(super) fn see(&self, stream: &Stream) {
        self.robots.see(ANY);
        self.robots.see(&stream.id);
        self.topics.see(&stream.device);
        self.found.notify_one();
    }

    /// Reports missing robots after a while, and missing topics a while after the first robot was discovered; then
    /// waits forever. Without a robot no topic is reported as missing.
    pub(super) async fn report(&self, outlet: &Outlet) -> Infallible {
        let topics = async {
            self.found.notified().await;
            self.topics.report(outlet).await
        };
        tokio::join!(self.robots.report(outlet), topics).0
    }
}

/// Returns the ids of the robots that must be present, each with the message that reports its absence; `ANY` if topics
/// are required and no robot is named.
fn absent(robots: &Robots) -> Vec<(String, String)> {
    let named =
        robots.robots.iter().map(|id| (id.clone(), has_not_appeared(&format!("robot {id}"))));
    let named: Vec<_> = named.collect();
    if !named.is_empty() || robots.required.is_empty() {
        return named;
    }
    let none = format!(
        "no robot matching {} has appeared: is one switched on, and in the same network and ROS domain?",
        robots.namespace
    );
    vec![(ANY.to_owned(), none)]
}

fn has_not_appeared(who: &str) -> String {
    format!("{who} has not appeared: is it switched on, and in the same network and ROS domain?")
}

/// Returns the message that no robot has a topic named in the study.
pub fn unheard(setting: &str, namespace: &str, topic: &str) -> String {
    format!("{setting}: no robot of {namespace} has a topic `{topic}`")
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Shape, Subject};

    use super::*;

    const NAMED: &str = r#"
        namespace = "/robot*"
        images  = ["camera/image", "front/image"]
        numbers = [{ topic = "arm", field = "data" }]
        battery = { topic = "power" }
        topics  = ["scan", "front/*", "/map"]
    "#;

    fn awaited() -> Awaited {
        Awaited::new(&toml::from_str(NAMED).expect("settings"))
    }

    #[tokio::test(start_paused = true)]
    async fn named_topics_that_no_robot_has_are_absent() {
        let awaited = awaited();
        for topic in ["odom", "front/image", "power", "scan"] {
            awaited.topics.see(topic);
        }
        assert_eq!(
            awaited.topics.absent().await,
            [
                "numbers: no robot of /robot* has a topic `arm`",
                "images: no robot of /robot* has a topic `camera/image`",
                "topics: no robot of /robot* has a topic `map`"
            ]
        );
    }

    async fn absent(named: &str, present: &[&str]) -> Vec<String> {
        let awaited = Awaited::new(&toml::from_str(named).expect("settings"));
        for name in present {
            let (_, rest) = name.split_once('/').expect("it begins with a slash");
            let (id, _) = rest.split_once('/').expect("it has a topic");
            awaited.see(&Stream::raw(*name, Subject::robot(id), Shape::Event));
        }
        awaited.robots.absent().await
    }

    #[tokio::test(start_paused = true)]
    async fn robots_that_must_be_present_are_reported_when_they_are_not() {
        let named = r#"namespace = "/robot*"
            robots = ["robot1", "robot2"]
            required = ["battery"]"#;
        let message = "robot robot2 has not appeared: is it switched on, and in the same network and ROS domain?";
        assert_eq!(absent(named, &["/robot1/odom", "/robot3/odom"]).await, [message]);
        let any = r#"namespace = "/robot*"
            required = ["battery"]"#;
        let message = "no robot matching /robot* has appeared: is one switched on, and in the same network and ROS domain?";
        assert_eq!(absent(any, &[]).await, [message]);
        assert_eq!(absent(any, &["/robot7/odom"]).await, [""; 0]);
        assert_eq!(absent("", &[]).await, [""; 0]);
    }

    #[tokio::test(start_paused = true)]
    async fn nothing_is_expected_without_a_robot() {
        let awaited = awaited();
        let long = std::time::Duration::from_secs(1000);
        let found = tokio::time::timeout(long, awaited.found.notified());
        assert!(found.await.is_err());
    }
}
