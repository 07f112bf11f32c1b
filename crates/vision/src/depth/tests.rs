use proptest::prelude::*;
use teampulse_messages::cdr::Writer;
use teampulse_messages::standard::Message as _;
use teampulse_messages::standard::sensor_msgs::Image;
use teampulse_messages::standard::std_msgs::Header;

use super::*;

const PATCH: Patch = Patch { side: 5, most_spread_m: 0.1 };

fn image(encoding: &str, width: u32, height: u32, data: Vec<u8>) -> Image {
    let step = data.len() as u32 / height.max(1);
    Image { encoding: encoding.to_owned(), width, height, step, data, ..Image::default() }
}

/// A picture of millimetres.
fn millimetres(width: u32, height: u32, at: impl Fn(u32, u32) -> u16) -> Depth {
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let data = pixels.flat_map(|(column, row)| at(column, row).to_le_bytes()).collect();
    Depth::read(&image("16UC1", width, height, data).encode()).unwrap()
}

fn info(size: [u32; 2], k: [f64; 9], region: [u32; 4]) -> Bytes {
    let mut writer = Writer::new();
    writer.write(&Header::default());
    writer.write(&size[1]);
    writer.write(&size[0]);
    writer.text("plumb_bob");
    writer.write(&vec![0.0_f64; 5]);
    writer.write(&k);
    writer.write(&[0.0_f64; 9]);
    writer.write(&[0.0_f64; 12]);
    writer.write(&[0_u32; 2]);
    writer.write(&region);
    writer.write(&false);
    writer.finish()
}

