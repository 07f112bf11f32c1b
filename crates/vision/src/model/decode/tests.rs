use proptest::prelude::*;

use super::*;

fn kind(settings: &str) -> Output {
    toml::from_str(settings).unwrap()
}

fn tensor(name: &str, shape: &[usize], values: &[f32]) -> Tensor {
    Tensor::new(name, shape, values.to_vec()).unwrap()
}

/// The values of the channels.
fn read(settings: &str, outputs: &[Tensor], size: [usize; 2]) -> Vec<f64> {
    let kind = kind(settings);
    let values = kind.values(Some(&kind.decode(outputs, size).unwrap()));
    assert_eq!(values.len(), kind.channels().len());
    values
}

fn assert_near(values: &[f64], expected: &[f64]) {
    assert_eq!(values.len(), expected.len(), "{values:?}");
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-5 || (a.is_nan() && b.is_nan());
    assert!(values.iter().zip(expected).all(is_near), "{values:?} {expected:?}");
}

#[test]
fn a_heatmap_has_its_point_between_the_cells() {
    let mut map = vec![0.0; 4 * 6];
    (map[6 + 2], map[6 + 3]) = (0.6, 0.2);
    let values = read(
        "kind = 'heatmap'\nnames = ['nose']\nradius = 1",
        &[tensor("maps", &[1, 1, 4, 6], &map)],
        [12, 16],
    );
    // A quarter of the way from column 2 to 3; a cell is 2 × 4 pixels.
    assert_near(&values, &[2.75 * 2.0 - 0.5, 1.5 * 4.0 - 0.5, f64::from(0.6_f32)]);
}

#[test]
fn simcc_has_the_most_probable_column_and_row() {
    let columns = tensor(
        "x",
        &[1, 2, 8],
        &[0., 0., 0., 0.9, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0.5, 0.],
    );
    let rows = tensor("y", &[1, 2, 4], &[0., 0.7, 0., 0., 0., 0., 0.8, 0.]);
    let values = read("kind = 'simcc'\nnames = ['a', 'b']", &[columns, rows], [4, 2]);
    // Two classes a pixel: column 3 is at 1.5, column 6 at 3 pixels.
    assert_near(&values, &[1.5, 0.5, 0.7, 3.0, 1.0, 0.5].map(|value: f32| f64::from(value)));
}

#[test]
fn points_in_a_row_are_pixels_or_fractions() {
    let numbers = tensor("points", &[1, 8], &[10., 20., 0., 0., 30., 40., 0., 2.]);
    let values = read(
        "kind = 'points'\nnames = ['a', 'b']\nstride = 4\nscore = 3\nis_logistic = true",
        &[numbers],
        [64, 64],
    );
    assert_near(&values, &[10., 20., 0.5, 30., 40., f64::from(1.0 / (1.0 + (-2.0_f32).exp()))]);
    let numbers = tensor("points", &[1, 4], &[0.5, 0.25, 1., 1.]);
    let values = read("kind = 'points'\nnames = ['a']\nis_fraction = true", &[numbers], [64, 32]);
    assert_near(&values, &[31.5, 7.5, 1.0]);
}

#[test]
fn movenet_gives_rows_before_columns() {
    let points = tensor("points", &[1, 1, 2, 3], &[0.5, 0.25, 0.75, 1., 0., 0.5]);
    let values = read("kind = 'movenet'\nnames = ['a', 'b']", &[points], [192, 192]);
    assert_near(&values, &[47.5, 95.5, 0.75, -0.5, 191.5, 0.5]);
}

