#![doc = include_str!("../README.md")]

pub mod clock;
pub mod matching;
pub mod align;
pub mod calibrate;
pub mod join;
mod ticks;

pub use ticks::Ticks;
