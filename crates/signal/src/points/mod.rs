//! Code shared by the analyses of landmarks in images: channel lookup, and speeds.

mod path;
mod place;

pub(crate) use path::{Stay, speed};
pub(crate) use place::{Place, between, middle};

/// The tilt of the line between a person's right and left landmark, positive towards the right shoulder
/// [rad]. If the person faces the camera, their right is on the left of the picture.
pub(crate) fn tilt([right, left]: [[f64; 2]; 2]) -> f64 {
    (right[1] - left[1]).atan2(left[0] - right[0])
}
