#![doc = include_str!("../README.md")]
#![cfg_attr(
    test,
    expect(clippy::float_cmp, reason = "tests compare exactly where the arithmetic is exact")
)]

use teampulse_core::feature::Feature;
use teampulse_core::registry::Entry;

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

/// Features of people, one file each.
pub mod people {
    pub mod brain;
    pub mod breath;
    pub mod estimates;
    pub mod heart;
    pub mod input;
    pub mod intervals;
    pub mod movement;
    pub mod muscle;
    pub mod outages;
    pub mod pulse;
    pub mod skin;
    pub mod skin_temperature;
    pub mod state;
}

/// Features of the team as a whole, one file each.
pub mod team {
    pub mod attention;
    pub mod interventions;
}

pub mod context;
mod analysed;
mod running;
mod over;
mod windows;
mod whole_seconds;
mod value;
mod inputs;
#[cfg(test)]
mod drive;

/// Every feature, by the name that a study uses.
pub const FEATURES: &[Entry<dyn Feature, FeatureContext>] = &[
    Entry::new::<any::statistics::Statistics>("statistics"),
    Entry::new::<robots::battery_use::BatteryUse>("battery_use"),
    Entry::new::<robots::deployment::Deployment>("deployment"),
    Entry::new::<robots::diagnostics_level::DiagnosticsLevel>("diagnostics_level"),
    Entry::new::<robots::link_quality::LinkQuality>("link_quality"),
    Entry::new::<robots::numbers::Numbers>("numbers"),
    Entry::new::<robots::stuck::Stuck>("stuck"),
    Entry::new::<people::brain::Brain>("brain"),
    Entry::new::<people::breath::Breath>("breath"),
    Entry::new::<people::estimates::Estimates>("estimates"),
    Entry::new::<people::heart::Heart>("heart"),
    Entry::new::<people::input::Input>("input"),
    Entry::new::<people::intervals::Intervals>("intervals"),
    Entry::new::<people::movement::Movement>("movement"),
    Entry::new::<people::muscle::Muscle>("muscle"),
    Entry::new::<people::outages::Outages>("outages"),
    Entry::new::<people::pulse::Pulse>("pulse"),
    Entry::new::<people::skin::Skin>("skin"),
    Entry::new::<people::skin_temperature::SkinTemperature>("skin_temperature"),
    Entry::new::<people::state::State>("state"),
    Entry::new::<team::attention::Attention>("attention"),
    Entry::new::<team::interventions::Interventions>("interventions"),
];
