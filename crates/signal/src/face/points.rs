//! The face landmarks used, identified by channel names: those of `hri_msgs/FacialLandmarks` in lower case,
//! each with `_x`, `_y` [px] and, where known, `_score`.

use crate::points::{Place, between, middle};

/// The eyes, each with the landmark that is its centre if only that is known.
const SIDES: [(&str, &str); 2] = [("right_eye", "right_pupil"), ("left_eye", "left_pupil")];
/// The landmarks of an eye: its corners, then the upper lid from the person's right, then the lower lid.
const OF_EYE: [&str; 6] = ["outside", "inside", "top_1", "top_2", "bottom_1", "bottom_2"];

/// The channel indices of the landmarks of the eyes.
#[derive(Debug)]
pub(super) struct Points {
    eyes: [Eye; 2],
}

/// The eyes in one picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eyes {
    /// Height divided by width, of both eyes or of the one in view; NaN where unknown.
    pub opening: f64,
    /// The centres of the right and the left eye [px]; NaN where unknown.
    pub centres: [[f64; 2]; 2],
}

#[derive(Debug)]
struct Eye {
    /// The landmarks of the eye, as in [`OF_EYE`].
    lids: Option<[Place; 6]>,
    /// The centre of the eye, if only that is known.
    centre: Option<Place>,
}

impl Points {
    /// The landmarks of the eyes in channels with these names; `None` without an eye.
    pub fn of(names: &[&str]) -> Option<Points> {
        let eyes = SIDES.map(|(side, pupil)| Eye::of((side, pupil), names));
        let is_any = eyes.iter().any(|eye| eye.lids.is_some() || eye.centre.is_some());
        is_any.then_some(Points { eyes })
    }

    pub fn eyes(&self, channels: &[f64]) -> Eyes {
        let seen = self.eyes.each_ref().map(|eye| eye.seen(channels));
        let known: Vec<f64> = seen
            .iter()
            .map(|(opening, _)| *opening)
            .filter(|opening| opening.is_finite())
            .collect();
        let opening = known.iter().sum::<f64>() / known.len() as f64;
        Eyes { opening, centres: seen.map(|(_, centre)| centre) }
    }
}

impl Eye {
    fn of((side, pupil): (&str, &str), names: &[&str]) -> Eye {
        let lids: Vec<Place> = OF_EYE
            .iter()
            .filter_map(|point| Place::of(&format!("{side}_{point}"), names))
            .collect();
        let centre = Place::of(side, names).or_else(|| Place::of(pupil, names));
        Eye { lids: lids.try_into().ok(), centre }
    }

    /// The opening of the eye, and its centre.
    fn seen(&self, channels: &[f64]) -> (f64, [f64; 2]) {
        let centre = || self.centre.map_or([f64::NAN; 2], |place| place.at(channels));
        let Some(lids) = self.lids else { return (f64::NAN, centre()) };
        let [outside, inside, tops @ .., bottom_1, bottom_2] = lids.map(|place| place.at(channels));
        let width = between(outside, inside);
        let height = between(middle(tops[0], tops[1]), middle(bottom_1, bottom_2));
        let opening = if width > 0.0 { height / width } else { f64::NAN };
        // A publisher of `FacialLandmarks` may detect only the pupils.
        (opening, if width.is_finite() { middle(outside, inside) } else { centre() })
    }
}
