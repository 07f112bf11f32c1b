//! Devices at the level of their bytes, worn by any [`Wearer`]: what they answer, what they send, and how they fail.
//!
//! Written from the makers' documents, not from our decoders, which are tested against them. A device has no link and no
//! clock: who holds it carries its bytes and says how late it is.

mod h10;
mod shimmer;

pub use h10::{AttError, Characteristic, Fault, H10, H10Settings, Incident, Sent};
pub use shimmer::{Shimmer, ShimmerFault, ShimmerIncident, ShimmerSettings};

/// Who wears a device: what its sensors meet at any time.
pub trait Wearer {
    /// Between the electrodes on the chest \[µV\].
    fn ecg_uv(&mut self, secs: f64) -> f64;

    /// At the chest, gravity included \[mg\].
    fn acceleration_mg(&mut self, secs: f64) -> [f64; 3];

    /// Light through a finger, from 0 (dark) to 1.
    fn light(&mut self, secs: f64) -> f64;

    /// Conductance of the skin \[µS\].
    fn conductance_us(&mut self, secs: f64) -> f64;

    /// The beats after one moment and up to another \[s\].
    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64>;
}
