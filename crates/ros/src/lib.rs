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
pub mod sink;
mod privacy;
pub mod diagnostics;
