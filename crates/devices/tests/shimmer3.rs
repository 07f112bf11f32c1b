//! Sessions with a Shimmer3 over a stream of bytes.

mod support;

use std::time::Duration;

use proptest::prelude::*;
use support::{drain, events, hex, millis, readings, requests, secs, values};
use teampulse_devices::shimmer3::{Sensors, ShimmerSession, ShimmerSettings, crc};
use teampulse_devices::{ByteSession, Error, Event, Identity, Output, Reading, Session};

/// 128 Hz.
const INTERVAL: u32 = 256;

/// The third resistor, and an ADC value of 1500.
const CONDUCTANCE: u16 = 0x85dc;

/// The answers of a kind of device: the emulator of these tests, following the firmware's tables.
#[derive(Clone, Copy)]
struct Device {
    has_checksums: bool,
    /// Whether it answers `A3`.
    is_new: bool,
}

const NEW: Device = Device { has_checksums: true, is_new: true };
const OLD: Device = Device { has_checksums: false, is_new: false };

impl Device {
    fn answer(self, command: &[u8]) -> Vec<u8> {
        match command[0] {
            0x3f => hex("ff 25 03"),
            0x2e => hex("ff 2f 0300 0000 10 0b"),
            0x2c => [hex("ff 2d"), calibration()].concat(),
            0x95 => hex("ff 8a94 2e0b 80"),
            0x01 => hex("ff 02 0001 02090009 02 01 12 1c"),
            0xa3 if !self.is_new => Vec::new(),
            0x8b if !self.has_checksums => Vec::new(),
            0x8b | 0x07 | 0x20 if self.has_checksums => with_sum(vec![0xff]),
            _ => vec![0xff],
        }
    }

    /// A packet in which PPG counts up and conductance stays the same.
    fn packet(self, number: u32) -> Vec<u8> {
        let ticks = (0xff_ff00 + number * INTERVAL).to_le_bytes();
        let ppg = (number as u16 % 4096).to_le_bytes();
        let packet = [&[0], &ticks[..3], &ppg, &CONDUCTANCE.to_le_bytes()].concat();
        if self.has_checksums { with_sum(packet) } else { packet }
    }

    /// A session that streams.
    fn streaming(self) -> (ShimmerSession, Duration) {
        let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
        shimmer.start(secs(0));
        let mut now = millis(300);
        shimmer.tick(now);
        loop {
            let asked = requests(drain(&mut shimmer));
            if asked.contains(&vec![0x07]) {
                shimmer.receive(&self.answer(&[0x07]), now);
                drain(&mut shimmer);
                return (shimmer, now);
            }
            let answers: Vec<u8> =
                asked.iter().filter(|c| !is_reset(c)).flat_map(|c| self.answer(c)).collect();
            shimmer.receive(&answers, now);
            if answers.is_empty() {
                now = shimmer.next_tick().expect("it waits for an answer");
                shimmer.tick(now);
            }
        }
    }

    fn read(self, bytes: &[u8]) -> Vec<Output<Vec<u8>>> {
        let (mut shimmer, now) = self.streaming();
        shimmer.receive(bytes, now);
        drain(&mut shimmer)
    }
}

/// Whether a command is one of those sent before the device is drained.
fn is_reset(command: &[u8]) -> bool {
    matches!(command, [0x20] | [0x8b, 0])
}

