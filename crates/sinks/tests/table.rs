//! Every sink is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

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
