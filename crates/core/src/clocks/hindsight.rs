//! The stamps of a whole recording, for corrections that use earlier and later stamps.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_timefilter::clock::{Smoother, Stamps};

use super::owner::Owner;

/// The stamps of a whole recording, by clock; clones share them.
#[derive(Clone, Default)]
pub struct Hindsight(Arc<Mutex<BTreeMap<Owner, Smoother>>>);

impl Hindsight {
    /// Whether it contains no stamps.
    pub fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }

    pub(super) fn begin(&self, owner: &Owner, smoother: Option<Smoother>) {
        if let Some(smoother) = smoother {
            self.lock().entry(owner.clone()).or_insert(smoother);
        }
    }

    pub(super) fn push(&self, owner: &Owner, stamps: &Stamps) {
        if let Some(smoother) = self.lock().get_mut(owner) {
            smoother.push(stamps);
        }
    }

    pub(super) fn take(&self, owner: &Owner) -> Option<Smoother> {
        self.lock().remove(owner)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Owner, Smoother>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
