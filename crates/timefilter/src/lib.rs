#![doc = include_str!("../README.md")]

pub mod clock;
pub mod matching;
pub mod align;
pub mod calibrate;
mod ticks;

pub use ticks::Ticks;
