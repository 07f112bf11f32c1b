//! The topics with new information.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// The topics with new information beyond their name and type.
#[derive(Debug, Default)]
pub(crate) struct Updates {
    topics: Mutex<BTreeSet<String>>,
    came: Notify,
}

impl Updates {
    /// Records that there is new information about a topic.
    pub(crate) fn add(&self, topic: &str) {
        self.topics().insert(topic.to_owned());
        self.came.notify_one();
    }

    /// Waits for an update; returns the topics.
    pub(super) async fn next(&self) -> BTreeSet<String> {
        self.came.notified().await;
        std::mem::take(&mut *self.topics())
    }

    fn topics(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.topics.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
