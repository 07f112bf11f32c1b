//! Phases of a study, at times set beforehand.

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::EventKind;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};

use super::happen;

/// How often the session's clock is looked at; a phase begins this late at most.
const LOOK: Duration = Duration::from_millis(20);

/// A phase of a study. The one named `baseline` is the reference for everything after it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// What it is called.
    pub name: String,
    /// When it begins, after the start of the session [s].
    pub from_secs: f64,
    /// When it ends [s]; without it at the beginning of the next phase, or with the session.
    pub to_secs: Option<f64>,
}

/// The phases of a study, told as events when they begin.
pub struct Phases {
    phases: Vec<Phase>,
    started: Option<teampulse_core::time::Time>,
}

impl Phases {
    /// These phases, in any order.
    pub fn new(mut phases: Vec<Phase>) -> Phases {
        phases.sort_by(|a, b| a.from_secs.total_cmp(&b.from_secs));
        Phases { phases, started: None }
    }
}

#[async_trait]
impl Source for Phases {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let started = *self.started.get_or_insert_with(|| outlet.clock().now());
        for phase in self.phases.drain(..) {
            while outlet.clock().now().secs_since(started) < phase.from_secs {
                tokio::select! {
                    () = tokio::time::sleep(LOOK) => {}
                    () = outlet.closed() => return Ok(()),
                }
            }
            let duration_secs = phase.to_secs.map_or(f64::NAN, |to_secs| to_secs - phase.from_secs);
            happen(outlet, EventKind::Phase, &phase.name, duration_secs);
        }
        outlet.closed().await;
        Ok(())
    }
}
