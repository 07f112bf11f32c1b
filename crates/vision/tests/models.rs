//! Models in both engines: small ones that `models/make.py` makes.

use std::path::{Path, PathBuf};

use teampulse_vision::model::Model;
use teampulse_vision::model::chain::{Chain, missing};
use teampulse_vision::model::decode::Found;
use teampulse_vision::model::descriptor::sha256;
use teampulse_vision::model::engine::Library;
use teampulse_vision::picture::Picture;

const JOINTS: usize = 17;
const WIDTH: u32 = 256;
const HEIGHT: u32 = 192;

/// A descriptor of a model of these tests, in a folder of its own.
fn described(folder: &Path, file: &str, rest: &str) -> PathBuf {
    let bytes =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models").join(file))
            .expect("the file is there");
    of_bytes(folder, &bytes, rest)
}

fn of_bytes(folder: &Path, bytes: &[u8], rest: &str) -> PathBuf {
    let path = folder.join("model.toml");
    std::fs::write(folder.join("model.onnx"), bytes).expect("the folder is writable");
    let hash = sha256(bytes);
    let head = format!("name = 'model'\nfile = 'model.onnx'\nsha256 = '{hash}'\nlicence = 'MIT'\n");
    std::fs::write(&path, head + rest).expect("the folder is writable");
    path
}

fn joints() -> String {
    let names: Vec<String> = (0..JOINTS).map(|joint| format!("'j{joint}'")).collect();
    let names = names.join(", ");
    format!(
        "[input]\nsize = [256, 192]\nscale = 0.00392156862745098\n\
         [output]\nkind = 'heatmap'\nradius = 5\nnames = [{names}]"
    )
}

const NET: &str = "[input]\nsize = [32, 32]\nscale = 0.01\n[output]\nkind = 'regression'\n\
                   names = ['a', 'b', 'c', 'd', 'e', 'f', 'g']";

/// The library of Python's package of ONNX Runtime.
fn onnx_runtime() -> Option<Library> {
    let packages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.venv/lib");
    let pythons = std::fs::read_dir(packages).ok()?;
    let folders =
        pythons.flatten().map(|python| python.path().join("site-packages/onnxruntime/capi"));
    let files = folders.filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let is_library = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with("libonnxruntime.so."))
    };
    files.map(|file| file.path()).find(is_library).map(Library::OnnxRuntime)
}

/// A colour of each joint, as `make.py` has it.
fn colour(joint: usize) -> [u8; 3] {
    [joint % 3, joint / 3 % 3, 2 * (joint / 9)]
        .map(|step| (255.0 * (0.2 + 0.3 * step as f32)).round() as u8)
}

/// A generator of numbers that repeats: 0 to 1 (Knuth's MMIX).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}

/// A picture with a disc for each joint, in front of dark noise, and the places of the discs.
fn drawn(seed: u64) -> (Picture, Vec<[f32; 2]>) {
    let mut random = Numbers(seed);
    let mut places: Vec<[f32; 2]> = Vec::new();
    while places.len() < JOINTS {
        let place = [WIDTH, HEIGHT].map(|side| 10.0 + random.next() * (side as f32 - 20.0));
        let is_apart = |other: &[f32; 2]| (place[0] - other[0]).hypot(place[1] - other[1]) >= 12.0;
        if places.iter().all(is_apart) {
            places.push(place);
        }
    }
    let mut rgb = Vec::new();
    for row in 0..HEIGHT {
        for column in 0..WIDTH {
            let is_at = |place: &[f32; 2]| {
                (column as f32 - place[0]).powi(2) + (row as f32 - place[1]).powi(2) <= 16.0
            };
            let disc = places.iter().position(is_at).map(colour);
            rgb.extend(disc.unwrap_or_else(|| [0; 3].map(|_| (20.0 * random.next()) as u8)));
        }
    }
    (Picture { width: WIDTH, height: HEIGHT, rgb }, places)
}

#[test]
fn joints_of_a_drawn_person_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut model =
        Model::load(&described(folder.path(), "joints.onnx", &joints()), &Library::Pure).unwrap();
    for seed in 1..=3 {
        let (picture, places) = drawn(seed);
        let Some(Found::Points(points)) = model.look(&picture, None).unwrap() else { panic!() };
        for (point, place) in points.iter().zip(&places) {
            let apart = (point.place[0] - place[0]).hypot(point.place[1] - place[1]);
            assert!(apart <= 0.5, "{apart} px: {point:?} {place:?}");
        }
    }
}

#[test]
fn both_engines_give_the_same_numbers() {
    let library = onnx_runtime().expect("ONNX Runtime is in .venv: `make peers` installs it");
    let (picture, _) = drawn(7);
    for (file, rest) in [("joints.onnx", joints().as_str()), ("net.onnx", NET)] {
        let folder = tempfile::tempdir().unwrap();
        let path = described(folder.path(), file, rest);
        let seen = [&Library::Pure, &library].map(|library| {
            let mut chain = Chain::new(vec![Model::load(&path, library).unwrap()]);
            chain.look(&picture).unwrap().numbers.concat()
        });
        assert!(!seen[0].is_empty() && seen[0].len() == seen[1].len());
        for (a, b) in seen[0].iter().zip(&seen[1]) {
            assert!((a - b).abs() <= 1e-3, "{file}: {a} {b}");
        }
    }
}

