//! Every source is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_ros::buses::Buses;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::{SOURCES, SourceContext};

const NOTHING: [String; 0] = [];

#[test]
fn every_source_is_in_the_table() {
    assert_eq!(rows::missing(env!("CARGO_MANIFEST_DIR"), "Source"), NOTHING);
}

#[test]
fn every_source_and_setting_is_documented() {
    let lacking: Vec<String> = SOURCES.iter().flat_map(rows::undocumented).collect();
    assert_eq!(lacking, NOTHING);
}

#[test]
fn every_example_builds() {
    // Each in a study of its own: some exclude each other.
    let context = || {
        let (clock, buses) = (Clock::host(), Arc::new(Buses::apart()));
        SourceContext { clock, buses, claims: Claims::default(), bluetooth: Bluetooth::default() }
    };
    let broken = SOURCES.iter().filter_map(|entry| rows::broken_example(entry, &context()));
    assert_eq!(broken.collect::<Vec<_>>(), NOTHING);
}