fn with_sum(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = crc::crc(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

/// As in the tests of pyshimmer: four sensors of 21 bytes.
fn calibration() -> Vec<u8> {
    let sensor = |text| hex(text);
    [
        sensor("08cd08cd08cd 005c005c005c 009c009c000000009c"),
        sensor("000000000000 199619961996 009c009c000000009c"),
        sensor("000000000000 000000000000 000000000000000000"),
        sensor("000000000000 068706870687 009c0064000000009c"),
    ]
    .concat()
}

fn ppg(outputs: &[Output<Vec<u8>>]) -> Vec<Reading> {
    readings(outputs, "ppg")
}

fn packets(device: Device, numbers: std::ops::Range<u32>) -> Vec<u8> {
    numbers.flat_map(|number| device.packet(number)).collect()
}

#[test]
fn a_device_is_stopped_and_drained_before_anything_is_asked() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    assert_eq!(requests(drain(&mut shimmer)), [vec![0x20], vec![0x8b, 0]]);
    shimmer.receive(&packets(NEW, 0..9), millis(200)); // of an earlier session
    shimmer.receive(&[0xff], millis(299));
    assert!(drain(&mut shimmer).is_empty());
    assert_eq!(shimmer.next_tick(), Some(millis(300)));
    shimmer.tick(millis(300));
    assert_eq!(requests(drain(&mut shimmer)), [[0x3f]]);
}

#[test]
fn settings_are_made_before_streaming_and_read_back() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    drain(&mut shimmer);
    shimmer.tick(millis(300));
    let mut asked = Vec::new();
    let mut outputs = drain(&mut shimmer);
    while let [Output::Request(command)] = &outputs[outputs.len() - 1..] {
        asked.push(command.clone());
        shimmer.receive(&NEW.answer(command), millis(300));
        outputs = drain(&mut shimmer);
        if outputs.is_empty() {
            break;
        }
    }
    let expected =
        ["3f", "2e", "a300", "2c", "95", "050001", "08040100", "2104", "5e01", "01", "8b02", "07"];
    assert_eq!(asked, expected.map(hex));
}

#[test]
fn the_device_says_what_it_is() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    shimmer.tick(millis(300));
    shimmer.receive(&NEW.answer(&[0x3f]), millis(300));
    shimmer.receive(&NEW.answer(&[0x2e]), millis(300));
    let identified = |part, value: &str| Event::Identified { part, value: value.to_owned() };
    let expected =
        [identified(Identity::Model, "Shimmer3"), identified(Identity::Firmware, "0.16.11")];
    assert_eq!(events(&drain(&mut shimmer)), expected);
}

/// The answer in pyshimmer's test of its inquiry, and the longer one of a `Shimmer3R`.
#[test]
fn an_inquiry_says_the_rate_and_the_channels() {
    let rates =
        [("25 03", "02 4000 01ff0109 01 01 12"), ("25 0a", "02 4000 01ff0109000000 01 01 12")].map(
            |(hardware, inquiry)| {
                let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
                shimmer.start(secs(0));
                shimmer.tick(millis(300));
                shimmer.receive(&hex(&format!("ff {hardware}")), millis(300));
                for command in ["2e", "a3", "2c", "95", "05", "08", "21", "5e"] {
                    shimmer.receive(&NEW.answer(&hex(command)), millis(300));
                }
                shimmer.receive(&hex(&format!("ff {inquiry}")), millis(300));
                drain(&mut shimmer).into_iter().find_map(|output| match output {
                    Output::Stream(stream) if stream.name == "ppg" => stream.rate_hz,
                    _ => None,
                })
            },
        );
    assert_eq!(rates, [Some(512.0); 2]);
}

#[test]
fn packets_are_readings_with_the_devices_time_over_its_wrap() {
    for device in [NEW, OLD] {
        let outputs = device.read(&packets(device, 0..20));
        let read = ppg(&outputs);
        assert!(read.len() >= 18);
        assert_eq!(read[2].values, [2.0]);
        assert_eq!(read[2].period_ns, Some(7_812_500.0));
        let times: Vec<i64> = read.iter().filter_map(|reading| reading.device_time_ns).collect();
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] == 7_812_500));
        assert_eq!(events(&outputs), []);
    }
}

#[test]
fn conductance_has_a_stream_of_its_own_beside_the_raw_value() {
    let outputs = NEW.read(&packets(NEW, 0..1));
    let of = |stream| values(&readings(&outputs, stream));
    assert!((of("eda")[0] - 1.1978).abs() < 1e-4);
    assert_eq!(of("eda_raw"), [f64::from(CONDUCTANCE)]);
}

/// The published battery voltage of pyshimmer's test of `8A 94 2E 0B 80`.
#[test]
fn a_battery_has_volts() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    shimmer.tick(millis(300));
    for command in ["3f", "2e", "a3", "2c", "95"] {
        shimmer.receive(&NEW.answer(&hex(command)), millis(300));
    }
    let outputs = drain(&mut shimmer);
    let scale = outputs.iter().find_map(|output| match output {
        Output::Stream(stream) if stream.name == "battery" => Some(stream.channels[0].scale),
        _ => None,
    });
    let volts = values(&readings(&outputs, "battery"))[0] * scale.unwrap();
    assert!((volts - 4.168_246_153_846_154).abs() < 1e-9);
}

