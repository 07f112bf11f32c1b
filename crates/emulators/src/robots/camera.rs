//! The camera: a small picture of the arena from above, with the robot in it.

use std::sync::Arc;

use super::arena::{Arena, Point, ROUTER};
use super::drive::Pose;

/// The width of the picture [px].
pub const WIDTH_PX: u32 = 64;
/// The height of the picture [px].
pub const HEIGHT_PX: u32 = 48;

type Rgb = [u8; 3];
const FLOOR: Rgb = [222, 222, 214];
const BOX: Rgb = [120, 84, 50];
const ROUTER_COLOUR: Rgb = [30, 90, 200];
const ROBOT: Rgb = [200, 30, 40];
const NOSE: Rgb = [255, 220, 60];
/// The size at which robot and router are drawn [m].
const DRAWN_M: f64 = 0.35;

/// Returns the picture row by row from the top, three bytes per pixel.
pub fn picture(arena: &Arena, pose: Pose) -> Arc<[u8]> {
    let side_m = arena.floor().high.x_m;
    let nose = pose.at.toward(pose.heading_rad, DRAWN_M);
    let places = (0..HEIGHT_PX).flat_map(|row| (0..WIDTH_PX).map(move |column| (row, column)));
    places
        .flat_map(|(row, column)| colour(arena, pose.at, nose, place(row, column, side_m)))
        .collect()
}

fn place(row: u32, column: u32, side_m: f64) -> Point {
    let x_m = (f64::from(column) + 0.5) / f64::from(WIDTH_PX) * side_m;
    let y_m = (1.0 - (f64::from(row) + 0.5) / f64::from(HEIGHT_PX)) * side_m;
    Point { x_m, y_m }
}

fn colour(arena: &Arena, robot: Point, nose: Point, at: Point) -> Rgb {
    if nose.distance_m(at) < DRAWN_M / 2.0 {
        NOSE
    } else if robot.distance_m(at) < DRAWN_M {
        ROBOT
    } else if ROUTER.distance_m(at) < DRAWN_M {
        ROUTER_COLOUR
    } else if arena.boxes().iter().any(|each| each.contains(at)) {
        BOX
    } else {
        FLOOR
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;

    #[test]
    fn the_robot_is_drawn_where_it_is() {
        let arena = Arena::new(10.0, 0, &mut Noise::seeded(1));
        let pose = Pose { at: Point { x_m: 7.5, y_m: 7.5 }, heading_rad: 0.0 };
        let picture = picture(&arena, pose);
        assert_eq!(picture.len(), 3 * 64 * 48);
        let pixel = |row: usize, column: usize| picture[3 * (64 * row + column)..][..3].to_vec();
        assert_eq!(pixel(12, 48), ROBOT);
        assert_eq!(pixel(40, 48), FLOOR);
        assert_eq!(pixel(46, 2), ROUTER_COLOUR);
    }
}
