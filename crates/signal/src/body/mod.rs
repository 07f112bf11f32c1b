//! What points of a body in pictures say: how it and its hands move, and how it is held.
//!
//! Places and lengths are by the distance between the shoulders, so that neither the size of a person nor their distance
//! from the camera matters; who turns away from the camera has narrower shoulders, and larger numbers.

pub mod analysis;
mod values;

/// What is seen of a body in a picture; NaN where unknown.
#[derive(Clone, Copy, Debug)]
struct Frame {
    at_ns: i64,
    /// Right and left.
    shoulders: [[f64; 2]; 2],
    hips: [[f64; 2]; 2],
    wrists: [[f64; 2]; 2],
    nose: [f64; 2],
}
