#![doc = include_str!("../README.md")]

pub mod bus;
pub mod graph;
pub mod offer;
pub mod memory;