#[test]
fn classes_are_probabilities() {
    let scores = tensor("scores", &[1, 3], &[0.0, 3.0_f32.ln(), 1000.0]);
    let labels = "kind = 'classes'\nlabels = ['a', 'b', 'c']";
    assert_near(&read(labels, &[scores], [8, 8]), &[0.0, 0.0, 1.0]);
    let scores = tensor("scores", &[1, 3], &[0.0, 3.0_f32.ln(), 0.0]);
    assert_near(&read(labels, std::slice::from_ref(&scores), [8, 8]), &[0.2, 0.6, 0.2]);
    let given = format!("{labels}\nis_probability = true");
    assert_near(&read(&given, &[scores], [8, 8]), &[0.0, f64::from(3.0_f32.ln()), 0.0]);
}

#[test]
fn regression_gives_the_numbers_that_are_named() {
    let numbers = tensor("numbers", &[1, 4], &[9., 9., 0.5, -0.5]);
    let values =
        read("kind = 'regression'\nnames = ['valence', 'arousal']\nfirst = 2", &[numbers], [8, 8]);
    assert_near(&values, &[0.5, -0.5]);
}

#[test]
fn a_gaze_is_yaw_and_pitch_in_radians() {
    let angles = tensor("angles", &[1, 2], &[90., 180.]);
    let values = read("kind = 'gaze'\norder = 'pitch_yaw'\nis_degrees = true", &[angles], [8, 8]);
    assert_near(&values, &[std::f64::consts::PI, std::f64::consts::FRAC_PI_2]);
}

/// YuNet's outputs for an input of 32 × 32 pixels without a face.
fn no_face() -> Vec<Tensor> {
    let each = |name: &str, stride: usize, width: usize| {
        let cells = (32 / stride) * (32 / stride);
        tensor(&format!("{name}_{stride}"), &[1, cells, width], &vec![0.0; cells * width])
    };
    let of = |(name, width)| [8, 16, 32].map(|stride| each(name, stride, width));
    [("cls", 1), ("obj", 1), ("bbox", 4), ("kps", 10)].into_iter().flat_map(of).collect()
}

#[test]
fn yunet_finds_the_face_of_a_cell() {
    let mut outputs = no_face();
    let mut put = |name: &str, place: usize, values: &[f32]| {
        let output = outputs.iter_mut().find(|output| output.name == name).unwrap();
        output.values[place..place + values.len()].copy_from_slice(values);
    };
    // The cell in column 1 and row 0 of stride 16, and the same face once more of stride 8.
    put("cls_16", 1, &[0.9]);
    put("obj_16", 1, &[0.4]);
    put("bbox_16", 4, &[0.5, 0.25, 0.0, 2.0_f32.ln()]);
    put("kps_16", 10, &[0.0, 0.5, 1.0, 0.5, 0.5, 0.5, 0.25, 0.75, 0.75, 0.75]);
    put("cls_8", 3, &[0.3]);
    put("obj_8", 3, &[1.2]);
    put("bbox_8", 12, &[0.0, 0.5, 2.0_f32.ln(), 4.0_f32.ln()]);
    let settings = "kind = 'yunet'\nleast_score = 0.5";
    let values = read(settings, &outputs, [32, 32]);
    let face = [16.0, -12.0, 16.0, 32.0, 0.6, 1.0];
    let points = [16., 8., 32., 8., 24., 8., 20., 12., 28., 12.];
    assert_near(&values, &[&face[..], &points].concat());
    let nothing = read(settings, &no_face(), [32, 32]);
    assert!(nothing[5] == 0.0 && nothing.iter().filter(|value| value.is_nan()).count() == 15);
}

#[test]
fn ssd_moves_the_anchors() {
    // Four anchors in one cell of 16 pixels each way: two of stride 16, in a picture of 32 × 16.
    let mut offsets = vec![0.0; 4 * 16];
    offsets[32..36].copy_from_slice(&[4.0, -2.0, 10.0, 8.0]);
    offsets[36..38].copy_from_slice(&[1.0, 1.0]);
    let outputs =
        [tensor("o", &[1, 4, 16], &offsets), tensor("s", &[1, 4, 1], &[-9., -9., 2., -9.])];
    let values = read("kind = 'ssd'\nanchors = [[16, 2]]", &outputs, [32, 16]);
    assert_near(
        &values[..8],
        &[23., 2., 10., 8., f64::from(1.0 / (1.0 + (-2.0_f32).exp())), 1., 25., 9.],
    );
}

