//! Measures of a camera frame that need no model: brightness, sharpness, movement and skin.
//!
//! ```text
//! Picture ──► blocks (mean colour of 8 × 8 pixels) ──► brightness · movement · skin ──► Frame
//!        └──► sharpness (of the pixels themselves)
//! ```

mod blocks;
mod movement;
mod sharpness;
mod skin;

use crate::picture::Picture;

use blocks::Blocks;
use movement::Movement;

/// The share of the view that skin must cover to count as a person: less may be noise or wood.
const LEAST_SKIN: f64 = 0.005;
/// The share of the skin region that must have moved recently to count as a person: a picture on a wall shows skin,
/// too.
const LEAST_MOVING: f64 = 0.002;
/// How long a person who sits still is assumed to remain present [s].
const STILL_SECS: f64 = 20.0;

/// The measures of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The mean luma [0..1].
    pub brightness: f64,
    /// The variance of the Laplacian of the luma, divided by the variance of the luma [1]: the share of the contrast in
    /// fine details. It is lower if the lens is out of focus or the camera moves, and depends on the camera's noise
    /// reduction, so it is comparable only within one camera. NaN without contrast.
    pub sharpness: f64,
    /// The share of the view that changed since the previous frame, beyond noise and changes of the light [0..1]; NaN
    /// in the first frame, after a change of size, and after a gap.
    pub moving: f64,
    /// The mean change of the luma since the previous frame, minus the change of the light [0..1]; NaN in the same
    /// cases.
    pub motion: f64,
    /// The share of the view in the largest skin-coloured region [0..1].
    pub skin: f64,
    /// The mean red, green and blue of that region [0..1]; NaN if it is too small.
    pub colour: [f64; 3],
    /// Whether a person is in view: a skin-coloured region in which something moved within 20 s.
    pub is_present: bool,
}

/// Measures the successive frames of one camera.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    movement: Movement,
    /// The last time of movement in the skin region [s].
    moved: Option<f64>,
}

impl Frames {
    /// Measures a frame taken at a time [s].
    pub fn push(&mut self, picture: &Picture, at: f64) -> Frame {
        let blocks = Blocks::of(picture);
        let (moving, motion) = self.movement.push(&blocks, at);
        let skin = skin::largest(&blocks);
        let is_skin = skin.share >= LEAST_SKIN;
        if is_skin && self.movement.share_within(&skin.is_in) >= LEAST_MOVING {
            self.moved = Some(at);
        }
        let is_lately = self.moved.is_some_and(|moved| (0.0..=STILL_SECS).contains(&(at - moved)));
        Frame {
            brightness: blocks.mean_luma(),
            sharpness: sharpness::of(picture),
            moving,
            motion,
            skin: skin.share,
            colour: if is_skin { skin.colour } else { [f64::NAN; 3] },
            is_present: is_skin && is_lately,
        }
    }
}

#[cfg(test)]
mod tests;
