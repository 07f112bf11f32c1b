//! The decoders of `teampulse-devices` against an emulated Shimmer3 GSR+: they read what was measured, whatever fails.

#![expect(clippy::float_cmp, reason = "these are exact")]

use std::time::Duration;

use teampulse_devices::shimmer3::{Sensors, ShimmerSession, ShimmerSettings};
use teampulse_devices::{ByteSession, Event, Output, Reading, Session};
use teampulse_emulators::devices::{
    Shimmer, ShimmerFault, ShimmerIncident, ShimmerSettings as Device, Wearer,
};

const RATE_HZ: f64 = 128.0;
const STEP_SECS: f64 = 0.013;

/// Light that encodes the number of its sample, and increasingly moist skin.
struct Numbers;

impl Wearer for Numbers {
    fn light(&mut self, secs: f64) -> f64 {
        (secs * RATE_HZ).round().rem_euclid(4096.0) / 4095.0
    }

    fn conductance_us(&mut self, secs: f64) -> f64 {
        0.5 + secs * 0.3
    }
}

/// The outputs of a session with a device over a period, over a link that cuts bytes anywhere.
fn read(device: Device, secs: f64) -> Vec<Output<Vec<u8>>> {
    let mut shimmer = Shimmer::new(device);
    let sensors = Sensors::GSR | Sensors::PPG | Sensors::BATTERY;
    let mut session =
        ShimmerSession::new(ShimmerSettings { sensors, ..ShimmerSettings::default() });
    session.start(Duration::ZERO);
    let mut outputs = Vec::new();
    let mut now_secs = 0.0;
    while now_secs < secs {
        while let Some(output) = session.poll() {
            if let Output::Request(command) = &output {
                shimmer.receive(command);
            }
            outputs.push(output);
        }
        now_secs += STEP_SECS;
        let now = Duration::from_secs_f64(now_secs);
        let bytes = shimmer.until(now_secs, &mut Numbers);
        bytes.chunks(7).for_each(|piece| session.receive(piece, now));
        session.tick(now);
    }
    outputs
}

fn with(has_checksums: bool, fault: ShimmerFault) -> Device {
    let incidents = vec![ShimmerIncident { at_secs: 10.0, fault }];
    Device { has_checksums, incidents, ..Device::default() }
}

fn readings(outputs: &[Output<Vec<u8>>], stream: &str) -> Vec<Reading> {
    let of_stream = |output: &Output<Vec<u8>>| match output {
        Output::Reading(reading) if reading.stream == stream => Some(reading.clone()),
        _ => None,
    };
    outputs.iter().filter_map(of_stream).collect()
}

/// The number of lost PPG samples; asserts that all others have the number under which they were taken.
fn lost(outputs: &[Output<Vec<u8>>]) -> u64 {
    let light = readings(outputs, "ppg");
    let begin = light[0].values[0];
    for reading in &light {
        assert_eq!(reading.values[0], (begin + reading.index as f64).rem_euclid(4096.0));
    }
    light[light.len() - 1].index + 1 - light.len() as u64
}

#[test]
fn what_was_worn_is_read_with_and_without_checksums() {
    for has_checksums in [true, false] {
        let outputs = read(Device { has_checksums, ..Device::default() }, 40.0);
        assert_eq!(lost(&outputs), 0);
        let skin = readings(&outputs, "eda");
        assert!(skin.len() as f64 > 35.0 * RATE_HZ);
        // It begins with its smallest resistor, and takes up to three switches to the right one.
        for reading in skin.iter().skip(34) {
            let secs = reading.device_time_ns.map_or(f64::NAN, |ns| ns as f64 / 1e9);
            // After a switch of its range, the value from before is repeated for 80 ms.
            let errors = (0..=11).map(|packets| {
                let then_secs = secs - f64::from(packets) / RATE_HZ;
                (reading.values[0] / Numbers.conductance_us(then_secs) - 1.0).abs()
            });
            let error = errors.fold(f64::INFINITY, f64::min);
            assert!(error < 0.02, "{error} at {secs} s");
        }
        let raw = readings(&outputs, "eda_raw");
        let resistors = raw.iter().map(|reading| reading.values[0] as u16 >> 14);
        assert!(resistors.clone().max() > resistors.min()); // it switched its range
    }
}

