//! A simulated team, published on ROS like a real one: robots, and people who wear sensors and command the robots.
//! Everything is determined by a seed.
//!
//! The models are those of `teampulse_emulators`; this module drives them in real time and turns their output into
//! readings. [`SimulatedTeam`] holds the settings and builds the source of the robots; each person is a separate
//! source, a [`SimulatedPerson`].

mod settings;
mod source;
mod published;
mod encode;
mod person;
mod worn;

pub use person::SimulatedPerson;
pub(crate) use published::TRUTH;
pub use settings::SimulatedTeam;
