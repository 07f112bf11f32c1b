use proptest::prelude::*;

use super::*;

const SIZE: (u32, u32) = (160, 120);
const SKIN: [u8; 3] = [200, 140, 115];
const WALL: [u8; 3] = [110, 130, 150];

/// A picture whose pixels are a function of their position.
fn drawn(pixel: impl Fn(u32, u32) -> [u8; 3]) -> Picture {
    let (width, height) = SIZE;
    let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let rgb = places.flat_map(|(column, row)| pixel(column, row)).collect();
    Picture { width, height, rgb }
}

/// A face of 48 × 48 pixels in front of a wall.
fn face(left: u32) -> Picture {
    drawn(|column, row| {
        let is_face = (left..left + 48).contains(&column) && (40..88).contains(&row);
        if is_face { SKIN } else { WALL }
    })
}

fn noise(column: u32, row: u32, seed: u32) -> u8 {
    let hash = (column * 7919 + row * 104_729 + seed * 1_299_721).wrapping_mul(2_654_435_761);
    (hash >> 29) as u8
}

#[test]
fn a_still_view_with_noise_and_changing_light_does_not_move() {
    let mut frames = Frames::default();
    for k in 0..20_u32 {
        let light = (100 + 2 * (k % 10)) as u8;
        let picture = drawn(|column, row| [light + noise(column, row, k); 3]);
        let frame = frames.push(&picture, f64::from(k) / 30.0);
        assert!(frame.moving.is_nan() || frame.moving < 0.002, "{frame:?}");
        assert!(!frame.is_present && frame.skin < 1e-9, "{frame:?}");
        assert!((frame.brightness - f64::from(light + 3) / 255.0).abs() < 0.01);
    }
}

#[test]
fn a_face_that_moves_is_somebody_and_one_on_the_wall_is_nobody() {
    let mut frames = Frames::default();
    for k in 0..30 {
        let frame = frames.push(&face(40), f64::from(k) / 30.0);
        assert!(!frame.is_present, "{frame:?}");
        assert!((frame.skin - 0.12).abs() < 0.01, "{frame:?}");
        for (is, was) in frame.colour.into_iter().zip(SKIN) {
            assert!((is - f64::from(was) / 255.0).abs() < 1e-9, "{frame:?}");
        }
    }
    let moved = frames.push(&face(48), 1.0);
    assert!(moved.is_present);
    // Two columns of six blocks each of 20 × 15 became skin, or wall.
    assert!((moved.moving - 12.0 / 300.0).abs() < 1e-9, "{moved:?}");
    let still = |frames: &mut Frames, from: u32, until: u32| {
        (from..until).any(|k| frames.push(&face(48), f64::from(k)).is_present)
    };
    assert!(still(&mut frames, 2, 20));
    assert!(!still(&mut frames, 23, 40));
    let empty = frames.push(&drawn(|_, _| WALL), 41.0);
    assert!(empty.colour[0].is_nan() && !empty.is_present);
}

#[test]
fn what_is_out_of_focus_is_less_sharp() {
    let stripes = |period: f64| {
        drawn(move |column, _| {
            let wave = (std::f64::consts::TAU * f64::from(column) / period).sin();
            [(128.0 + 100.0 * wave) as u8; 3]
        })
    };
    let sharp = Frames::default().push(&stripes(8.0), 0.0).sharpness;
    let blurred = Frames::default().push(&stripes(32.0), 0.0).sharpness;
    assert!(sharp > 10.0 * blurred, "{sharp} {blurred}");
    assert!(Frames::default().push(&drawn(|_, _| WALL), 0.0).sharpness.is_nan());
}

#[test]
fn after_a_gap_or_another_size_nothing_moved() {
    let mut frames = Frames::default();
    frames.push(&face(40), 0.0);
    assert!(frames.push(&face(80), 10.0).moving.is_nan());
    assert!(frames.push(&face(40), 10.1).moving > 0.0);
    assert!(frames.push(&face(40), 9.0).moving.is_nan());
    let other = Picture { width: 16, height: 16, rgb: vec![0; 16 * 16 * 3] };
    assert!(frames.push(&other, 9.1).moving.is_nan());
}

proptest! {
    #[test]
    fn pictures_of_any_size_have_numbers_in_their_ranges(
        width in 0_u32..70, height in 0_u32..70, colour: [u8; 3], count in 1_usize..4,
    ) {
        let pixels = (width * height) as usize;
        let mut frames = Frames::default();
        for k in 0..count {
            let colour = colour.map(|part| part.wrapping_mul(k as u8 + 1));
            let picture = Picture { width, height, rgb: colour.repeat(pixels) };
            let frame = frames.push(&picture, k as f64 / 30.0);
            for share in [frame.moving, frame.motion, frame.brightness, frame.colour[0]] {
                prop_assert!(share.is_nan() || (0.0..=1.0 + 1e-9).contains(&share));
            }
            prop_assert!((0.0..=1.0).contains(&frame.skin));
        }
    }
}
