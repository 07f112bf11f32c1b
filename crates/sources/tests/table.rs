//! Every source is in the table, is documented, and has an example that builds.

#[path = "../../core/tests/rows/mod.rs"]
mod rows;

use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_ros::buses::Buses;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::{self, bluetooth::Bluetooth};
use teampulse_sources::{SOURCES, SourceContext};
use teampulse_timefilter::clock::{DEVICES, KnownDevice};

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

/// Without its row in `wearables/mod.rs`, `scan` and `check` do not know a wearable.
#[test]
fn every_wearable_is_a_kind_with_a_latency() {
    let rows = include_str!("../src/lib.rs").split("Entry::new::<wearables::").skip(1);
    let kinds: Vec<&str> = rows.filter_map(|row| row.split('"').nth(1)).collect();
    assert!(kinds.contains(&"heart_rate"), "{kinds:?}");
    for kind in kinds {
        let is_known = wearables::kinds().any(|known| known == kind);
        assert!(is_known, "add a row for `{kind}` to `KINDS` in src/wearables/mod.rs");
        let is_its = |device: &KnownDevice| wearables::kind_of(device.name) == Some(kind);
        assert!(
            DEVICES.iter().any(is_its),
            "add a row for the device of `{kind}` to timefilter/src/clock/latency.rs"
        );
    }
}
