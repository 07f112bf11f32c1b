//! The Polar Measurement Data service: published frames, and sessions with their quirks.

mod support;

use std::time::Duration;

use proptest::prelude::*;
use support::{drain, events, hex, millis, readings, requests, secs, values};
use teampulse_devices::gatt::{Request, Uuid};
use teampulse_devices::polar::{
    CONTROL, Command, ControlMessage, DATA, Frame, Measurement, PolarSession, PpInterval,
    Selection, SettingKind, SettingsList, Status,
};
use teampulse_devices::{Error, Event, GattSession, Output, Reading, Session, Stream};

const FEATURES: &str = "0f05000000000000000000000000000000";
const START_ECG: &str = "02000001820001010e00";
const NOMINAL_NS: f64 = 1e9 / 130.0;

fn writes(outputs: Vec<Output<Request>>) -> Vec<Vec<u8>> {
    let write = |request| match request {
        Request::Write(CONTROL, bytes) => Some(bytes),
        _ => None,
    };
    requests(outputs).into_iter().filter_map(write).collect()
}

/// A session whose requests were answered up to the start of its ECG.
fn asked_to_start() -> PolarSession {
    let mut strap = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
    strap.start(secs(0));
    drain(&mut strap);
    strap.receive(CONTROL, &hex(FEATURES), secs(0));
    assert_eq!(writes(drain(&mut strap)), [hex("0100")]);
    strap.receive(CONTROL, &hex("f00100000000 01 8200 01 01 0e00"), secs(0));
    assert_eq!(writes(drain(&mut strap)), [hex(START_ECG)]);
    strap
}

fn measuring() -> PolarSession {
    let mut strap = asked_to_start();
    strap.receive(CONTROL, &hex("f002000000"), secs(0));
    strap
}

/// 73 samples of ECG, the last one at a time in ns.
fn ecg(last_ns: u64) -> Vec<u8> {
    let mut frame = vec![0];
    frame.extend(last_ns.to_le_bytes());
    frame.push(0);
    frame.extend([1, 0, 0].repeat(73));
    frame
}

fn at(frames: f64) -> u64 {
    599_616_000_000_000_000 + (frames * 73.0 * NOMINAL_NS) as u64
}

fn receive(strap: &mut PolarSession, frames: impl IntoIterator<Item = f64>) {
    for frame in frames {
        let now = Duration::from_secs_f64(frame * 73.0 * NOMINAL_NS / 1e9);
        strap.receive(DATA, &ecg(at(frame)), now);
    }
}

#[test]
fn published_frames_decode_as_the_vendors_tests_say() {
    for vector in include_str!("vectors/polar.txt").lines() {
        let fields: Vec<&str> = vector.split('|').map(str::trim).collect();
        let bytes = hex(fields[1]);
        let samples = Frame::decode(&bytes).and_then(|frame| frame.samples()).unwrap();
        let channels = samples.channels.len();
        let sample = |n: usize| samples.values[n * channels..(n + 1) * channels].to_vec();
        let expected = |field: &str| -> Vec<f64> {
            field.split(' ').map(|number| number.parse().unwrap()).collect()
        };
        assert_eq!(samples.values.len() / channels, fields[2].parse().unwrap(), "{}", fields[0]);
        assert_eq!(sample(0), expected(fields[3]), "{}", fields[0]);
        assert_eq!(sample(1), expected(fields[4]), "{}", fields[0]);
    }
}

#[test]
fn a_published_acceleration_stays_within_its_range() {
    let vector = include_str!("vectors/polar.txt").lines().nth(1).unwrap();
    let bytes = hex(vector.split('|').nth(1).unwrap());
    let samples = Frame::decode(&bytes).unwrap().samples().unwrap();
    assert!(samples.values.iter().all(|raw| (raw * 2.44e-4).abs() <= 8.0)); // the test's factor and range
}

