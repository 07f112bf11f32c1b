use super::*;
use crate::model::descriptor::{Number, Source};

fn input(size: [usize; 2], resize: Resize) -> Input {
    Input {
        size,
        layout: Layout::Nchw,
        color: Colour::Rgb,
        number: Number::F32,
        scale: 1.0,
        mean: [0.0; 3],
        std: [1.0; 3],
        resize,
        fill: 9.0,
        source: Source::Frame,
        margin: 0.0,
    }
}

/// Columns from left to right, rows from the top, and 77.
fn picture(width: u32, height: u32) -> Picture {
    let pixels =
        (0..height).flat_map(|row| (0..width).map(move |column| [column as u8, row as u8, 77]));
    Picture { width, height, rgb: pixels.flatten().collect() }
}

fn seen(input: &Input, picture: &Picture) -> Vec<f32> {
    tensor(input, picture, &Placement::of_picture(input, picture)).values
}

fn tenths(place: [f32; 2]) -> [i32; 2] {
    place.map(|side| (10.0 * side).round() as i32)
}

#[test]
fn a_picture_of_the_size_of_the_input_goes_in_as_it_is() {
    let picture = picture(3, 2);
    for resize in [Resize::Letterbox, Resize::Stretch, Resize::Crop] {
        let planes = seen(&input([3, 2], resize), &picture);
        let expected =
            [0., 1., 2., 0., 1., 2., 0., 0., 0., 1., 1., 1., 77., 77., 77., 77., 77., 77.];
        assert_eq!(planes, expected, "{resize:?}");
    }
    let together =
        Input { layout: Layout::Nhwc, color: Colour::Bgr, ..input([3, 2], Resize::Stretch) };
    assert_eq!(seen(&together, &picture)[..6], [77., 0., 0., 77., 0., 1.]);
}

#[test]
fn numbers_are_scaled_before_the_mean_is_taken_off() {
    let (mean, std) = ([0.5, 0.0, 7.7], [0.5, 2.0, 1.0]);
    let scaled = Input { scale: 0.1, mean, std, ..input([1, 1], Resize::Stretch) };
    let values = seen(&scaled, &Picture { width: 1, height: 1, rgb: vec![10, 20, 77] });
    for (value, expected) in values.into_iter().zip([1.0, 1.0, 0.0]) {
        assert!((value - expected).abs() < 1e-6, "{value}");
    }
}

#[test]
fn a_letterbox_has_a_border_and_a_crop_none() {
    // Twice as wide as high: half of the square is border.
    let boxed = seen(&input([4, 4], Resize::Letterbox), &picture(8, 4));
    assert_eq!((boxed[0], boxed[12]), (9.0, 9.0));
    assert_eq!(boxed[4..8], [0.5, 2.5, 4.5, 6.5]);
    let cropped = seen(&input([4, 4], Resize::Crop), &picture(8, 4));
    assert_eq!(cropped[..4], [2.0, 3.0, 4.0, 5.0]);
    let stretched = seen(&input([4, 4], Resize::Stretch), &picture(8, 4));
    assert_eq!(stretched[..4], [0.5, 2.5, 4.5, 6.5]);
}

#[test]
fn a_place_of_the_input_is_found_again_in_the_picture() {
    let letterbox = input([100, 100], Resize::Letterbox);
    let whole = Placement::of_picture(&letterbox, &picture(200, 100));
    assert_eq!(tenths(whole.in_picture([49.5, 49.5])), [995, 495]);
    assert_eq!(tenths(whole.scale()), [20, 20]);
    let part = Detection {
        left: 10.0,
        top: 20.0,
        width: 50.0,
        height: 50.0,
        score: 1.0,
        points: Vec::new(),
    };
    let placed = Placement::of_part(&letterbox, &part).unwrap();
    assert_eq!(tenths(placed.in_picture([-0.5, 99.5])), [100, 700]);
    let grown = Input { margin: 1.0, ..letterbox };
    let placed = Placement::of_part(&grown, &part).unwrap();
    assert_eq!(tenths(placed.in_picture([-0.5, -0.5])), [-150, -50]);
    for width in [0.0, f32::NAN, f32::INFINITY] {
        assert_eq!(Placement::of_part(&grown, &Detection { width, ..part.clone() }), None);
    }
}

