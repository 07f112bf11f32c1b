#![doc = include_str!("../README.md")]

pub mod clock;
pub mod matching;
pub mod align;
mod ticks;

pub use ticks::Ticks;
