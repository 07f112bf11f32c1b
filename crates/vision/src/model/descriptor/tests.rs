use super::*;

const WHOLE: &str = r#"
name = "age"
file = "age.onnx"
licence = "MIT"
[input]
size = [8, 8]
[output]
kind = "regression"
names = ["age"]
"#;

fn refused(old: &str, new: &str) -> String {
    Descriptor::parse(&WHOLE.replace(old, new)).unwrap_err().to_string()
}

#[test]
fn a_descriptor_says_what_is_wrong_with_it() {
    Descriptor::parse(WHOLE).unwrap();
    for (old, new, words) in [
        ("licence = \"MIT\"\n", "", "licence"),
        ("size", "sizes", "sizes"),
        ("names", "name", "name"),
        ("\"regression\"", "\"dream\"", "dream"),
        ("\"age\"\nfile", "\"Age 1\"\nfile", "Age 1"),
        ("[8, 8]", "[0, 8]", "0 × 8"),
        ("[8, 8]", "[1000000, 1000000]", "1000000 × 1000000"),
        ("[8, 8]", "[8, 8]\nstd = [1, 0, 1]", "`std`"),
        ("[8, 8]", "[8, 8]\nmargin = -1", "margin"),
        ("[\"age\"]", "[]", "0 values"),
        ("licence", "max_hz = 0\nlicence", "max_hz"),
    ] {
        let error = refused(old, new);
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn a_file_is_used_only_where_it_is_the_one_of_the_descriptor() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("age.toml");
    let written = |text: &str| {
        std::fs::write(&path, text).unwrap();
        Descriptor::open(&path).map(|(_, file)| file)
    };
    assert_eq!(written(WHOLE), Err(DescriptorError::NoHash("age".to_owned())));
    let hashed = format!("sha256 = \"{}\"\n{WHOLE}", sha256(b"weights").to_uppercase());
    assert!(
        matches!(written(&hashed), Err(DescriptorError::File { file, .. }) if file.ends_with("age.onnx"))
    );
    std::fs::write(folder.path().join("age.onnx"), b"weights").unwrap();
    assert_eq!(written(&hashed).unwrap(), b"weights");
    std::fs::write(folder.path().join("age.onnx"), b"others").unwrap();
    assert!(matches!(written(&hashed), Err(DescriptorError::Hash { .. })));
}

#[test]
fn the_hash_is_that_of_sha256sum() {
    assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