#[test]
fn a_turned_face_is_upright_in_an_aligned_input() {
    let input = input([112, 112], Resize::Stretch);
    // A quarter turn, twice the size, moved.
    let turned = FACE_112.map(|[x, y]| [(300.0 - 2.0 * y) as f32, (40.0 + 2.0 * x) as f32]);
    let placed = Placement::aligned(&input, &turned).unwrap();
    for (wanted, found) in FACE_112.iter().zip(turned) {
        let [x, y] = placed.in_picture(wanted.map(|place| place as f32));
        assert!((x - found[0]).abs() < 1e-3 && (y - found[1]).abs() < 1e-3, "{x} {y} {found:?}");
    }
    assert_eq!(Placement::aligned(&input, &turned[..4]), None);
    assert_eq!(Placement::aligned(&input, &[[5.0, 5.0]; 5]), None);
}

/// The points of an upright palm of 60 × 40 pixels, from its wrist.
const PALM: [[f32; 2]; 7] =
    [[0., 0.], [-30., -40.], [0., -40.], [15., -38.], [30., -30.], [-20., -10.], [-28., -20.]];

fn palm(points: [[f32; 2]; 7]) -> Detection {
    let (left, top, width, height, score) = (0.0, 0.0, 60.0, 40.0, 1.0);
    Detection { left, top, width, height, score, points: points.to_vec() }
}

#[test]
fn a_hand_is_a_square_around_its_palm_with_the_fingers_in_it() {
    let input = Input { margin: 2.0, ..input([100, 100], Resize::Letterbox) };
    let placed =
        Placement::of_hand(&input, &palm(PALM.map(|[x, y]| [x + 200., y + 300.]))).unwrap();
    // Three times 60 px; its middle is 0.4 × 40 px above that of the palm.
    assert_eq!(tenths(placed.in_picture([49.5, 49.5])), [2000, 2640]);
    assert_eq!(tenths(placed.scale()), [18, 18]);
    assert_eq!(tenths(placed.in_picture([-0.5, -0.5])), [1100, 1740]);
}

#[test]
fn a_turned_hand_is_upright_in_its_input() {
    let input = Input { margin: 2.0, ..input([100, 100], Resize::Letterbox) };
    let upright = Placement::of_hand(&input, &palm(PALM)).unwrap();
    for degrees in [30.0_f32, 90.0, 180.0, 265.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let turn = |[x, y]: [f32; 2]| [x * cosine - y * sine + 70.0, x * sine + y * cosine - 9.0];
        let turned = Placement::of_hand(&input, &palm(PALM.map(turn))).unwrap();
        for place in [[0.0, 0.0], [99.0, 0.0], [20.0, 70.0]] {
            let (is, expected) = (turned.in_picture(place), turn(upright.in_picture(place)));
            assert!((is[0] - expected[0]).hypot(is[1] - expected[1]) < 0.01, "{is:?} {expected:?}");
        }
    }
}

#[test]
fn a_palm_without_extent_is_no_hand() {
    let input = input([100, 100], Resize::Letterbox);
    let of = |points: [[f32; 2]; 7]| Placement::of_hand(&input, &palm(points));
    assert_eq!(of([[5.0, 5.0]; 7]), None);
    assert_eq!(of(PALM.map(|[x, y]| [x * f32::INFINITY, y])), None);
    assert_eq!(of(PALM.map(|[x, _]| [x, f32::NAN])), None);
    // What has no points of a palm is placed as it is.
    let part = Detection { points: Vec::new(), ..palm(PALM) };
    assert_eq!(Placement::of_hand(&input, &part), Placement::of_part(&input, &part));
}