#[test]
fn published_pulse_intervals_decode() {
    let bytes = hex("03000000000000000000 80 8080 8080 ff 00 0100 0100 00");
    let frame = Frame::decode(&bytes).unwrap();
    let pulse = |heart_rate_bpm, interval_ms, error_ms, moving, contact| PpInterval {
        heart_rate_bpm,
        interval_ms,
        error_ms,
        moving,
        contact,
    };
    let expected = [pulse(128, 32896, 32896, true, Some(true)), pulse(0, 1, 1, false, None)];
    assert_eq!(PpInterval::decode_all(frame.payload), expected);
}

#[test]
fn published_settings_decode_and_encode() {
    let bytes = hex("00013400 01011000 0204f500f401e803d007 040103");
    let settings = SettingsList::decode(&bytes).unwrap();
    assert_eq!(settings.values(SettingKind::Rate), [52]);
    assert_eq!(settings.values(SettingKind::Range), [245, 500, 1000, 2000]);
    assert_eq!(settings.values(SettingKind::Channels), [3]);
    assert_eq!(settings.encode(), bytes);
    let milli = SettingsList::decode(&hex("0302ffffffffff000000 01010e00")).unwrap();
    assert_eq!(milli.values(SettingKind::RangeMilli), [u32::MAX, 255]);
    let factor = SettingsList(vec![(SettingKind::Factor, vec![15])]);
    assert!(factor.encode().is_empty());
}

#[test]
fn published_answers_decode() {
    let answer = |text: &str| match ControlMessage::decode(&hex(text)) {
        Ok(ControlMessage::Response(response)) => response,
        other => panic!("{other:?}"),
    };
    let settings = answer("f001020000ffffff");
    assert_eq!((settings.status, settings.more), (Status::SUCCESS, false));
    assert_eq!(settings.parameters, [0xff; 3]);
    let refused = answer("f0010607 00");
    assert_eq!((refused.status.text(), refused.parameters), ("invalid resolution", vec![]));
}

#[test]
fn a_session_asks_for_indications_before_any_command() {
    let mut strap = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
    strap.start(secs(0));
    let asked = requests(drain(&mut strap));
    let expected = [Request::Subscribe(CONTROL), Request::Subscribe(DATA), Request::Read(CONTROL)];
    assert_eq!(asked[..3], expected);
}

#[test]
fn the_greatest_or_the_wanted_of_what_is_offered_is_chosen() {
    let start = |selection: Selection| {
        let mut strap = PolarSession::new(&[selection]);
        strap.start(secs(0));
        strap.receive(CONTROL, &hex(FEATURES), secs(0));
        drain(&mut strap);
        let offer = "f001020000 00 04 1900 3200 6400 c800 01 01 1000 02 03 0200 0400 0800";
        strap.receive(CONTROL, &hex(offer), secs(0));
        writes(drain(&mut strap)).concat()
    };
    let acceleration = Selection::of(Measurement::Acceleration);
    assert_eq!(start(acceleration), hex("0202 0001c800 01011000 02010800"));
    let wanted = Selection { rate_hz: Some(50), range: Some(3), ..acceleration };
    assert_eq!(start(wanted), hex("0202 00013200 01011000 02010800"));
}

#[test]
fn settings_in_several_answers_are_put_together() {
    let mut strap = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
    strap.start(secs(0));
    strap.receive(CONTROL, &hex(FEATURES), secs(0));
    drain(&mut strap);
    strap.receive(CONTROL, &hex("f0010000 01 000182"), secs(0));
    assert_eq!(writes(drain(&mut strap)), [] as [Vec<u8>; 0]);
    strap.receive(CONTROL, &hex("f0010000 00 0001010e00"), secs(0));
    assert_eq!(writes(drain(&mut strap)), [hex(START_ECG)]);
}

#[test]
fn the_stamp_is_of_the_last_sample_and_a_reading_has_the_first() {
    let mut strap = measuring();
    receive(&mut strap, [1.0, 2.0]);
    let read = readings(&drain(&mut strap), "ecg");
    let length_ns = (72.0 * NOMINAL_NS) as i64;
    let first_ns: Vec<i64> = read.iter().filter_map(|reading| reading.device_time_ns).collect();
    assert!((first_ns[0] - (at(1.0) as i64 - length_ns)).abs() <= 1);
    assert!((first_ns[1] - (at(2.0) as i64 - length_ns)).abs() <= 1);
    assert_eq!((read[1].index, read[1].values.len()), (73, 73));
}