#[test]
fn a_file_that_is_no_model_is_refused_by_both_engines() {
    let broken =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models/net.onnx")).unwrap();
    for bytes in [&b"no model"[..], &[], &broken[..broken.len() / 2]] {
        for library in [Some(Library::Pure), onnx_runtime()].into_iter().flatten() {
            let folder = tempfile::tempdir().unwrap();
            let error = Model::load(&of_bytes(folder.path(), bytes, NET), &library).err().unwrap();
            assert!(error.to_string().starts_with("load the model `model` with "), "{error}");
        }
    }
}

#[test]
fn a_library_that_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = described(folder.path(), "net.onnx", NET);
    let text = folder.path().join("libonnxruntime.so");
    std::fs::write(&text, "no library").unwrap();
    for library in [Path::new("/nowhere/libonnxruntime.so"), &text] {
        let error = Model::load(&path, &Library::OnnxRuntime(library.to_owned())).err().unwrap();
        assert!(error.to_string().contains(&library.display().to_string()), "{error}");
    }
}

#[test]
fn a_model_of_another_input_or_output_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (rest, words) in [
        (NET.replace("'g'", "'g', 'h'"), "at least 8 numbers"),
        (NET.replace("[32, 32]", "[32, 32]\nlayout = 'nhwc'"), "run the model `model`"),
    ] {
        let path = described(folder.path(), "net.onnx", &rest);
        let dry = Model::load(&path, &Library::Pure).and_then(|mut model| model.dry_run());
        let error = dry.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_model_of_faces_needs_one_that_finds_them_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let rest = NET.replace("[32, 32]", "[32, 32]\nsource = 'face'");
    let mut model =
        Model::load(&described(folder.path(), "net.onnx", &rest), &Library::Pure).unwrap();
    let wrong = missing(std::slice::from_ref(&model.descriptor)).unwrap();
    assert!(wrong.contains("`model` needs a face"), "{wrong}");
    assert_eq!(model.look(&drawn(1).0, None).unwrap(), None);
    let values = Chain::new(vec![model]).look(&drawn(1).0).unwrap().numbers;
    assert!(values[0].len() == 7 && values[0].iter().all(|value| value.is_nan()));
}

/// Models that find a palm in each half of a picture, and points of a hand.
fn hands(folder: &Path, library: &Library) -> Chain {
    let input = |size: [usize; 2]| {
        format!("[input]\nsize = {size:?}\nlayout = 'nhwc'\nscale = 0.00392156862745098")
    };
    let palms =
        format!("{}\n[output]\nkind = 'ssd'\nfinds = 'hand'\nanchors = [[16, 1]]", input([32, 16]));
    let hand = format!(
        "{}\nsource = 'hand'\n[output]\nkind = 'hand'\nnames = ['wrist', 'thumb_tip']",
        input([8, 8])
    );
    let loaded = [("palms.onnx", palms), ("hand.onnx", hand)].map(|(file, rest)| {
        let folder = folder.join(file.replace('.', "_"));
        std::fs::create_dir_all(&folder).expect("the folder is writable");
        Model::load(&described(&folder, file, &rest), library).expect("it can be loaded")
    });
    Chain::new(loaded.into())
}

#[test]
fn each_hand_has_the_numbers_of_its_side() {
    let library = onnx_runtime().expect("ONNX Runtime is in .venv: `make peers` installs it");
    // Bright on the right, which the model takes for the right hand, and the other way round.
    for (levels, sides) in [([20, 200], [0.0, 16.0]), ([200, 20], [16.0, 0.0])] {
        let row = levels.map(|level| [level; 3 * 16]).concat();
        let picture = Picture { width: 32, height: 16, rgb: row.repeat(16) };
        for library in [&Library::Pure, &library] {
            let folder = tempfile::tempdir().unwrap();
            let looked = hands(folder.path(), library).look(&picture).unwrap();
            let [palm, left, right] = looked.numbers.try_into().unwrap();
            assert_eq!((palm.len(), palm[5]), (20, 2.0), "two palms");
            for (hand, x) in [left, right].into_iter().zip(sides) {
                // 6 px around a middle that is 2.4 px above that of the palm, at 8, 8.
                let expected = [x + 5.375, 2.975, 0.9, x + 10.625, 8.225, 0.9];
                let is_near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-4;
                assert!(hand.iter().zip(expected).all(is_near), "{hand:?} {expected:?}");
            }
        }
    }
}

#[test]
fn without_a_second_hand_its_numbers_are_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Picture { width: 32, height: 16, rgb: vec![200; 3 * 32 * 16] };
    let looked = hands(folder.path(), &Library::Pure).look(&picture).unwrap();
    let [_, left, right] = looked.numbers.try_into().unwrap();
    assert!(left.len() == 6 && left.iter().all(|number| number.is_nan()), "{left:?}");
    assert!(right.iter().all(|number| number.is_finite()), "{right:?}");
}
