//! The decoders of `teampulse-devices` against an emulated Myo: they read what was measured, whatever fails.

use std::time::Duration;

use teampulse_devices::gatt::Request;
use teampulse_devices::myo::{self, MyoSession, MyoSettings, uuid};
use teampulse_devices::{Event, GattSession, Output, Reading, Session};
use teampulse_emulators::devices::{Myo, MyoFault, MyoIncident, Wearer};

/// Muscles that encode the number of their sample, at 200 per second.
struct Numbers;

impl Wearer for Numbers {
    fn muscles(&mut self, secs: f64) -> [f64; 8] {
        [(secs * 200.0).round().rem_euclid(100.0); 8]
    }
}

/// The outputs of a session with a Myo until it is stopped at a time; and the Myo afterwards.
fn read(mut device: Myo, secs: u64) -> (Vec<Output<Request>>, Myo) {
    let mut session = MyoSession::new(MyoSettings::default());
    session.start(Duration::ZERO);
    let mut outputs = Vec::new();
    for now_ms in (0..=secs * 1000).step_by(5) {
        let now = Duration::from_millis(now_ms);
        for (characteristic, value) in device.until(now.as_secs_f64(), &mut Numbers) {
            session.receive(uuid(characteristic), &value, now);
        }
        session.tick(now);
        if now_ms == secs * 1000 {
            session.stop(now);
        }
        while let Some(output) = session.poll() {
            match &output {
                Output::Request(Request::Write(_, command)) => assert!(device.write(command)),
                Output::Request(Request::Subscribe(of)) => {
                    let numbers = [0x0105, 0x0205, 0x0305, 0x0405, 0x0402, 0x0502, 0x0103];
                    numbers
                        .into_iter()
                        .filter(|one| uuid(*one) == *of)
                        .for_each(|one| device.subscribe(one));
                }
                _ => {}
            }
            outputs.push(output);
        }
    }
    (outputs, device)
}

fn with(fault: MyoFault) -> Myo {
    Myo::new(vec![MyoIncident { at_secs: 10.0, fault }])
}

fn emg(outputs: &[Output<Request>]) -> Vec<Reading> {
    let of_stream = |output: &Output<Request>| match output {
        Output::Reading(reading) if reading.stream == "emg" => Some(reading.clone()),
        _ => None,
    };
    outputs.iter().filter_map(of_stream).collect()
}

/// Asserts that every sample has the number under which it was taken.
fn assert_numbered(outputs: &[Output<Request>]) {
    let readings = emg(outputs);
    let begin = readings[0].values[0];
    for reading in &readings {
        for (at, sample) in (reading.index..).zip(reading.values.chunks(8)) {
            assert_eq!(sample, [(begin + at as f64).rem_euclid(100.0); 8]);
        }
    }
}

#[test]
fn every_sample_is_read_under_its_number_and_it_stays_awake() {
    let (outputs, device) = read(Myo::default(), 90);
    assert_numbered(&outputs);
    assert!(emg(&outputs).len() > 8990);
    assert!(!outputs.iter().any(|output| matches!(output, Output::Event(_))));
    assert_eq!((device.vibrations(), device.is_streaming()), (1, false));
}

#[test]
fn up_to_three_lost_notifications_are_a_gap_of_their_length() {
    for lost in 1..4 {
        let (outputs, _) = read(with(MyoFault::LostEmg(lost)), 20);
        assert_numbered(&outputs);
        let gap = Event::Gap { stream: "emg", samples: Some(2 * u64::from(lost)) };
        assert!(outputs.contains(&Output::Event(gap)));
    }
}

#[test]
fn a_myo_that_stalls_is_set_again() {
    let (outputs, _) = read(with(MyoFault::Stall), 20);
    let stalled =
        |output: &&Output<Request>| matches!(output, Output::Event(Event::Stalled { .. }));
    assert_eq!(outputs.iter().filter(stalled).count(), 1);
    assert!(emg(&outputs).len() > 1700);
}

#[test]
fn after_each_fault_the_emg_is_back_within_five_seconds() {
    for fault in [MyoFault::LostEmg(3), MyoFault::LostEmg(100), MyoFault::Stall] {
        let (outputs, _) = read(with(fault), 30);
        let samples: usize = emg(&outputs).iter().map(|reading| reading.values.len() / 8).sum();
        // What is missing of 30 s is the only gap, and the time until it was set at first.
        let gap_secs = 30.0 - samples as f64 / 200.0;
        eprintln!("Myo {fault:?}: the EMG is back {gap_secs:.2} s of the Myo after it (bar 5)");
        assert!(gap_secs < 5.0, "{fault:?}");
    }
}

#[test]
fn a_pose_is_a_marker() {
    let (outputs, _) = read(with(MyoFault::Pose(1)), 11);
    let marker = Event::Marker { name: "pose_fist", device_time_ns: None };
    assert!(outputs.contains(&Output::Event(marker)));
    assert_eq!(myo::SERVICE, uuid(1));
}
