use std::sync::{Arc, Mutex, PoisonError};

/// The lines that sinks announce on the terminal, such as the address of a server; shared among clones.
#[derive(Clone, Debug, Default)]
pub struct Announcements(Arc<Mutex<Vec<String>>>);

impl Announcements {
    /// Announces a line: `the dashboard is at http://127.0.0.1:8742/`.
    pub fn add(&self, line: impl Into<String>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(line.into());
    }

    /// Takes the lines that were announced since the last call.
    pub(crate) fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
