//! Posture and movement of the body and hands, from body landmarks in camera images.
//!
//! Positions and lengths are relative to the distance between the shoulders, so that neither body size nor
//! distance from the camera matters. When a person turns away from the camera, their shoulders look
//! narrower and the values become larger.

pub mod analysis;
mod values;

/// The body in one picture; NaN where unknown.
#[derive(Clone, Copy, Debug)]
struct Frame {
    at_ns: i64,
    /// The right and the left shoulder.
    shoulders: [[f64; 2]; 2],
    hips: [[f64; 2]; 2],
    wrists: [[f64; 2]; 2],
    nose: [f64; 2],
}