#[test]
fn firmware_without_checksums_is_read_without() {
    let (mut shimmer, now) = OLD.streaming();
    shimmer.receive(&packets(OLD, 0..10), now);
    assert_eq!(ppg(&drain(&mut shimmer)).len(), 9); // the last waits for the one behind it
}

#[test]
fn a_lost_byte_costs_at_most_three_packets_and_shifts_no_channel() {
    for device in [NEW, OLD] {
        let bytes = packets(device, 0..40);
        for lost in 0..bytes.len() {
            let mut rest = bytes.clone();
            rest.remove(lost);
            let read = ppg(&device.read(&rest));
            assert!(read.len() >= 40 - 1 - 3, "{lost}: {}", read.len());
            for reading in &read {
                // Where the first packets are lost, the count begins behind them.
                let first = read[0].values[0] as u64;
                assert_eq!(reading.values, [(reading.index + first) as f64], "{lost}");
            }
        }
    }
}

#[test]
fn a_corrupt_byte_costs_at_most_three_packets() {
    for device in [NEW, OLD] {
        let bytes = packets(device, 0..40);
        for at in 0..bytes.len() {
            let mut corrupt = bytes.clone();
            corrupt[at] ^= 0x5a;
            assert!(ppg(&device.read(&corrupt)).len() >= 40 - 1 - 3, "{at}");
        }
    }
}

#[test]
fn a_lost_packet_is_a_gap() {
    for device in [NEW, OLD] {
        let bytes = [packets(device, 0..5), packets(device, 8..15)].concat();
        let outputs = device.read(&bytes);
        let gap = |stream| Event::Gap { stream, samples: Some(3) };
        assert_eq!(events(&outputs), [gap("ppg"), gap("eda"), gap("eda_raw")]);
        assert_eq!(ppg(&outputs)[5].index, 8);
    }
}

#[test]
fn unasked_status_between_packets_costs_nothing() {
    for (device, status) in [
        (NEW, with_sum(hex("8a7110"))),
        (NEW, with_sum(hex("ff8a7110"))),
        (OLD, hex("ff8a7110")),
        (OLD, hex("8a7110")),
    ] {
        let bytes = [packets(device, 0..5), status, packets(device, 5..15)].concat();
        let outputs = device.read(&bytes);
        assert_eq!(events(&outputs), []);
        assert!(ppg(&outputs).len() >= 14);
    }
}

#[test]
fn unasked_status_before_an_answer_is_skipped() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    shimmer.tick(millis(300));
    drain(&mut shimmer);
    shimmer.receive(&hex("8a7120 ff 2503"), millis(300));
    assert!(requests(drain(&mut shimmer)).contains(&vec![0x2e]));
}

#[test]
fn a_device_that_falls_silent_is_set_up_again_and_then_given_up() {
    let (mut shimmer, _) = NEW.streaming();
    let mut outputs = Vec::new();
    while let Some(next) = shimmer.next_tick() {
        shimmer.tick(next);
        for output in drain(&mut shimmer) {
            match &output {
                Output::Request(command) if !is_reset(command) => {
                    shimmer.receive(&NEW.answer(command), next);
                }
                _ => {}
            }
            outputs.push(output);
        }
        outputs.extend(drain_answered(&mut shimmer, next));
    }
    assert_eq!(outputs.last(), Some(&Output::Done(Err(Error::Silent("packets")))));
}

/// Answers until there are no more requests.
fn drain_answered(shimmer: &mut ShimmerSession, now: Duration) -> Vec<Output<Vec<u8>>> {
    let mut all = Vec::new();
    loop {
        let outputs = drain(shimmer);
        if outputs.is_empty() {
            return all;
        }
        for output in outputs {
            if let Output::Request(command) = &output
                && !is_reset(command)
            {
                shimmer.receive(&NEW.answer(command), now);
            }
            all.push(output);
        }
    }
}

