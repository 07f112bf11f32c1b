//! Wakes the thread that watches a domain.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A wake-up flag for one thread; several wake-ups before the thread checks count as one.
#[derive(Debug, Default)]
pub(super) struct Wake {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    woken: bool,
    ended: bool,
}

impl Wake {
    /// Wakes the thread.
    pub(super) fn wake(&self) {
        self.lock().woken = true;
        self.changed.notify_one();
    }

    /// Wakes the thread for the last time.
    pub(super) fn end(&self) {
        self.lock().ended = true;
        self.changed.notify_one();
    }

    /// Waits for a wake-up, at most for `patience`. Returns whether to continue.
    pub(super) fn wait(&self, patience: Duration) -> bool {
        let quiet = |state: &mut State| !state.woken && !state.ended;
        let waited = self.changed.wait_timeout_while(self.lock(), patience, quiet);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.woken = false;
        !state.ended
    }

    /// Waits for `pause`, so that a burst of changes is handled together; returns early at the end.
    pub(super) fn pause(&self, pause: Duration) {
        let going = |state: &mut State| !state.ended;
        // The next `wait` notices the end.
        drop(self.changed.wait_timeout_while(self.lock(), pause, going));
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