#[test]
fn yolo_of_both_versions_finds_persons() {
    // Two boxes: a person, and a thing of class 1.
    let boxes = [[50., 60., 20., 40., 0.9, 0.1], [10., 10., 5., 5., 0.1, 0.8]];
    let by_part: Vec<f32> = (0..6).flat_map(|part| boxes.map(|each| each[part])).collect();
    let new = read(
        "kind = 'yolo'\nversion = 'v8'\nfinds = 'person'",
        &[tensor("o", &[1, 6, 2], &by_part)],
        [99, 99],
    );
    assert_near(&new, &[40., 40., 20., 40., f64::from(0.9_f32), 1.0]);
    let old = [50., 60., 20., 40., 0.5, 1.2, 0.1, 10., 10., 5., 5., 0.9, 0.1, 0.8];
    let old = read(
        "kind = 'yolo'\nversion = 'v5'\nfinds = 'person'",
        &[tensor("o", &[1, 2, 7], &old)],
        [99, 99],
    );
    assert_near(&old, &[40., 40., 20., 40., f64::from(0.5_f32 * 1.2), 1.0]);
}

#[test]
fn ssd_finds_palms_with_seven_points() {
    let mut offsets = vec![0.0; 18];
    offsets[..4].copy_from_slice(&[1.0, 2.0, 6.0, 4.0]);
    offsets[16..].copy_from_slice(&[-3.0, 5.0]);
    let outputs = [tensor("o", &[1, 1, 18], &offsets), tensor("s", &[1, 1, 1], &[0.0])];
    let settings = "kind = 'ssd'\nfinds = 'hand'\nanchors = [[16, 1]]";
    let values = read(settings, &outputs, [16, 16]);
    assert_near(&values[..6], &[6., 8., 6., 4., 0.5, 1.]);
    assert_near(&values[18..], &[5., 13.]);
    let names: Vec<String> = kind(settings).channels().into_iter().map(|(name, _)| name).collect();
    assert_eq!((names[6].as_str(), names[18].as_str()), ("wrist_x", "thumb_mcp_x"));
    assert_eq!(kind(settings).finds(), Some(Subject::Hand));
    assert!(kind("kind = 'ssd'\nfinds = 'person'\nanchors = [[16, 1]]").wrong().is_some());
}

/// What MediaPipe's model gives of a hand of two points.
fn hand(first: f32, presence: f32, is_right: f32) -> [Tensor; 4] {
    [
        tensor("points", &[1, 6], &[first, 20., -3., 30., 40., 7.]),
        tensor("presence", &[1, 1], &[presence]),
        tensor("handedness", &[1, 1], &[is_right]),
        tensor("world", &[1, 6], &[0.0; 6]),
    ]
}

const HAND: &str = "kind = 'hand'\nnames = ['wrist', 'thumb_tip']\nleast_score = 0.8";

#[test]
fn a_hand_has_its_points_with_its_own_score() {
    let found = kind(HAND).decode(&hand(10.0, 0.875, 0.25), [224, 224]).unwrap();
    let Found::Hand(Some(seen)) = &found else { panic!("{found:?}") };
    assert_eq!((seen.score, seen.is_right), (0.875, false));
    assert_near(&kind(HAND).values(Some(&found)), &[10., 20., 0.875, 30., 40., 0.875]);
    assert_eq!(kind(HAND).decode(&hand(10.0, 0.75, 0.25), [224, 224]), Ok(Found::Hand(None)));
    let unknown = kind(HAND).decode(&hand(10.0, f32::NAN, 0.25), [224, 224]);
    assert_eq!(unknown, Ok(Found::Hand(None)));
    let named = format!("{HAND}\npresence = 'handedness'\nhandedness = 'presence'");
    let found = kind(&named).decode(&hand(10.0, 0.25, 0.9), [224, 224]).unwrap();
    assert!(matches!(found, Found::Hand(Some(SeenHand { is_right: false, .. }))), "{found:?}");
}