#[test]
fn a_lost_frame_is_a_gap_of_its_length_and_stretches_nothing() {
    let mut strap = measuring();
    receive(&mut strap, [1.0, 2.0, 3.0, 4.0, 6.0, 9.0]);
    let outputs = drain(&mut strap);
    let lost = |samples| Event::Gap { stream: "ecg", samples: Some(samples) };
    assert_eq!(events(&outputs), [lost(73), lost(146)]);
    let read = readings(&outputs, "ecg");
    assert_eq!(read.iter().map(|r| r.index / 73).collect::<Vec<_>>(), [0, 1, 2, 3, 5, 8]);
    assert!(read.iter().all(|r| (r.period_ns.unwrap() - NOMINAL_NS).abs() < 1.0));
}

#[test]
fn a_strap_that_runs_two_percent_fast_loses_nothing() {
    let mut strap = measuring();
    receive(&mut strap, (1..200).map(|frame| f64::from(frame) * 0.98));
    let outputs = drain(&mut strap);
    assert_eq!(events(&outputs), []);
    let last: Reading = readings(&outputs, "ecg").pop().unwrap();
    assert!((last.period_ns.unwrap() / NOMINAL_NS - 0.98).abs() < 1e-6);
}

#[test]
fn stamps_that_repeat_or_jump_back_are_left_out() {
    let mut strap = measuring();
    receive(&mut strap, [1.0, 2.0, 2.0, 1.5, 3.0]);
    let outputs = drain(&mut strap);
    assert_eq!(readings(&outputs, "ecg").len(), 3);
    let discarded = Event::Discarded { source: "ecg", bytes: 219 };
    assert_eq!(events(&outputs), [discarded.clone(), discarded]);
}

#[test]
fn one_that_was_switched_off_and_on_again_is_read_at_once() {
    let mut strap = measuring();
    receive(&mut strap, [1.0, 2.0, 3.0]);
    drain(&mut strap);
    strap.start(secs(5));
    strap.receive(DATA, &ecg(at(0.5)), secs(6));
    let outputs = drain(&mut strap);
    let gap = Event::Gap { stream: "ecg", samples: None };
    assert_eq!(events(&outputs), [Event::ClockSet { stream: "ecg" }, gap]);
    assert_eq!(readings(&outputs, "ecg").len(), 1);
}

#[test]
fn a_clock_that_is_set_is_reported_and_the_count_goes_on() {
    let mut strap = measuring();
    receive(&mut strap, [1.0]);
    let set = 800_000_000_000_000_000;
    strap.receive(DATA, &ecg(set), secs(1));
    let outputs = drain(&mut strap);
    let gap = Event::Gap { stream: "ecg", samples: None };
    assert_eq!(events(&outputs), [Event::ClockSet { stream: "ecg" }, gap]);
    assert_eq!(readings(&outputs, "ecg")[1].index, 73);
}

#[test]
fn a_ppg_of_55_hz_that_is_called_135_hz_has_no_gaps() {
    let mut band = PolarSession::new(&[Selection::of(Measurement::Ppg)]);
    band.start(secs(0));
    band.receive(CONTROL, &hex("0f02"), secs(0));
    band.receive(CONTROL, &hex("f001010000 00018700"), secs(0));
    band.receive(CONTROL, &hex("f002010000"), secs(0));
    for frame in 1..9_u64 {
        let now_ns = frame * 11 * 1_000_000_000 / 55;
        let mut value = vec![1];
        value.extend((1_000_000_000_000 + now_ns).to_le_bytes());
        value.push(0);
        value.extend([0; 12].repeat(11));
        band.receive(DATA, &value, Duration::from_nanos(now_ns));
    }
    let outputs = drain(&mut band);
    assert_eq!(events(&outputs), []);
    let period_ns = readings(&outputs, "ppg")[7].period_ns.unwrap();
    assert!((period_ns - 1e9 / 55.0).abs() < 1.0);
}

