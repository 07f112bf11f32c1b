//! The vocabulary of teampulse: time, streams, samples and data; the traits source, feature and
//! sink; the registry, the pump and the supervisor.

pub mod time;
pub mod text;
pub mod private;
pub mod spill;
pub mod clock;
pub mod qos;
pub mod units;
pub mod stream;
pub mod streams;
pub mod pattern;
pub mod data;
pub mod sample;
pub mod status;
pub mod loss;
pub mod clocks;
pub mod computers;
mod publishers;
pub mod source;
pub mod outlet;
pub mod feature;
pub mod sink;
pub mod registry;
mod life;
mod intake;
mod density;
mod track;
mod standstill;
mod extractors;
pub mod pump;
pub mod phases;
pub mod alerts;
pub mod fault;
pub mod panics;
pub mod reports;
pub mod session;
pub mod session_streams;
