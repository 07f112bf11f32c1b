//! Topics that a study names but nothing publishes, reported once after a while.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;

/// How long the topics may take to be discovered.
const PATIENCE: Duration = Duration::from_secs(10);

/// The topics that have not been discovered, each with the message that reports it.
pub(crate) struct Expected(Mutex<BTreeMap<String, String>>);

impl Expected {
    /// Expects these topics, each with the message that reports its absence.
    pub(crate) fn new(topics: impl Iterator<Item = (String, String)>) -> Expected {
        Expected(Mutex::new(topics.collect()))
    }

    /// Records that a topic is published, whichever source receives it.
    pub(crate) fn see(&self, topic: &str) {
        self.lock().remove(topic);
    }

    /// Reports absent topics after a while, once, then waits forever.
    pub(crate) async fn report(&self, outlet: &Outlet) -> Infallible {
        for absent in self.absent().await {
            outlet.happen(passing(absent));
        }
        std::future::pending().await
    }

    /// Waits a while, then returns the messages about topics that are still absent, in the order of the topics.
    pub(crate) async fn absent(&self) -> Vec<String> {
        tokio::time::sleep(PATIENCE).await;
        std::mem::take(&mut *self.lock()).into_values().collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn topics_that_nothing_publishes_are_reported_once_after_a_while() {
        let topics =
            ["/tf", "/truth", "/map"].map(|topic| (topic.to_owned(), format!("no {topic}")));
        let expected = Expected::new(topics.into_iter());
        let (absent, ()) = tokio::join!(expected.absent(), async {
            tokio::time::sleep(PATIENCE / 2).await;
            expected.see("/tf");
            expected.see("/other");
        });
        assert_eq!(absent, ["no /map", "no /truth"]);
        assert_eq!(expected.absent().await, [""; 0], "they are reported once");
    }
}