#[test]
fn a_read_of_the_control_point_is_not_taken_for_an_answer() {
    let mut strap = asked_to_start();
    strap.receive(CONTROL, &hex(FEATURES), secs(0));
    assert_eq!(writes(drain(&mut strap)), [] as [Vec<u8>; 0]);
    strap.receive(CONTROL, &hex("f002000000"), secs(0));
    assert_eq!(strap.next_tick(), Some(secs(10)));
}

#[test]
fn a_strap_that_sends_nothing_is_asked_to_start_again_and_may_take_its_time() {
    for (answer, first_by) in [("f0020006", 30), ("f002000000", 40)] {
        let mut strap = measuring();
        drain(&mut strap);
        strap.tick(secs(10));
        assert_eq!(writes(drain(&mut strap)), [hex(START_ECG)]);
        strap.receive(CONTROL, &hex(answer), secs(10));
        // It is asked once.
        assert!(drain(&mut strap).is_empty());
        assert_eq!(strap.next_tick(), Some(secs(first_by)), "{answer}");
    }
}

#[test]
fn a_stream_that_is_already_on_is_stopped_and_started_again() {
    let mut strap = asked_to_start();
    strap.receive(CONTROL, &hex("f0020006"), secs(0));
    assert_eq!(writes(drain(&mut strap)), [hex("0300")]);
    strap.receive(CONTROL, &hex("f003000000"), millis(100));
    assert!(writes(drain(&mut strap)).is_empty());
    assert_eq!(strap.next_tick(), Some(secs(1)));
    strap.tick(secs(1));
    assert_eq!(writes(drain(&mut strap)), [hex(START_ECG)]);
    // It still says so: then it runs.
    strap.receive(CONTROL, &hex("f0020006"), secs(2));
    assert_eq!(strap.next_tick(), Some(secs(32)));
    receive(&mut strap, [1.0]);
    assert_eq!(readings(&drain(&mut strap), "ecg").len(), 1);
}

#[test]
fn a_strap_with_a_small_mtu_is_to_be_connected_again() {
    let mut strap = asked_to_start();
    strap.receive(CONTROL, &hex("f002000a"), secs(0));
    let done = drain(&mut strap).pop();
    assert_eq!(done, Some(Output::Done(Err(Error::Refused("invalid MTU")))));
}

#[test]
fn what_a_device_can_not_measure_is_refused_and_the_rest_goes_on() {
    let all = [Measurement::Gyroscope, Measurement::Ecg].map(Selection::of);
    let mut strap = PolarSession::new(&all);
    strap.start(secs(0));
    strap.receive(CONTROL, &hex(FEATURES), secs(0));
    let outputs = drain(&mut strap);
    assert!(matches!(events(&outputs)[..], [Event::Refused { stream: "gyroscope", .. }]));
    assert_eq!(writes(outputs), [hex("0100")]);
}

#[test]
fn every_stream_is_stopped_before_the_link_is_closed() {
    let mut strap = measuring();
    receive(&mut strap, [1.0]);
    drain(&mut strap);
    strap.stop(secs(9));
    assert_eq!(writes(drain(&mut strap)), [hex("0300")]);
    strap.receive(CONTROL, &hex("f003000000"), secs(9));
    assert_eq!(drain(&mut strap), [Output::Done(Ok(()))]);
    assert_eq!(strap.next_tick(), None);
}

#[test]
fn a_strap_that_does_not_answer_a_stop_is_left_after_three_seconds() {
    let mut strap = measuring();
    strap.stop(secs(9));
    drain(&mut strap);
    assert_eq!(strap.next_tick(), Some(secs(12)));
    strap.tick(secs(12));
    assert_eq!(drain(&mut strap), [Output::Done(Ok(()))]);
}

