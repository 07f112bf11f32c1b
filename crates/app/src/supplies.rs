//! Watches for sources of a study, of any type, that connect but send nothing.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::fault::passing;
use teampulse_core::outlet::{Outlet, Supply};
use teampulse_core::source::{Source, SourceError};
use teampulse_sinks::Unmet;

use crate::required::lacking;
use crate::setup::Sources;

/// The remedy for a source that sends nothing.
const SENDS_NOTHING: &str =
    "switch its device on, check its connection, and close other programs that are connected to it";

/// How long a device may take to appear and to send its first sample: scanning and connecting over Bluetooth take
/// several seconds.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// What each watched source of a study has supplied so far, and its name, by the source's index in the study. Clones
/// share the map.
#[derive(Clone, Default)]
pub struct Supplies(Arc<Mutex<BTreeMap<usize, (String, Supply)>>>);

impl Supplies {
    /// Wraps sources so that they are watched once they run, except those that may be silent.
    pub fn watching(&self, sources: Sources) -> Sources {
        let watched = |(place, (name, source)): (usize, (String, Box<dyn Source>))| {
            let source: Box<dyn Source> = if source.may_be_silent() {
                source
            } else {
                let (name, supplies) = (name.clone(), self.clone());
                Box::new(Watched { place, name, source, supplies, is_reported: false })
            };
            (name, source)
        };
        sources.into_iter().enumerate().map(watched).collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<usize, (String, Supply)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The sources of a study from which a session received nothing.
#[derive(Default)]
pub struct Unsupplied {
    /// Sources whose device could not be opened, with the reason.
    pub unopened: Vec<(String, SourceError)>,
    /// What all other sources supplied.
    pub supplies: Supplies,
}

impl Unsupplied {
    /// Adds these sources to what is missing, unless a source of their type is already among it.
    pub fn added_to(&self, mut missing: Vec<Unmet>) -> Vec<Unmet> {
        let is_named = |missing: &[Unmet], name: &str| {
            missing.iter().any(|each| each.what.starts_with(&format!("{name}:")))
        };
        let by_own_rules = missing.len();
        for (name, error) in &self.unopened {
            if !is_named(&missing, name) {
                missing.push(lacking(format!("{name}: failed to {error}"), error.hint()));
            }
        }
        for (name, supply) in self.supplies.lock().values() {
            let kind = name.split(' ').next().unwrap_or(name);
            let is_of_kind = |each: &Unmet| {
                let rest = each.what.strip_prefix(kind);
                rest.is_some_and(|rest| rest.starts_with([':', ' ']))
            };
            let is_reported =
                missing[..by_own_rules].iter().any(is_of_kind) || is_named(&missing, name);
            if let (Some(lack), false) = (supply.lack(), is_reported) {
                missing.push(lacking(format!("{name}: {lack}"), SENDS_NOTHING));
            }
        }
        missing
    }
}

/// A source that is watched.
struct Watched {
    place: usize,
    name: String,
    source: Box<dyn Source>,
    supplies: Supplies,
    is_reported: bool,
}

#[async_trait]
impl Source for Watched {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        self.supplies.lock().insert(self.place, (self.name.clone(), outlet.supply()));
        let ended = tokio::select! {
            ended = self.source.run(outlet) => ended,
            never = report(&self.name, &mut self.is_reported, outlet) => match never {},
        };
        if matches!(ended, Err(SourceError::Fatal { .. })) {
            // The error reports the source.
            self.supplies.lock().remove(&self.place);
        }
        ended
    }
}

/// Reports once if a source has sent nothing after a while, then waits forever.
async fn report(name: &str, is_reported: &mut bool, outlet: &Outlet) -> Infallible {
    tokio::time::sleep(PATIENCE).await;
    if let (Some(lack), false) = (outlet.supply().lack(), *is_reported) {
        *is_reported = true;
        let secs = PATIENCE.as_secs();
        outlet.happen(passing(format!("{name}: {lack} in {secs} s; {SENDS_NOTHING}")));
    }
    std::future::pending().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_source_that_sends_nothing_is_named_unless_the_rules_of_its_type_named_one() {
        let unsupplied = Unsupplied::default();
        for (place, name) in ["camera p001", "camera p002", "gsr"].into_iter().enumerate() {
            unsupplied.supplies.lock().insert(place, (name.to_owned(), Supply::default()));
        }
        let names = |missing: &[&str]| {
            let missing = missing.iter().map(|what| lacking(*what, "")).collect();
            let all = unsupplied.added_to(missing).into_iter();
            all.map(|each| each.what.split(':').next().unwrap_or("").to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(&[]), ["camera p001", "camera p002", "gsr"]);
        assert_eq!(names(&["gsr 2: not found"]), ["gsr 2", "camera p001", "camera p002"]);
    }
}
