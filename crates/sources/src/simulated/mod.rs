//! A simulated team, published on ROS as a real one would be: robots, and people who wear sensors and
//! command them. All of it follows from a seed.
//!
//! The models are those of `teampulse_emulators`; this module drives them in real time and turns their output into
//! readings. [`SimulatedTeam`] holds the settings and builds the source of the robots; the people are
//! [`SimulatedPerson`]s, sources of their own.

mod settings;
mod source;
mod published;
mod encode;
mod person;
mod worn;

pub use person::SimulatedPerson;
pub(crate) use published::TRUTH;
pub use settings::SimulatedTeam;
