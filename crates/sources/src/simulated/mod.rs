//! A simulated team: robots that drive through an arena, discharge, and hear a router more or less
//! well, with faults on request. All of it follows from a seed.
//!
//! The model uses neither ROS nor a clock: [`Team`] takes the time and returns [`Telegram`]s, which
//! [`encode`] turns into messages. [`SimulatedTeam`] holds the settings and builds the source. The people
//! of a team are [`SimulatedPerson`]s, sources of their own.

mod settings;
mod source;
mod team;
mod robot;
mod wanderer;
mod goals;
mod commands;
mod drive;
mod surroundings;
mod arena;
mod odometer;
mod radio;
mod battery;
mod computer;
mod camera;
mod script;
mod topic;
mod report;
mod telegram;
mod published;
mod encode;
mod person;
mod worn;
#[cfg(test)]
mod tests;

pub use encode::encode;
pub use person::SimulatedPerson;
pub use published::Published;
pub use script::{Change, Scene};
pub use settings::SimulatedTeam;
pub use team::Team;
pub use telegram::Telegram;
pub use topic::Topic;