#[test]
fn a_clock_that_wraps_goes_on() {
    let outputs = read(Device { first_ticks: 0xff_0000, ..Device::default() }, 10.0);
    assert_eq!(lost(&outputs), 0);
    let times = readings(&outputs, "ppg").into_iter().filter_map(|reading| reading.device_time_ns);
    let times: Vec<i64> = times.collect();
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 7_812_500));
}

#[test]
fn a_lost_or_corrupt_byte_costs_at_most_three_packets_and_shifts_no_channel() {
    for has_checksums in [true, false] {
        for at in 0..10 {
            for fault in [ShimmerFault::LostByte(at), ShimmerFault::CorruptByte(at)] {
                let outputs = read(with(has_checksums, fault), 15.0);
                let light = readings(&outputs, "ppg");
                // Without a checksum a corrupt value is a value.
                if has_checksums || matches!(fault, ShimmerFault::LostByte(_)) || at < 4 {
                    assert!(lost(&outputs) <= 3, "{fault:?}");
                }
                assert!(light.len() as f64 > 12.0 * RATE_HZ, "{fault:?}");
            }
        }
    }
}

#[test]
fn lost_packets_are_a_gap_of_their_length() {
    for has_checksums in [true, false] {
        assert_eq!(lost(&read(with(has_checksums, ShimmerFault::LostPackets(30)), 15.0)), 30);
    }
}

#[test]
fn status_that_comes_unasked_costs_nothing() {
    for has_checksums in [true, false] {
        assert_eq!(lost(&read(with(has_checksums, ShimmerFault::Status), 15.0)), 0);
    }
}

#[test]
fn a_device_that_stalls_is_set_up_again_and_its_gap_has_its_length() {
    for has_checksums in [true, false] {
        let outputs = read(with(has_checksums, ShimmerFault::Stall), 30.0);
        let stalled =
            |output: &&Output<Vec<u8>>| matches!(output, Output::Event(Event::Stalled { .. }));
        assert_eq!(outputs.iter().filter(stalled).count(), 1);
        let lost_secs = lost(&outputs) as f64 / RATE_HZ;
        assert!((2.0..6.0).contains(&lost_secs), "{lost_secs}");
    }
}

#[test]
fn after_each_fault_samples_are_back_within_five_seconds_on_the_same_time_base() {
    let faults = [
        ShimmerFault::LostByte(5),
        ShimmerFault::CorruptByte(6),
        ShimmerFault::LostPackets(30),
        ShimmerFault::Status,
        ShimmerFault::Stall,
    ];
    for fault in faults {
        for first_ticks in [0, 0xff_0000] {
            let light = readings(&read(Device { first_ticks, ..with(true, fault) }, 30.0), "ppg");
            let times: Vec<f64> =
                light.iter().filter_map(|r| Some(r.device_time_ns? as f64 / 1e9)).collect();
            let gap_secs = times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            eprintln!(
                "Shimmer3 {fault:?}, from tick {first_ticks}: back {gap_secs:.2} s of the device after it (bar 5)"
            );
            assert!(gap_secs < 5.0, "{fault:?}");
            // Also over the wrap of the counter each sample is as old as its number.
            for (reading, secs) in light.iter().zip(&times) {
                let off_secs = secs - times[0] - (reading.index - light[0].index) as f64 / RATE_HZ;
                assert!(off_secs.abs() < 1e-3, "{fault:?}: {off_secs}");
            }
        }
    }
}

#[test]
fn a_device_of_an_earlier_session_is_stopped_first() {
    let mut shimmer = Shimmer::new(Device::default());
    shimmer.receive(&[0x8b, 2, 0x07]);
    assert!(shimmer.is_streaming());
    let sent = shimmer.until(1.0, &mut Numbers);
    assert!(sent.len() > 300);
    shimmer.receive(&[0x20]);
    assert!(!shimmer.is_streaming());
}
