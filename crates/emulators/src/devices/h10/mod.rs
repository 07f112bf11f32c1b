//! A Polar H10: heart rate, battery, device information, and the Polar Measurement Data service.
//!
//! Based on Polar's *Online measurement* specification 1.0 and known issues, and on what independent clients
//! (bleakheart, polar-python) accept. Where the documents are silent, the choice is documented at its constant.

mod control;
mod stream;
mod settings;
mod characteristic;
mod strap;
mod peripheral;

pub use characteristic::Characteristic;
pub(super) use peripheral::SERVICES;
pub use settings::{Fault, H10Settings, Incident};
pub use strap::{H10, Sent};
