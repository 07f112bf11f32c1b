//! The decoders of `teampulse-devices` against an emulated strap of any maker: they read what was measured.

use teampulse_devices::heart_rate::{self, HeartRateMeasurement};
use teampulse_emulators::devices::{
    Notice, Peripheral, Strap, StrapFault, StrapIncident, StrapSettings, Wearer,
};

/// A heart that beats every 0.4 s.
struct Heart;

impl Wearer for Heart {
    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let beats = (0..10_000).map(|beat| f64::from(beat) * 0.4);
        beats.filter(|secs| *secs > after_secs && *secs <= until_secs).collect()
    }
}

/// The measurements of a strap with faults during 20 s.
fn measured(incidents: Vec<StrapIncident>) -> Vec<HeartRateMeasurement> {
    let mut strap = Strap::new(StrapSettings { incidents, ..StrapSettings::default() });
    strap.subscribe(heart_rate::MEASUREMENT.0).expect("it can be subscribed to");
    let measurement = |notice| match notice {
        Notice::Value(from, value) if from == heart_rate::MEASUREMENT.0 => {
            Some(HeartRateMeasurement::decode(&value).expect("a measurement"))
        }
        _ => None,
    };
    strap.until(20.5, &mut Heart).into_iter().filter_map(measurement).collect()
}

fn intervals(measured: &[HeartRateMeasurement]) -> usize {
    measured.iter().map(|one| one.rr_intervals.len()).sum()
}

#[test]
fn every_interval_is_read_also_three_in_one_packet() {
    let measured = measured(Vec::new());
    assert_eq!((measured.len(), intervals(&measured)), (20, 49));
    assert!(measured.iter().any(|one| one.rr_intervals.len() == 3));
    let all = measured.iter().flat_map(|one| &one.rr_intervals);
    assert!(all.into_iter().all(|interval| *interval == 410)); // 0.4 s of 1024
    assert!(measured.iter().all(|one| one.contact == Some(true)));
}

#[test]
fn a_lost_measurement_loses_its_intervals() {
    let incidents = vec![StrapIncident { at_secs: 10.5, fault: StrapFault::LostMeasurement }];
    let measured = measured(incidents);
    assert_eq!(measured.len(), 19);
    assert!((46..=47).contains(&intervals(&measured)));
}

#[test]
fn a_strap_that_is_off_reports_no_contact_and_no_beats() {
    let incidents = vec![
        StrapIncident { at_secs: 5.5, fault: StrapFault::Off },
        StrapIncident { at_secs: 15.5, fault: StrapFault::On },
    ];
    let measured = measured(incidents);
    let off: Vec<_> = measured.iter().filter(|one| one.contact == Some(false)).collect();
    assert_eq!(off.len(), 10);
    assert!(off.iter().all(|one| one.rr_intervals.is_empty()));
    assert!(measured.last().is_some_and(|last| last.contact == Some(true)));
}

#[test]
fn after_each_fault_intervals_are_back_within_five_seconds() {
    let at = |at_secs, fault| StrapIncident { at_secs, fault };
    let off = vec![at(5.5, StrapFault::Off), at(10.5, StrapFault::On)];
    for (what, back_secs, incidents) in [
        ("lost measurement", 10.5, vec![at(10.5, StrapFault::LostMeasurement)]),
        ("strap off and on again", 10.5, off),
    ] {
        // One measurement a second, of which a lost one is missing.
        let measured = measured(incidents);
        let lost = 20 - measured.len();
        let since = measured.iter().enumerate().skip(10);
        let first = since.into_iter().find(|(_, one)| !one.rr_intervals.is_empty());
        let gap_secs = (first.expect("intervals").0 + 1 + lost) as f64 - back_secs;
        eprintln!(
            "strap, {what}: intervals are back {gap_secs:.1} s of the strap after it (bar 5)"
        );
        assert!((0.0..5.0).contains(&gap_secs), "{what}: {gap_secs}");
    }
}

#[test]
fn a_battery_is_read_and_reports_each_percent() {
    let battery = teampulse_emulators::devices::assigned(0x2a19);
    let settings = StrapSettings { drain_percent_per_hour: 60.0, ..StrapSettings::default() };
    let mut strap = Strap::new(settings);
    strap.subscribe(battery).expect("it can be subscribed to");
    assert_eq!(strap.read(battery), Ok(vec![70]));
    let sent = strap.until(100.0, &mut Heart);
    let level = |percent| Notice::Value(battery, vec![percent]);
    assert_eq!(sent, [level(69), level(68)]);
    assert_eq!(strap.read(battery), Ok(vec![68]));
}
