//! Devices at the level of their bytes, worn by any [`Wearer`]: what they answer, what they send, and how they fail.
//!
//! The devices are written from the manufacturers' documents, not from teampulse's decoders, which are tested against
//! them. A device has no link and no clock: its owner transports its bytes and sets the time.

mod peripheral;
mod body_wearer;
mod pmd;
mod h10;
mod verity;
mod strap;
mod heart_rate;
mod battery;
mod faults;
mod shimmer;
mod shimmer_gsr;
mod e4;
mod myo;

pub use body_wearer::BodyWearer;
pub use e4::{E4Fault, E4Incident, E4Server};
pub use h10::{Characteristic, Fault, H10, H10Settings, Incident, Sent};
pub use myo::{Myo, MyoFault, MyoIncident, MyoSent};
pub use peripheral::{
    Advertisement, AttError, Entry, Notice, Peripheral, Property, Service, assigned,
};
pub use shimmer::{Shimmer, ShimmerFault, ShimmerIncident, ShimmerSettings};
pub use strap::{Strap, StrapFault, StrapIncident, StrapSettings};
pub use verity::{Verity, VerityFault, VerityIncident, VerityModel, VeritySettings};

/// The wearer of a device: what its sensors measure at any time. The default methods describe a device that is not
/// worn.
pub trait Wearer {
    /// The voltage between the electrodes on the chest \[µV\].
    fn ecg_uv(&mut self, _secs: f64) -> f64 {
        0.0
    }

    /// The acceleration, including gravity \[mg\].
    fn acceleration_mg(&mut self, _secs: f64) -> [f64; 3] {
        [0.0, 0.0, 1000.0]
    }

    /// Light through the skin, from 0 (dark) to 1.
    fn light(&mut self, _secs: f64) -> f64 {
        0.0
    }

    /// Skin conductance \[µS\].
    fn conductance_us(&mut self, _secs: f64) -> f64 {
        0.0
    }

    /// Temperature of the skin \[°C\].
    fn temperature_c(&mut self, _secs: f64) -> f64 {
        20.0
    }

    /// The signals at the eight electrodes of an armband, from -128 to 127.
    fn muscles(&mut self, _secs: f64) -> [f64; 8] {
        [0.0; 8]
    }

    /// The times of the beats after `after_secs` and up to `until_secs` \[s\].
    fn beats(&mut self, _after_secs: f64, _until_secs: f64) -> Vec<f64> {
        Vec::new()
    }
}