#[test]
fn of_several_hands_of_a_side_the_most_certain_is_its_stream() {
    let seen = [(1.0, 0.9, 0.9), (2.0, 0.95, 0.8), (3.0, 0.85, 0.1), (4.0, 0.5, 0.1)];
    let found = seen.map(|(first, presence, is_right)| {
        kind(HAND).decode(&hand(first, presence, is_right), [224, 224]).unwrap()
    });
    let [left, right] = kind(HAND).numbers(&found).try_into().unwrap();
    assert_eq!((left[0], right[0]), (3.0, 2.0));
    let [left, right] = kind(HAND).numbers(&found[..2]).try_into().unwrap();
    assert!(
        left.len() == 6
            && left.iter().all(|number| number.is_nan())
            && (right[0] - 2.0).abs() < 1e-6
    );
    assert_eq!(kind(HAND).sides(), ["_left", "_right"]);
}

#[test]
fn outputs_that_are_no_hand_are_named() {
    let [points, presence, handedness, _] = hand(1.0, 0.9, 0.9);
    let swapped = kind(HAND).decode(&[presence.clone(), points.clone(), handedness], [8, 8]);
    assert!(swapped.unwrap_err().to_string().contains("`presence` is 1 × 1; expected 6 numbers"));
    let twice = kind(HAND).decode(&[points.clone(), points, presence], [8, 8]).unwrap_err();
    assert!(twice.to_string().contains("`points` is 1 × 6; expected one number"), "{twice}");
}

const KINDS: [&str; 12] = [
    "kind = 'heatmap'\nnames = ['a', 'b']",
    "kind = 'simcc'\nnames = ['a', 'b']",
    "kind = 'points'\nnames = ['a', 'b']\nstride = 3\nscore = 2",
    "kind = 'movenet'\nnames = ['a', 'b']",
    "kind = 'classes'\nlabels = ['a', 'b']",
    "kind = 'regression'\nnames = ['a', 'b']\nfirst = 1",
    "kind = 'gaze'",
    "kind = 'yunet'",
    "kind = 'ssd'\nanchors = [[8, 2]]",
    "kind = 'yolo'\nversion = 'v8'\nfinds = 'face'\nclass = 1",
    "kind = 'ssd'\nfinds = 'hand'\nanchors = [[8, 2]]",
    "kind = 'hand'\nnames = ['a', 'b']",
];

#[test]
fn outputs_of_another_shape_are_named() {
    for settings in KINDS {
        assert!(kind(settings).decode(&[], [32, 32]).is_err(), "{settings}");
        let error = kind(settings).decode(&[tensor("o", &[1, 1, 5], &[0.0; 5])], [32, 32]);
        assert!(error.is_err() || settings.contains("regression"), "{settings}");
    }
}

proptest! {
    #[test]
    fn any_outputs_are_read_or_refused(
        shapes in prop::collection::vec((prop::collection::vec(0_usize..5, 0..5), any::<[f32; 4]>()), 0..4),
        named: bool,
    ) {
        let names = ["cls_8", "obj_8", "bbox_8", "kps_8"];
        let outputs: Vec<Tensor> = shapes.iter().zip(names).map(|((shape, some), name)| {
            let count: usize = shape.iter().product();
            let values: Vec<f32> = some.iter().copied().cycle().take(count).collect();
            tensor(if named { name } else { "o" }, shape, &values)
        }).collect();
        for settings in KINDS {
            let kind = kind(settings);
            let numbers = kind.channels().len();
            let found = kind.decode(&outputs, [8, 8]);
            prop_assert!(found.is_err() || kind.values(found.ok().as_ref()).len() == numbers);
        }
    }
}
