//! The vocabulary of teampulse: time, streams, samples and data; the traits source, feature and
//! sink; the registry, the pump and the supervisor.

pub mod time;
pub mod clock;
pub mod qos;
pub mod units;
pub mod stream;
pub mod streams;
pub mod data;
pub mod sample;
pub mod status;
pub mod loss;
pub mod clocks;
pub mod computers;
pub mod source;
pub mod outlet;
pub mod feature;
pub mod sink;
pub mod registry;
mod life;
mod track;
mod extractors;
pub mod pump;
pub mod phases;
pub mod alerts;
pub mod reports;
pub mod session;
