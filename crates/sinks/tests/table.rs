//! Every sink is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

use std::fs;

use teampulse_core::clock::Clock;
use teampulse_sinks::{SINKS, SinkContext};

const NOTHING: [String; 0] = [];

#[test]
fn every_sink_is_in_the_table() {
    assert_eq!(rows::missing(env!("CARGO_MANIFEST_DIR"), "Sink"), NOTHING);
}

#[test]
fn every_sink_and_setting_is_documented() {
    let lacking: Vec<String> = SINKS.iter().flat_map(rows::undocumented).collect();
    assert_eq!(lacking, NOTHING);
}

#[test]
fn every_example_builds() {
    let folder = tempfile::tempdir().expect("a folder");
    let context = SinkContext::new(folder.path().join("session"), "session", Clock::host());
    let broken = SINKS.iter().filter_map(|entry| rows::broken_example(entry, &context));
    assert_eq!(broken.collect::<Vec<_>>(), NOTHING);
}

#[test]
fn every_sink_has_the_name_of_its_row() {
    let folder = tempfile::tempdir().expect("a folder");
    let context = SinkContext::new(folder.path().join("session"), "session", Clock::host());
    for entry in SINKS {
        let Some(Ok(sink)) = rows::example(entry, &context) else { panic!("{}", entry.kind) };
        assert_eq!(sink.name(), entry.kind, "messages and `[commands]` name it by its type");
    }
}

#[test]
fn the_lines_that_a_nested_file_lacks_are_named_with_their_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("src");
    fs::create_dir_all(source.join("screens")).expect("a folder");
    for (file, text) in [
        ("lib.rs", ""),
        ("plain.rs", "impl Component<dyn Sink, SinkContext> for Plain {"),
        ("screens/mod.rs", ""),
        ("screens/wall.rs", "impl Component<dyn Sink, SinkContext> for Wall {"),
    ] {
        fs::write(source.join(file), text).expect("a file");
    }
    let mut missing = rows::missing(&folder.path().to_string_lossy(), "Sink");
    missing.sort();
    assert_eq!(
        missing,
        [
            "src/plain.rs: `Plain` is in no table: add `mod plain;` and \
         `Entry::new::<plain::Plain>(\"plain\"),` to src/lib.rs",
            "src/screens/wall.rs: `Wall` is in no table: add `pub mod wall;` to src/screens/mod.rs and \
         `Entry::new::<screens::wall::Wall>(\"wall\"),` to src/lib.rs",
        ]
    );
}
