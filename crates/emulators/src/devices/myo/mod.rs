//! A Myo armband.
//!
//! Based on its maker's header, and on what dl-myo accepts: little endian, despite the header.

mod armband;
mod peripheral;

pub use armband::{Myo, MyoFault, MyoIncident, MyoSent};
