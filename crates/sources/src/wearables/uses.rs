//! What the wearables of a session use: a port, a server, and names of streams, each by one source only.

use std::sync::{Arc, Mutex, PoisonError};

/// What is in use; clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Uses(Arc<Mutex<Used>>);

#[derive(Debug, Default)]
struct Used {
    things: Vec<String>,
    /// Kinds of devices of which any is taken, each with the person who wears it.
    kinds: Vec<(&'static str, String)>,
}

/// The use of something, until it is dropped.
#[derive(Debug)]
pub(crate) struct Use {
    uses: Uses,
    what: String,
}

impl Uses {
    /// The use of something, and of all that is below it, as `127.0.0.1:28000/9ff167` is below `127.0.0.1:28000`; `None`
    /// if a part of it is in use.
    pub(crate) fn begin(&self, what: impl Into<String>) -> Option<Use> {
        let what = what.into();
        let mut used = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_below = |one: &str, other: &str| {
            one.strip_prefix(other).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if used.things.iter().any(|known| is_below(known, &what) || is_below(&what, known)) {
            return None;
        }
        used.things.push(what.clone());
        Some(Use { uses: self.clone(), what })
    }

    /// Whether nobody else wears any device of a kind, rather than one with an address or a name: it could not be known
    /// who wears which.
    pub(crate) fn takes_any(&self, kind: &'static str, person: &str) -> bool {
        let mut used = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        used.kinds.push((kind, person.to_owned()));
        used.kinds.iter().all(|(other, wearer)| *other != kind || wearer == person)
    }
}

impl Drop for Use {
    fn drop(&mut self) {
        let mut used = self.uses.0.lock().unwrap_or_else(PoisonError::into_inner);
        used.things.retain(|known| *known != self.what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_used_is_used_once_with_all_that_is_below_it() {
        let uses = Uses::default();
        let one = uses.begin("server/a");
        assert!(one.is_some() && uses.begin("server/a").is_none());
        assert!(uses.begin("server").is_none(), "a part of it is in use");
        let other = uses.begin("server/ab");
        assert!(other.is_some());
        drop((one, other));
        let whole = uses.begin("server");
        assert!(whole.is_some() && uses.begin("server/b").is_none());
    }

    #[test]
    fn any_device_of_a_kind_is_of_one_person() {
        let uses = Uses::default();
        assert!(uses.takes_any("polar", "p001") && uses.takes_any("polar", "p001"));
        assert!(uses.takes_any("heart_rate", "p002") && !uses.takes_any("polar", "p002"));
    }
}
