//! What points of a face in pictures say: how often and how long the eyes close, and how the head moves.
//!
//! ```text
//! points [px] (irregular) ──► opening of the eyes by its own level ──► blinks, closures ──► the values of a span
//!                         └─► place, width and tilt of the head ─────────────────────────┘
//! ```
//!
//! The opening of an eye is its height by its width (Soukupová & Čech, 2016). How high that is differs between people,
//! cameras and models, so that all is relative to the level of the last minute at which the eyes are open.

pub mod analysis;
mod blinks;
mod level;
mod points;
mod store;
mod values;

/// What is seen of a face in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    at_ns: i64,
    /// The opening of the eyes, by that of open ones; NaN where unknown.
    open: f64,
    /// The noise of that (standard deviation); NaN where unknown.
    noise: f64,
    /// The place between the eyes [px]; NaN without a face.
    place: [f64; 2],
    /// The distance between the eyes [px].
    apart: f64,
    /// How far the head is tilted to its right shoulder [rad].
    tilt: f64,
}