#[test]
fn a_first_frame_may_take_thirty_seconds_and_a_next_one_three() {
    let mut strap = measuring();
    drain(&mut strap);
    strap.tick(secs(10));
    strap.receive(CONTROL, &hex("f0020006"), secs(10));
    drain(&mut strap);
    strap.tick(millis(29_999));
    assert!(drain(&mut strap).is_empty());
    strap.receive(DATA, &ecg(at(1.0)), millis(29_999));
    drain(&mut strap);
    strap.tick(millis(32_999));
    let outputs = drain(&mut strap);
    assert_eq!(events(&outputs), [Event::Stalled { stream: "ecg", quiet: secs(3) }]);
    assert_eq!(writes(outputs), [hex("0300")]);
}

#[test]
fn a_silent_strap_is_given_up_in_the_end() {
    let mut strap = measuring();
    let mut outputs = Vec::new();
    while let Some(next) = strap.next_tick() {
        strap.tick(next);
        for output in drain(&mut strap) {
            if let Output::Request(Request::Write(_, command)) = &output {
                let answer = [&[0xf0], &command[..2], &[0, 0]].concat();
                strap.receive(CONTROL, &answer, next);
            }
            outputs.push(output);
        }
    }
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::Silent("ecg")))));
    // At each of four attempts it is asked twice.
    assert_eq!(writes(outputs).iter().filter(|write| **write == hex(START_ECG)).count(), 7);
}

#[test]
fn a_mute_control_point_is_given_up_after_three_attempts() {
    let mut strap = asked_to_start();
    let mut outputs = Vec::new();
    while let Some(next) = strap.next_tick() {
        strap.tick(next);
        outputs.extend(drain(&mut strap));
    }
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::NoAnswer("commands")))));
    assert_eq!(writes(outputs).len(), 2);
}

#[test]
fn a_stream_that_the_device_stopped_is_started_again() {
    let mut strap = measuring();
    receive(&mut strap, [1.0]);
    drain(&mut strap);
    strap.receive(CONTROL, &hex("0100"), secs(1));
    assert_eq!(writes(drain(&mut strap)), [hex("0300")]);
}

#[test]
fn after_a_lost_link_the_gap_is_what_the_device_measured_meanwhile() {
    let mut strap = measuring();
    receive(&mut strap, [1.0, 2.0]);
    strap.start(secs(3));
    strap.receive(CONTROL, &hex(FEATURES), secs(3));
    strap.receive(CONTROL, &hex("f001000000 00 01 8200 01 01 0e00"), secs(3));
    strap.receive(CONTROL, &hex("f002000000"), secs(3));
    drain(&mut strap);
    receive(&mut strap, [12.0]);
    let outputs = drain(&mut strap);
    assert_eq!(events(&outputs), [Event::Gap { stream: "ecg", samples: Some(9 * 73) }]);
}

#[test]
fn only_compressed_frames_are_scaled_by_the_factor() {
    let mut band = PolarSession::new(&[Selection::of(Measurement::Acceleration)]);
    band.start(secs(0));
    band.receive(CONTROL, &hex("0f04"), secs(0));
    band.receive(CONTROL, &hex("f001020000 00013400"), secs(0));
    let factor = 2.44e-4_f32.to_le_bytes();
    band.receive(CONTROL, &[&hex("f002020000 0501")[..], &factor].concat(), secs(0));
    band.receive(DATA, &hex("02 009435770000 0000 80 f1ff1400f003 06 01 7b0f08"), secs(1));
    band.receive(DATA, &hex("02 00943577 01000000 01 f1ff1400f003"), secs(5));
    let scale = |output: &Output<Request>| match output {
        Output::Stream(Stream { name: "acceleration", channels, .. }) => Some(channels[0].scale),
        _ => None,
    };
    let scales: Vec<f64> = drain(&mut band).iter().filter_map(scale).collect();
    assert_eq!(scales, [f64::from(2.44e-4_f32), 0.001]);
}

