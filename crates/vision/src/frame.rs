//! What a frame of a camera shows without any model: how bright and how sharp it is, how much moves, and where skin is.
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

/// The share of a view that skin must take to be somebody's: less is noise, or wood.
const LEAST_SKIN: f64 = 0.005;
/// How much of the region of skin must have moved lately to be a person's: a picture on a wall has skin, too.
const LEAST_MOVING: f64 = 0.002;
/// How long somebody who sits still is taken to be there [s].
const STILL_SECS: f64 = 20.0;

/// The numbers of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The mean luma [0..1].
    pub brightness: f64,
    /// The variance of the Laplacian of the luma, as a share of the variance of the luma [1]: how much of the contrast
    /// is in details. Lower where the lens is out of focus or the camera moves; it falls with noise removed, too, so that it
    /// is comparable within one camera only. NaN without contrast.
    pub sharpness: f64,
    /// The share of the view that changed since the previous frame, beyond the noise and a change of the light [0..1];
    /// NaN in the first frame, after a change of size, and after a gap.
    pub moving: f64,
    /// The mean change of the luma since the previous frame, less that of the light [0..1]; NaN as above.
    pub motion: f64,
    /// The share of the view in the largest region of the colour of skin [0..1].
    pub skin: f64,
    /// The mean red, green and blue of that region [0..1]; NaN where it is too small.
    pub colour: [f64; 3],
    /// Whether somebody is in view: a region of the colour of skin, in which something moved within 20 s.
    pub is_present: bool,
}

/// The numbers of the frames of one camera, one after the other.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    movement: Movement,
    /// When something moved in the region of skin last [s].
    moved: Option<f64>,
}

impl Frames {
    /// Takes a frame that was taken at a time [s].
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