#[test]
fn a_mute_device_is_given_up() {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(secs(0));
    while let Some(next) = shimmer.next_tick() {
        shimmer.tick(next);
    }
    let done = drain(&mut shimmer).pop();
    assert_eq!(done, Some(Output::Done(Err(Error::NoAnswer("commands")))));
}

#[test]
fn streaming_is_stopped_before_the_link_is_closed() {
    let (mut shimmer, now) = NEW.streaming();
    shimmer.receive(&packets(NEW, 0..3), now);
    drain(&mut shimmer);
    shimmer.stop(now);
    assert_eq!(requests(drain(&mut shimmer)), [[0x20]]);
    shimmer.receive(&[packets(NEW, 3..5), NEW.answer(&[0x20])].concat(), now);
    let outputs = drain(&mut shimmer);
    assert_eq!(ppg(&outputs).len(), 2);
    assert_eq!(outputs.last(), Some(&Output::Done(Ok(()))));
    assert_eq!(shimmer.next_tick(), None);
}

#[test]
fn a_rate_is_a_whole_number_of_ticks_and_nothing_else() {
    for (rate_hz, interval) in [(128.0, 256_u16), (50.0, 655), (0.0, 65535), (1e9, 1)] {
        let sensors = Sensors::GSR;
        let settings = ShimmerSettings { rate_hz, sensors, ..ShimmerSettings::default() };
        let mut shimmer = ShimmerSession::new(settings);
        shimmer.start(secs(0));
        shimmer.tick(millis(300));
        for command in ["3f", "2e", "a3", "2c", "95"] {
            shimmer.receive(&NEW.answer(&hex(command)), millis(300));
        }
        let [low, high] = interval.to_le_bytes();
        assert!(requests(drain(&mut shimmer)).contains(&vec![0x05, low, high]));
    }
}

/// Packets, replies and noise.
fn piece(device: Device) -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        6 => (0_u32..3000).prop_map(move |from| packets(device, from..from + 4)),
        1 => Just(hex("ff8a7110")),
        1 => Just(with_sum(hex("8a942e0b80"))),
        2 => prop::collection::vec(any::<u8>(), 0..30),
        1 => prop::collection::vec(Just(0_u8), 0..30),
    ]
}

proptest! {
    #[test]
    fn any_bytes_in_any_pieces_are_the_same_readings(
        (device, pieces) in prop::bool::ANY.prop_flat_map(|new| {
            let device = if new { NEW } else { OLD };
            (Just(new), prop::collection::vec(piece(device), 0..30))
        }),
        cuts in prop::collection::vec(1_usize..50, 1..40),
    ) {
        let device = if device { NEW } else { OLD };
        let bytes = pieces.concat();
        let whole = device.read(&bytes);
        let (mut shimmer, now) = device.streaming();
        let (mut rest, mut cuts) = (&bytes[..], cuts.iter().cycle());
        while !rest.is_empty() {
            let (piece, after) = rest.split_at(rest.len().min(*cuts.next().unwrap_or(&1)));
            shimmer.receive(piece, now);
            rest = after;
        }
        prop_assert_eq!(drain(&mut shimmer), whole.clone());
        prop_assert!(whole.len() <= 8 + 8 * bytes.len());
    }

    #[test]
    fn any_answers_in_any_pieces_are_the_same_requests(
        pieces in prop::collection::vec(
            prop_oneof![
                prop::sample::select(vec![0x3f_u8, 0x2e, 0x2c, 0x95, 0x01, 0x8b, 0x05])
                    .prop_map(|command| NEW.answer(&[command])),
                prop::collection::vec(any::<u8>(), 0..20),
            ],
            0..40,
        ),
        cuts in prop::collection::vec(1_usize..50, 1..40),
    ) {
        let bytes = pieces.concat();
        let run = |cuts: &[usize]| {
            let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
            shimmer.start(secs(0));
            shimmer.tick(millis(300));
            let (mut rest, mut cuts) = (&bytes[..], cuts.iter().cycle());
            while !rest.is_empty() {
                let (piece, after) = rest.split_at(rest.len().min(*cuts.next().unwrap_or(&1)));
                shimmer.receive(piece, millis(300));
                rest = after;
            }
            drain(&mut shimmer)
        };
        prop_assert_eq!(run(&cuts), run(&[usize::MAX]));
    }
}
