//! The electrocardiogram: five waves in each cardiac cycle.

use std::f64::consts::TAU;

use super::heart::{Origin, Place};

/// A wave of the cardiac cycle, which is a Gaussian.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// The position in the cycle, from the R wave [rad].
    angle: f64,
    /// The width [rad].
    width: f64,
    /// The height, as a multiple of the R wave's height.
    height: f64,
    /// How the position moves away from the R wave as the heart beats faster.
    moves: Moves,
}

/// Whether a wave moves in proportion to √(heart rate / 60 per minute), or to the root of that.
#[derive(Clone, Copy, Debug)]
enum Moves {
    Near,
    Far,
}

const fn wave(degrees: f64, width: f64, height: f64, moves: Moves) -> Wave {
    Wave { angle: degrees * TAU / 360.0, width, height, moves }
}

/// P, Q, R, S and T waves of McSharry et al. (2003), doi:10.1109/TBME.2003.808805, table I, in closed form: in their
/// differential equation a wave has the height a·b².
const SINUS: [Wave; 5] = [
    wave(-70.0, 0.25, 0.25, Moves::Far),
    wave(-15.0, 0.1, -0.17, Moves::Near),
    wave(0.0, 0.1, 1.0, Moves::Near),
    wave(15.0, 0.1, -0.25, Moves::Near),
    wave(100.0, 0.4, 0.4, Moves::Far),
];
/// The waves of a ventricular beat, which is high and wide, has no P wave, and whose T wave points downwards.
const VENTRICLE: [Wave; 3] = [
    wave(0.0, 0.22, 1.3, Moves::Near),
    wave(45.0, 0.25, -0.4, Moves::Near),
    wave(110.0, 0.45, -0.4, Moves::Far),
];
/// The distance, in widths, beyond which a wave is zero.
const REACH: f64 = 6.0;

/// Returns the electrocardiogram at a position in the cycle, as a multiple of the R wave's height.
pub fn electrocardiogram(place: Place) -> f64 {
    let near = place.rate_hz.sqrt();
    let stretch = Stretch { near, far: near.sqrt() };
    let sum = |origin: Origin, angle: f64| -> f64 {
        waves(origin).iter().map(|wave| wave.at(angle, stretch)).sum()
    };
    sum(place.last, place.angle) + sum(place.next, place.angle - TAU)
}

fn waves(origin: Origin) -> &'static [Wave] {
    match origin {
        Origin::Sinus => &SINUS,
        Origin::Ventricle => &VENTRICLE,
    }
}

/// The factors by which waves are wider and farther from the R wave than at 60 beats per minute.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    near: f64,
    far: f64,
}

impl Wave {
    fn at(&self, angle: f64, stretch: Stretch) -> f64 {
        let place = match self.moves {
            Moves::Near => self.angle * stretch.near,
            Moves::Far => self.angle * stretch.far,
        };
        let widths = (angle - place) / (self.width * stretch.near);
        if widths.abs() > REACH { 0.0 } else { self.height * (-0.5 * widths * widths).exp() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64, last: Origin, next: Origin) -> f64 {
        electrocardiogram(Place { angle, rate_hz: 1.1, last, next })
    }

    #[test]
    fn the_highest_point_is_the_beat() {
        for origin in [Origin::Sinus, Origin::Ventricle] {
            let curve = (-500..500).map(|k| f64::from(k) * 1e-3);
            let height = |angle: &f64| {
                let behind = if *angle < 0.0 { TAU + angle } else { *angle };
                at(behind, origin, origin)
            };
            let top = curve.max_by(|a, b| height(a).total_cmp(&height(b))).unwrap();
            // 0.03 rad are 4 ms.
            assert!(top.abs() < 0.03, "{origin:?}: {top}");
        }
    }

    #[test]
    fn one_cycle_goes_over_into_the_next_without_a_jump() {
        let (sinus, ventricle) = (Origin::Sinus, Origin::Ventricle);
        for (last, this, next) in [(sinus, sinus, sinus), (sinus, ventricle, sinus)] {
            let jump = at(TAU - 1e-9, last, this) - at(0.0, this, next);
            assert!(jump.abs() < 1e-3, "{jump}");
        }
    }
}
