//! Topics named in a study that no robot has, reported once the robots have been present for a while.

use std::convert::Infallible;

use teampulse_core::outlet::Outlet;
use tokio::sync::Notify;

use super::Robots;
use crate::expected::Expected;

/// The topics named in a study and not discovered so far, expected once a robot is present.
pub(super) struct Awaited {
    topics: Expected,
    /// Notified when the first topic of a robot was found.
    found: Notify,
}

impl Awaited {
    pub(super) fn new(robots: &Robots) -> Awaited {
        let namespace = &robots.namespace;
        let named = robots.named().into_iter();
        let topics =
            named.map(|(setting, topic)| (topic.to_owned(), unheard(setting, namespace, topic)));
        Awaited { topics: Expected::new(topics), found: Notify::new() }
    }

    /// Records a discovered topic, by its name relative to the robot.
    pub(super) fn see(&self, topic: &str) {
        self.topics.see(topic);
        self.found.notify_one();
    }

    /// Reports missing topics some time after the first robot was discovered, then waits forever. Without a
    /// robot nothing is missing.
    pub(super) async fn report(&self, outlet: &Outlet) -> Infallible {
        self.found.notified().await;
        self.topics.report(outlet).await
    }
}

/// The message that no robot has a topic named in the study.
pub fn unheard(setting: &str, namespace: &str, topic: &str) -> String {
    format!("{setting}: no robot of {namespace} has a topic `{topic}`")
}

#[cfg(test)]
mod tests {
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
            awaited.see(topic);
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

    #[tokio::test(start_paused = true)]
    async fn nothing_is_expected_without_a_robot() {
        let awaited = awaited();
        let long = std::time::Duration::from_secs(1000);
        let found = tokio::time::timeout(long, awaited.found.notified());
        assert!(found.await.is_err());
    }
}
