//! Every worker is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

use teampulse_core::clock::Clock;
use teampulse_workers::{WORKERS, WorkerContext};

const NOTHING: [String; 0] = [];

#[test]
fn every_worker_is_in_the_table() {
    assert_eq!(rows::missing(env!("CARGO_MANIFEST_DIR"), "Worker"), NOTHING);
}

#[test]
fn every_worker_and_setting_is_documented() {
    let lacking: Vec<String> = WORKERS.iter().flat_map(rows::undocumented).collect();
    assert_eq!(lacking, NOTHING);
}

#[test]
fn every_example_builds() {
    let context = WorkerContext { clock: Clock::host() };
    let broken = WORKERS.iter().filter_map(|entry| rows::broken_example(entry, &context));
    assert_eq!(broken.collect::<Vec<_>>(), NOTHING);
}
