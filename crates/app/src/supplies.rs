//! Sources of a study that connect and send nothing, of whatever type.

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

/// How long a device may take to appear and to send its first sample: a scan and a connection of Bluetooth take several
/// seconds.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// What the sources of a study have supplied so far, by their names; clones share it.
#[derive(Clone, Default)]
pub struct Supplies(Arc<Mutex<BTreeMap<String, Supply>>>);

impl Supplies {
    /// The same sources, watched once they run, but for those that may be silent.
    pub fn watching(&self, sources: Sources) -> Sources {
        let watched = |(name, source): (String, Box<dyn Source>)| {
            let source: Box<dyn Source> = if source.may_be_silent() {
                source
            } else {
                let (name, supplies) = (name.clone(), self.clone());
                Box::new(Watched { name, source, supplies, is_reported: false })
            };
            (name, source)
        };
        sources.into_iter().map(watched).collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Supply>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The sources of a study from which a session received nothing.
pub struct Unsupplied {
    /// Those whose device could not be opened, with the reason.
    pub unopened: Vec<(String, SourceError)>,
    /// What the others supplied.
    pub supplies: Supplies,
}

impl Unsupplied {
    /// Adds them to what is missing, unless those of their type are among it.
    pub fn added_to(&self, mut missing: Vec<Unmet>) -> Vec<Unmet> {
        for (name, error) in &self.unopened {
            if !missing.iter().any(|each| each.what.starts_with(&format!("{name}:"))) {
                missing.push(lacking(format!("{name}: failed to {error}"), error.hint()));
            }
        }
        for (name, supply) in self.supplies.lock().iter() {
            let kind = name.split(' ').next().unwrap_or(name);
            let is_of_kind = |each: &Unmet| {
                let rest = each.what.strip_prefix(kind);
                rest.is_some_and(|rest| rest.starts_with([':', ' ']))
            };
            if let (Some(lack), false) = (supply.lack(), missing.iter().any(is_of_kind)) {
                missing.push(lacking(format!("{name}: {lack}"), SENDS_NOTHING));
            }
        }
        missing
    }
}

/// A source that is watched.
struct Watched {
    name: String,
    source: Box<dyn Source>,
    supplies: Supplies,
    is_reported: bool,
}

#[async_trait]
impl Source for Watched {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        self.supplies.lock().insert(self.name.clone(), outlet.supply());
        let ended = tokio::select! {
            ended = self.source.run(outlet) => ended,
            never = report(&self.name, &mut self.is_reported, outlet) => match never {},
        };
        if matches!(ended, Err(SourceError::Fatal { .. })) {
            // It is reported by its error.
            self.supplies.lock().remove(&self.name);
        }
        ended
    }
}

/// Reports once that nothing has come from a source after a while, then waits forever.
async fn report(name: &str, is_reported: &mut bool, outlet: &Outlet) -> Infallible {
    tokio::time::sleep(PATIENCE).await;
    if let (Some(lack), false) = (outlet.supply().lack(), *is_reported) {
        *is_reported = true;
        let secs = PATIENCE.as_secs();
        outlet.happen(passing(format!("{name}: {lack} in {secs} s; {SENDS_NOTHING}")));
    }
    std::future::pending().await
}