fn k(fx: f64, fy: f64, cx: f64, cy: f64) -> [f64; 9] {
    [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

fn assert_near(is: [f64; 3], expected: [f64; 3]) {
    assert!(is.iter().zip(expected).all(|(is, expected)| (is - expected).abs() < 1e-9), "{is:?}");
}

#[test]
fn distances_of_both_encodings_and_byte_orders_are_metres() {
    let of = |encoding: &str, is_bigendian: u8, data: Vec<u8>| {
        let image = Image { is_bigendian, ..image(encoding, 2, 1, data) };
        let depth = Depth::read(&image.encode()).unwrap();
        [depth.at(0, 0), depth.at(1, 0)]
    };
    assert_eq!(of("16UC1", 0, vec![0xe8, 3, 0, 0]), [Some(1.0), None]);
    assert_eq!(of("mono16", 1, vec![3, 0xe8, 0, 0]), [Some(1.0), None]);
    let floats = [1.25_f32, f32::NAN];
    assert_eq!(of("32FC1", 0, floats.map(f32::to_le_bytes).concat()), [Some(1.25), None]);
    let floats = [-1.0_f32, f32::INFINITY];
    assert_eq!(of("32FC1", 1, floats.map(f32::to_be_bytes).concat()), [None, None]);
}

#[test]
fn rows_may_be_padded() {
    let padded = image("16UC1", 1, 2, vec![1, 0, 9, 9, 2, 0, 9, 9]);
    let depth = Depth::read(&padded.encode()).unwrap();
    assert_eq!([depth.at(0, 0), depth.at(0, 1)], [Some(0.001), Some(0.002)]);
    assert_eq!([depth.at(1, 0), depth.at(0, 2), depth.at(-1, 0)], [None; 3]);
}

#[test]
fn pictures_of_absurd_sizes_and_other_pixels_are_refused() {
    for (width, height, step, bytes) in [
        (0, 0, 0, 0),
        (u32::MAX, u32::MAX, u32::MAX, 10),
        (2, 2, 4, 7),
        (2, 2, 3, 8),
        (100_000, 1000, 200_000, 10),
    ] {
        let broken = Image { width, height, step, ..image("16UC1", 1, 1, vec![0; bytes]) };
        let error = Depth::read(&broken.encode()).unwrap_err();
        assert!(matches!(error, DepthError::Message(PictureError::Rows { .. })), "{error}");
    }
    let error = Depth::read(&image("rgb8", 1, 1, vec![0; 3]).encode()).unwrap_err();
    assert_eq!(error, DepthError::Encoding(Encoding::Rgb8));
    assert!(matches!(Depth::read(&Bytes::from_static(&[0, 1, 0, 0])), Err(DepthError::Message(_))));
}

#[test]
fn the_distance_of_a_point_is_the_median_without_holes() {
    let slanted = millimetres(20, 20, |column, _| 1000 + 10 * column as u16);
    assert_eq!(PATCH.distance(&slanted, [10.2, 9.8]), Ok(1.1));
    let holed = millimetres(20, 20, |column, row| if (column + row) % 2 == 0 { 0 } else { 1500 });
    assert_eq!(PATCH.distance(&holed, [10.0, 10.0]), Ok(1.5));
    // A single pixel that is wrong does not count.
    let speckled =
        millimetres(20, 20, |column, row| if (column, row) == (10, 10) { 9000 } else { 1500 });
    assert_eq!(PATCH.distance(&speckled, [10.0, 10.0]), Ok(1.5));
}

#[test]
fn a_point_in_a_hole_or_outside_has_no_distance() {
    let holed = millimetres(20, 20, |column, _| if column < 12 { 0 } else { 1500 });
    assert_eq!(PATCH.distance(&holed, [10.0, 10.0]), Err(Unplaced::Hole), "a fifth of the patch");
    assert_eq!(PATCH.distance(&holed, [5.0, 10.0]), Err(Unplaced::Hole));
    let whole = millimetres(20, 20, |_, _| 1500);
    for outside in
        [[-0.6, 5.0], [5.0, 19.6], [f64::NAN, 5.0], [1e300, 5.0], [5.0, f64::NEG_INFINITY]]
    {
        assert_eq!(PATCH.distance(&whole, outside), Err(Unplaced::Hole), "{outside:?}");
    }
    // At a corner nine of 25 pixels are in the picture.
    assert_eq!(PATCH.distance(&whole, [0.0, 0.0]), Ok(1.5));
}

#[test]
fn a_point_at_an_edge_has_no_distance() {
    let edge = millimetres(20, 20, |column, _| if column < 10 { 1500 } else { 3000 });
    assert_eq!(PATCH.distance(&edge, [10.0, 10.0]), Err(Unplaced::Edge));
    assert_eq!(PATCH.distance(&edge, [6.0, 10.0]), Ok(1.5));
    let wide = Patch { most_spread_m: 2.0, ..PATCH };
    assert_eq!(wide.distance(&edge, [10.0, 10.0]), Ok(3.0));
}

#[test]
fn a_place_and_a_distance_are_a_point_in_space() {
    let read = Intrinsics::read(&info([640, 480], k(600.0, 500.0, 319.5, 239.5), [0; 4])).unwrap();
    assert_near(read.in_space([319.5, 239.5], 2.0), [0.0, 0.0, 2.0]);
    assert_near(read.in_space([619.5, -10.5], 2.0), [1.0, -1.0, 2.0]);
    // Half of the size, the same view.
    let half = read.of_pictures([320.0, 240.0]).unwrap();
    let place = scaled([619.5, -10.5], [640.0, 480.0], [320.0, 240.0]);
    assert_near(half.in_space(place, 2.0), [1.0, -1.0, 2.0]);
    assert_eq!(read.of_pictures([848.0, 480.0]), None);
    assert_eq!(read.of_pictures([f64::NAN, 480.0]), None);
}

#[test]
fn a_camera_that_is_not_calibrated_is_named() {
    let error = Intrinsics::read(&info([640, 480], [0.0; 9], [0; 4])).unwrap_err();
    assert_eq!(
        error.to_string(),
        "use the calibration of a camera: its K has the focal lengths 0 and 0 px for 640 × 480 pixels"
    );
    for broken in
        [k(f64::NAN, 1.0, 0.0, 0.0), k(1.0, f64::INFINITY, 0.0, 0.0), k(1.0, 1.0, f64::NAN, 0.0)]
    {
        assert!(Intrinsics::read(&info([640, 480], broken, [0; 4])).is_err());
    }
    assert!(Intrinsics::read(&info([0, 480], k(1.0, 1.0, 0.0, 0.0), [0; 4])).is_err());
    let part = Intrinsics::read(&info([640, 480], k(1.0, 1.0, 0.0, 0.0), [10, 0, 100, 100]));
    assert_eq!(part, Err(IntrinsicsError::Part));
    Intrinsics::read(&info([640, 480], k(1.0, 1.0, 0.0, 0.0), [0, 0, 480, 640])).unwrap();
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes: Vec<u8>, x: f64, y: f64, side: u8) {
        let message = Bytes::from([&[0, 1, 0, 0][..], &bytes].concat());
        drop(Intrinsics::read(&message));
        if let Ok(depth) = Depth::read(&message) {
            let patch = Patch { side: u32::from(side), ..PATCH };
            let found = patch.distance(&depth, [x, y]);
            prop_assert!(found.is_err() || found.is_ok_and(|distance| distance > 0.0));
        }
    }

    #[test]
    fn a_picture_of_any_size_has_all_its_pixels_or_is_refused(
        (width, height) in (0_u32..9, 0_u32..9), step in 0_u32..40, is_bigendian in 0_u8..2,
        encoding in prop::sample::select(vec!["16UC1", "mono16", "32FC1", "mono8"]),
        data in prop::collection::vec(any::<u8>(), 0..400), x in -3.0..12.0, y in -3.0..12.0,
    ) {
        let held = data.len();
        let picture = Image { width, height, step, is_bigendian, ..image(encoding, 1, 1, data) };
        if let Ok(depth) = Depth::read(&picture.encode()) {
            prop_assert!(held >= (step * height) as usize && width > 0 && height > 0);
            prop_assert_eq!(depth.at(i64::from(width), 0), None);
            let distance = depth.at(i64::from(width) - 1, i64::from(height) - 1);
            prop_assert!(distance.is_none_or(|distance| distance > 0.0 && distance.is_finite()));
            let found = PATCH.distance(&depth, [x, y]);
            prop_assert!(found.is_err() || found.is_ok_and(|distance| distance > 0.0));
        }
    }

    #[test]
    fn any_picture_has_a_distance_within_its_own_or_none(
        pixels in prop::collection::vec(any::<u16>(), 36), x in -3.0..9.0, y in -3.0..9.0, side in 0_u32..9,
    ) {
        let depth = millimetres(6, 6, |column, row| pixels[(row * 6 + column) as usize]);
        if let Ok(distance) = (Patch { side, ..PATCH }).distance(&depth, [x, y]) {
            prop_assert!(distance > 0.0 && distance < 65.6);
        }
    }
}
