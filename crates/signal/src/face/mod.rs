//! Blinks, eye closures and head movement, from face landmarks in camera images.
//!
//! ```text
//! points [px] (irregular) ──► opening of the eyes relative to its usual level ──► blinks, closures ──► values of a span
//!                         └─► place, width and tilt of the head ───────────────────────────────────┘
//! ```
//!
//! The opening of an eye is its height divided by its width (Soukupová & Čech, 2016). Its usual value
//! differs between people, cameras and models, so all values are relative to the open-eye level of the last
//! minute.

pub mod analysis;
mod blinks;
mod level;
mod points;
mod store;
mod values;

/// The face in one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    at_ns: i64,
    /// The opening of the eyes relative to open eyes; NaN where unknown.
    open: f64,
    /// The noise of the opening (standard deviation); NaN where unknown.
    noise: f64,
    /// The midpoint between the eyes [px]; NaN without a face.
    place: [f64; 2],
    /// The distance between the eyes [px].
    apart: f64,
    /// The tilt of the head towards its right shoulder [rad].
    tilt: f64,
}
