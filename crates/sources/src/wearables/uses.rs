//! What the wearables of a session use, each by one source only: ports, servers and stream names.

use std::sync::{Arc, Mutex, PoisonError};

use super::{heart_rate, is_strap};

/// The resources in use; clones share them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Uses(Arc<Mutex<Used>>);

#[derive(Debug, Default)]
struct Used {
    things: Vec<String>,
    /// The kinds of devices of which any is taken, each with the person who wears it.
    kinds: Vec<(&'static str, String)>,
}

/// The use of a resource, until it is dropped.
#[derive(Debug)]
pub(crate) struct Use {
    uses: Uses,
    what: String,
}

impl Uses {
    /// Begins the use of a resource and of everything below it, as `127.0.0.1:28000/9ff167` is below `127.0.0.1:28000`;
    /// `None` if any part of it is in use.
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

    /// Takes any device of a kind, rather than one with an address or a name; returns the rival if another source could
    /// take the same device.
    pub(crate) fn take_any(&self, kind: &'static str, person: &str) -> Result<(), Rival> {
        let mut used = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let rival = used.kinds.iter().find(|(other, wearer)| {
            // A source for any strap could also take a Polar, and the straps of one person can't be distinguished.
            let is_any_strap = [*other, kind].contains(&heart_rate::KIND);
            is_any_strap && is_strap(other) && is_strap(kind) || *other == kind && wearer != person
        });
        let rival = rival.cloned();
        used.kinds.push((kind, person.to_owned()));
        rival.map_or(Ok(()), |(kind, person)| Err(Rival { kind, person }))
    }
}

/// Another source that could take the same device.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Rival {
    /// The kind of the other source.
    pub(crate) kind: &'static str,
    /// The person who wears that source's device.
    pub(crate) person: String,
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
        assert!(uses.take_any("polar", "p001").is_ok() && uses.take_any("polar", "p001").is_ok());
        let rival = Rival { kind: "polar", person: "p001".into() };
        assert_eq!(uses.take_any("polar", "p002"), Err(rival));
        assert!(uses.take_any("myo", "p002").is_ok());
    }

    #[test]
    fn a_strap_is_taken_by_one_source() {
        for (first, second) in
            [("polar", "heart_rate"), ("heart_rate", "polar"), ("heart_rate", "heart_rate")]
        {
            let uses = Uses::default();
            assert!(uses.take_any(first, "p001").is_ok());
            assert!(uses.take_any(second, "p001").is_err(), "{first} {second}");
        }
    }
}
