//! The ROS buses.

pub mod bus;
pub mod graph;
