//! Topics named in a study that no robot has, reported once the robots have been present for a while.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use tokio::sync::Notify;

use super::Robots;

/// How long after a robot's first topic its others must be discovered.
const PATIENCE: Duration = Duration::from_secs(10);

/// The topics named in a study and not discovered so far.
pub(super) struct Awaited {
    namespace: String,
    /// The setting that names each topic.
    missing: Mutex<BTreeMap<String, &'static str>>,
    /// Notified when the first topic of a robot was found.
    found: Notify,
}

impl Awaited {
    pub(super) fn new(robots: &Robots) -> Awaited {
        let named = robots.named().into_iter().map(|(setting, topic)| (topic.to_owned(), setting));
        Awaited {
            namespace: robots.namespace.clone(),
            missing: Mutex::new(named.collect()),
            found: Notify::new(),
        }
    }

    /// Records a discovered topic, by its name relative to the robot.
    pub(super) fn see(&self, topic: &str) {
        self.missing().remove(topic);
        self.found.notify_one();
    }

    /// Reports missing topics some time after the first robot was discovered, then waits forever. Without a
    /// robot nothing is missing.
    pub(super) async fn report(&self, outlet: &Outlet) -> Infallible {
        for absent in self.absent().await {
            outlet.happen(passing(absent));
        }
        std::future::pending().await
    }

    /// The topics missing some time after the first robot was discovered.
    async fn absent(&self) -> Vec<String> {
        self.found.notified().await;
        tokio::time::sleep(PATIENCE).await;
        let missing = std::mem::take(&mut *self.missing()).into_iter();
        missing.map(|(topic, setting)| unheard(setting, &self.namespace, &topic)).collect()
    }

    fn missing(&self) -> MutexGuard<'_, BTreeMap<String, &'static str>> {
        self.missing.lock().unwrap_or_else(PoisonError::into_inner)
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
    async fn named_topics_that_no_robot_has_are_said_a_while_after_the_first_was_found() {
        let awaited = awaited();
        let topics = async {
            awaited.see("odom");
            tokio::time::sleep(PATIENCE / 2).await;
            awaited.see("front/image");
            awaited.see("power");
            awaited.see("scan");
        };
        let (absent, ()) = tokio::join!(awaited.absent(), topics);
        assert_eq!(
            absent,
            [
                "numbers: no robot of /robot* has a topic `arm`",
                "images: no robot of /robot* has a topic `camera/image`",
                "topics: no robot of /robot* has a topic `map`"
            ]
        );
    }

    #[tokio::test(start_paused = true)]
    async fn without_a_robot_nothing_is_said_of_its_topics() {
        let awaited = awaited();
        let long = tokio::time::sleep(PATIENCE * 100);
        tokio::select! {
            absent = awaited.absent() => panic!("{absent:?}"),
            () = long => {}
        }
    }
}
