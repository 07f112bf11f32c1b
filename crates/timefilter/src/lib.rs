#![doc = include_str!("../README.md")]

mod host;
mod ticks;

pub use host::{Corrected, Host, Stamps};
pub use ticks::Ticks;
