//! Sessions with straps of the Heart Rate service.

mod support;

use proptest::prelude::*;
use support::{drain, events, millis, readings, requests, secs, values};
use teampulse_devices::gatt::{Request, Uuid};
use teampulse_devices::heart_rate::{HeartRateSession, MEASUREMENT};
use teampulse_devices::{Error, Event, GattSession, Identity, Output, Session};

const BATTERY: Uuid = Uuid::short(0x2a19);

fn started() -> HeartRateSession {
    let mut strap = HeartRateSession::new();
    strap.start(secs(0));
    drain(&mut strap);
    strap
}

#[test]
fn a_strap_is_asked_for_beats_first() {
    let mut strap = HeartRateSession::new();
    strap.start(secs(0));
    let asked = requests(drain(&mut strap));
    assert_eq!(asked[0], Request::Subscribe(MEASUREMENT));
    assert!(asked.contains(&Request::Read(BATTERY)));
}

#[test]
fn every_interval_of_every_notification_is_kept_in_order() {
    let mut strap = started();
    strap.receive(MEASUREMENT, &[0x10, 73, 0x34, 3, 0x32, 3], millis(1000));
    strap.receive(MEASUREMENT, &[0x10, 73], millis(2000));
    strap.receive(MEASUREMENT, &[0x10, 73, 0x35, 3], millis(2500));
    let outputs = drain(&mut strap);
    let intervals = readings(&outputs, "rr_interval");
    assert_eq!(values(&intervals), [820.0, 818.0, 821.0]);
    assert_eq!(intervals.iter().map(|reading| reading.index).collect::<Vec<_>>(), [0, 2]);
    assert_eq!(readings(&outputs, "heart_rate").len(), 3);
}

#[test]
fn an_interval_is_scaled_by_1024_steps_a_second() {
    let mut strap = HeartRateSession::new();
    strap.start(secs(0));
    let scale = drain(&mut strap).into_iter().find_map(|output| match output {
        Output::Stream(stream) if stream.name == "rr_interval" => Some(stream.channels[0].scale),
        _ => None,
    });
    assert_eq!(scale.map(|scale| 1024.0 * scale), Some(1000.0));
}

#[test]
fn beats_that_come_late_are_no_gap_and_beats_that_never_come_are_one() {
    let mut strap = started();
    for second in 0..10 {
        strap.receive(MEASUREMENT, &[0x10, 60, 0, 4], secs(second));
    }
    strap.receive(MEASUREMENT, &[0x10, 60, 0, 4, 0, 4, 0, 4, 0, 4], secs(13));
    assert_eq!(events(&drain(&mut strap)), []);
    strap.receive(MEASUREMENT, &[0x10, 60, 0, 4], secs(18));
    assert_eq!(events(&drain(&mut strap)), [Event::Gap { stream: "rr_interval", samples: None }]);
}

#[test]
fn contact_that_is_not_measured_has_no_value() {
    let mut strap = started();
    for flags in [0, 4, 6] {
        strap.receive(MEASUREMENT, &[flags, 60], secs(1));
    }
    let contact: Vec<f64> = readings(&drain(&mut strap), "heart_rate")
        .iter()
        .map(|reading| reading.values[1])
        .collect();
    assert!(contact[0].is_nan());
    assert_eq!(contact[1..], [0.0, 1.0]);
}

#[test]
fn what_a_strap_is_reads_without_the_zeros_of_c() {
    let mut strap = started();
    strap.receive(Uuid::short(0x2a29), b"Polar Electro Oy\0", secs(0));
    strap.receive(BATTERY, &[87], secs(0));
    let outputs = drain(&mut strap);
    let value = "Polar Electro Oy".to_owned();
    assert_eq!(events(&outputs), [Event::Identified { part: Identity::Manufacturer, value }]);
    assert_eq!(values(&readings(&outputs, "battery")), [87.0]);
}

#[test]
fn a_silent_strap_is_asked_again_and_then_given_up() {
    let mut strap = started();
    strap.tick(millis(4999));
    assert!(drain(&mut strap).is_empty());
    let mut now = secs(0);
    while let Some(next) = strap.next_tick() {
        now = next;
        strap.tick(now);
    }
    assert_eq!(now, secs(20));
    let outputs = drain(&mut strap);
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::Silent("heart_rate")))));
    assert_eq!(requests(outputs).len(), 3);
}

#[test]
fn a_lost_link_is_a_gap_and_the_count_goes_on() {
    let mut strap = started();
    strap.receive(MEASUREMENT, &[0x10, 60, 0, 4], secs(1));
    strap.start(secs(9));
    strap.receive(MEASUREMENT, &[0x10, 60, 0, 4], secs(10));
    let outputs = drain(&mut strap);
    assert_eq!(events(&outputs), [Event::Gap { stream: "rr_interval", samples: None }]);
    assert_eq!(readings(&outputs, "rr_interval")[1].index, 1);
}

#[test]
fn a_device_without_the_service_is_no_strap_and_one_without_a_battery_is() {
    let mut strap = started();
    strap.fail(BATTERY, secs(0));
    assert!(drain(&mut strap).is_empty());
    strap.fail(MEASUREMENT, secs(0));
    assert!(matches!(drain(&mut strap)[..], [Output::Done(Err(Error::Missing(_)))]));
}

proptest! {
    #[test]
    fn any_values_are_read_or_discarded(
        values in prop::collection::vec((0_u64..100, any::<bool>(), prop::collection::vec(any::<u8>(), 0..40)), 0..50)
    ) {
        let mut strap = started();
        let mut now = secs(0);
        for (wait, battery, value) in values {
            now += secs(wait);
            strap.tick(now);
            strap.receive(if battery { BATTERY } else { MEASUREMENT }, &value, now);
            let outputs = drain(&mut strap);
            prop_assert!(outputs.len() <= 8);
            prop_assert!(support::values(&readings(&outputs, "rr_interval")).len() <= value.len() / 2);
        }
    }
}
