//! A Myo armband.
//!
//! From its maker's header, and from what dl-myo accepts: little endian, whatever the header says.

mod armband;
mod peripheral;

pub use armband::{Myo, MyoFault, MyoIncident, MyoSent};
