#![doc = include_str!("../README.md")]
#![cfg_attr(
    test,
    expect(clippy::float_cmp, reason = "tests compare exactly where the arithmetic is exact")
)]

use teampulse_core::feature::Feature;
use teampulse_core::registry::Entry;

use crate::analyses::row;
use crate::context::FeatureContext;

/// Features of any stream with numbers, of people and of robots, one file each.
pub mod any {
    pub mod statistics;
}

/// Features of robots, one file each.
pub mod robots {
    pub mod battery_use;
    pub mod deployment;
    pub mod diagnostics_level;
    pub mod link_quality;
    pub mod numbers;
    pub mod stuck;
}

/// Features of people outside of the table of analyses, one file each.
pub mod people {
    pub mod estimates;
    pub mod input;
    pub mod outages;
    pub mod state;
}

/// Features of the team as a whole, one file each.
pub mod team {
    pub mod attention;
    pub mod interventions;
    pub mod proximity;
}

pub mod context;
pub mod thresholds;
pub mod analyses;
mod analysed;
mod running;
mod over;
mod windows;
mod whole_seconds;
mod value;
mod inputs;
#[cfg(test)]
mod drive;

/// Every feature, by its name in a study.
pub const FEATURES: &[Entry<dyn Feature, FeatureContext>] = &[
    Entry::new::<any::statistics::Statistics>("statistics"),
    Entry::new::<robots::battery_use::BatteryUse>("battery_use"),
    Entry::new::<robots::deployment::Deployment>("deployment"),
    Entry::new::<robots::diagnostics_level::DiagnosticsLevel>("diagnostics_level"),
    Entry::new::<robots::link_quality::LinkQuality>("link_quality"),
    Entry::new::<robots::numbers::Numbers>("numbers"),
    Entry::new::<robots::stuck::Stuck>("stuck"),
    analysed::entry::<{ row("brain") }>(),
    analysed::entry::<{ row("breath") }>(),
    analysed::entry::<{ row("dynamics") }>(),
    analysed::entry::<{ row("expression") }>(),
    analysed::entry::<{ row("face") }>(),
    Entry::new::<people::estimates::Estimates>("estimates"),
    analysed::entry::<{ row("heart") }>(),
    Entry::new::<people::input::Input>("input"),
    analysed::entry::<{ row("intervals") }>(),
    analysed::entry::<{ row("movement") }>(),
    analysed::entry::<{ row("muscle") }>(),
    Entry::new::<people::outages::Outages>("outages"),
    analysed::entry::<{ row("posture") }>(),
    analysed::entry::<{ row("pulse") }>(),
    analysed::entry::<{ row("skin") }>(),
    analysed::entry::<{ row("skin_temperature") }>(),
    Entry::new::<people::state::State>("state"),
    analysed::entry::<{ row("view") }>(),
    analysed::entry::<{ row("voice") }>(),
    Entry::new::<team::attention::Attention>("attention"),
    Entry::new::<team::interventions::Interventions>("interventions"),
    Entry::new::<team::proximity::Proximity>("proximity"),
];
