#![doc = include_str!("../README.md")]

mod session;
mod output;
mod reading;
mod error;
pub mod gatt;
pub mod heart_rate;
pub mod polar;
pub mod empatica_e4;
pub mod shimmer3;
pub mod myo;
pub mod lsl;
pub mod inputs;
pub mod camera;
mod standard;
mod cursor;
mod outbox;
mod watchdog;

pub use error::{DecodeError, Error};
pub use output::{Event, Identity, Output};
pub use reading::{Channel, Reading, Stream};
pub use session::{ByteSession, GattSession, Session};
