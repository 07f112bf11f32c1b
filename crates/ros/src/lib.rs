#![doc = include_str!("../README.md")]

pub mod bus;
pub mod graph;
pub mod offer;
pub mod losses;
pub mod clocks;
mod runs;
pub mod receiving;
pub mod memory;
pub mod cyclone;
mod definitions;
pub mod environment;
pub mod buses;
mod bus_id;
pub mod sink;
mod privacy;
pub mod diagnostics;

pub use bus_id::BusId;

/// The table of the kinds of buses that a study can name.
pub const BUSES: &[buses::BusKind] = &[cyclone::DDS];