#[test]
fn pulse_intervals_are_dated_back_from_the_last() {
    let mut band = PolarSession::new(&[Selection::of(Measurement::PpInterval)]);
    band.start(secs(0));
    band.receive(CONTROL, &hex("0f08"), secs(0));
    assert_eq!(writes(drain(&mut band)), [hex("0203")]);
    band.receive(CONTROL, &hex("f002030000"), secs(0));
    let pulses = "4b 2003 0a00 04 4b 2203 0a00 06";
    band.receive(DATA, &hex(&format!("03 00ca9a3b00000000 00 {pulses}")), secs(1));
    band.receive(DATA, &hex(&format!("03 0000000000000000 00 {pulses}")), secs(2));
    let read = readings(&drain(&mut band), "pp_interval");
    let dated: Vec<_> = read.iter().map(|reading| reading.device_time_ns).collect();
    assert_eq!(dated, [Some(1_000_000_000 - 802_000_000), Some(1_000_000_000), None]);
    assert_eq!(read[0].values, [800.0, 10.0, 75.0, 0.0, 0.0]);
    assert_eq!(read[2].values, [800.0, 10.0, 75.0, 0.0, 0.0, 802.0, 10.0, 75.0, 0.0, 1.0]);
    assert_eq!(read.iter().map(|reading| reading.index).collect::<Vec<_>>(), [0, 1, 2]);
}

#[test]
fn noise_without_contact_is_a_reading_as_any_other() {
    let mut strap = measuring();
    receive(&mut strap, [1.0]);
    assert_eq!(values(&readings(&drain(&mut strap), "ecg")).len(), 73);
}

/// Packs differences of a given width as specified, for the test below.
fn pack(differences: &[i32], width: u32) -> Vec<u8> {
    let mut bytes = vec![0; (differences.len() * width as usize).div_ceil(8)];
    let bits = differences.iter().flat_map(|number| (0..width).map(move |bit| number >> bit & 1));
    for (at, bit) in bits.enumerate() {
        bytes[at / 8] |= (bit as u8) << (at % 8);
    }
    bytes
}

proptest! {
    #[test]
    fn what_is_compressed_comes_out_again(
        samples in prop::collection::vec(prop::array::uniform3(-2000..2000_i32), 1..200),
    ) {
        let width = 13;
        let mut value = vec![2, 1, 0, 0, 0, 0, 0, 0, 0, 0x81];
        value.extend(samples[0].iter().flat_map(|x| (*x as i16).to_le_bytes()));
        for block in samples.windows(2).collect::<Vec<_>>().chunks(50) {
            let differences: Vec<i32> =
                block.iter().flat_map(|pair| (0..3).map(|k| pair[1][k] - pair[0][k])).collect();
            value.extend([width as u8, block.len() as u8]);
            value.extend(pack(&differences, width));
        }
        let decoded = Frame::decode(&value).unwrap().samples().unwrap();
        let expected: Vec<f64> = samples.concat().into_iter().map(f64::from).collect();
        prop_assert_eq!(decoded.values, expected);
    }

    #[test]
    fn any_values_are_read_or_discarded(
        arrivals in prop::collection::vec(
            (0_u64..5000, 0_usize..3, prop::collection::vec(any::<u8>(), 0..60)), 0..60,
        ),
    ) {
        let all = Measurement::ALL.map(Selection::of);
        let mut device = PolarSession::new(&all);
        let mut now = secs(0);
        device.start(now);
        device.receive(CONTROL, &[0x0f, 0xff, 0xff], now);
        for (wait, which, value) in arrivals {
            now += millis(wait);
            device.tick(now);
            drain(&mut device);
            let characteristic = [CONTROL, DATA, Uuid::short(0x2a37)][which];
            device.receive(characteristic, &value, now);
            let outputs = drain(&mut device);
            prop_assert!(outputs.len() <= 16);
            let read: usize = outputs.iter().map(|output| match output {
                Output::Reading(reading) => reading.values.len(),
                _ => 0,
            }).sum();
            prop_assert!(read <= 4 * 255 * (1 + value.len() / 2));
        }
        device.stop(now);
        while let Some(next) = device.next_tick() {
            device.tick(next);
        }
        prop_assert!(matches!(drain(&mut device).last(), Some(Output::Done(_)) | None));
    }
}

#[test]
fn commands_are_encoded_as_specified() {
    assert_eq!(Command::Settings(Measurement::Acceleration).encode(), [1, 2]);
    assert_eq!(Command::Stop(Measurement::Ecg).encode(), [3, 0]);
}
