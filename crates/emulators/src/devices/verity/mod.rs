//! A Polar Verity Sense or OH1: an optical sensor on the arm with heart rate, battery and device information, and with
//! pulse wave, intervals between pulses and acceleration over the Polar Measurement Data service.
//!
//! Based on Polar's *Online measurement* specification 1.0 and its SDK's pages on both products, on PPI data and on
//! known issues; bytes that real sensors sent are in issues 226 (PPG), 311 (intervals) and 331 (acceleration) of
//! github.com/polarofficial/polar-ble-sdk. Where these are silent, the choice is documented at its constant. The Verity
//! Sense's gyroscope, magnetometer and SDK mode are not emulated.

mod settings;
mod control;
mod stream;
mod delta;
mod pulses;
mod band;
mod peripheral;

pub use band::Verity;
pub use settings::{VerityFault, VerityIncident, VerityModel, VeritySettings};
