//! A Myo armband.
//!
//! Based on the manufacturer's header, and on what dl-myo accepts: little endian, although the header says otherwise.

mod armband;
mod peripheral;

pub use armband::{Myo, MyoFault, MyoIncident, MyoSent};
