//! The topics of which more has become known.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// The topics of which more has become known than their name and type.
#[derive(Debug, Default)]
pub(crate) struct News {
    topics: Mutex<BTreeSet<String>>,
    came: Notify,
}

impl News {
    /// More is known about a topic.
    pub(crate) fn add(&self, topic: &str) {
        self.topics().insert(topic.to_owned());
        self.came.notify_one();
    }

    /// Waits for news; gives the topics.
    pub(super) async fn next(&self) -> BTreeSet<String> {
        self.came.notified().await;
        std::mem::take(&mut *self.topics())
    }

    fn topics(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.topics.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
