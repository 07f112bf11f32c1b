//! Sessions with a Myo armband.

mod support;

use proptest::prelude::*;
use support::{drain, events, millis, readings, requests, secs, values};
use teampulse_devices::gatt::Request;
use teampulse_devices::myo::{
    CLASSIFIER, COMMAND, Command, EMG, EmgMode, FIRMWARE, IMU, INFORMATION, MOTION, MyoSession,
    MyoSettings, SERVICE, Vibration,
};
use teampulse_devices::{Error, Event, GattSession, Identity, Output, Session};

fn started() -> MyoSession {
    let mut myo = MyoSession::new(MyoSettings::default());
    myo.start(secs(0));
    drain(&mut myo);
    myo
}

fn write(command: Command) -> Request {
    Request::Write(COMMAND, command.encode())
}

const MODE: Command = Command::SetMode { emg: EmgMode::Raw, imu: true, poses: true };

#[test]
fn its_service_has_the_uuid_of_the_header() {
    assert_eq!(SERVICE.to_string(), "d5060001-a904-deb9-4748-2c7f4a124842");
}

#[test]
fn all_four_emg_characteristics_are_subscribed_to_before_the_mode_is_set() {
    let mut myo = MyoSession::new(MyoSettings::default());
    myo.start(secs(0));
    let asked = requests(drain(&mut myo));
    assert_eq!(asked[..4], EMG.map(Request::Subscribe));
    let at = |request: Request| asked.iter().position(|one| *one == request);
    assert!(at(write(Command::StayAwake(true))) < at(write(MODE)));
    assert!(at(write(MODE)) > Some(3));
}

#[test]
fn a_user_feels_that_it_is_connected() {
    let vibrates = |vibrates| {
        let mut myo = MyoSession::new(MyoSettings { vibrates, ..MyoSettings::default() });
        myo.start(secs(0));
        requests(drain(&mut myo)).contains(&write(Command::Vibrate(Vibration::Short)))
    };
    assert_eq!([true, false].map(vibrates), [true, false]);
}

#[test]
fn a_notification_holds_two_samples_of_eight_electrodes() {
    let mut myo = started();
    let value: Vec<u8> = (0..16).map(|k| if k < 8 { k } else { 0_u8.wrapping_sub(k) }).collect();
    myo.receive(EMG[0], &value, millis(10));
    myo.receive(EMG[1], &value, millis(20));
    let read = readings(&drain(&mut myo), "emg");
    assert_eq!(read[0].values[..8], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!(read[0].values[8..], [-8.0, -9.0, -10.0, -11.0, -12.0, -13.0, -14.0, -15.0]);
    assert_eq!(read[1].index, 2);
}

#[test]
fn a_turn_that_is_left_out_is_a_gap_of_two_samples() {
    let mut myo = started();
    for (ms, turn) in [(10, 0), (20, 1), (40, 3), (50, 0), (90, 0)] {
        myo.receive(EMG[turn], &[0; 16], millis(ms));
    }
    let outputs = drain(&mut myo);
    let gap = |samples| Event::Gap { stream: "emg", samples: Some(samples) };
    assert_eq!(events(&outputs), [gap(2), gap(6)]);
    let indices: Vec<u64> = readings(&outputs, "emg").iter().map(|read| read.index).collect();
    assert_eq!(indices, [0, 2, 6, 8, 16]);
}

#[test]
fn after_a_silence_what_was_held_up_is_not_missing() {
    let mut myo = started();
    for (ms, turn) in [(10, 0), (900, 1), (900, 2), (901, 3)] {
        myo.receive(EMG[turn], &[0; 16], millis(ms));
    }
    let outputs = drain(&mut myo);
    assert_eq!(events(&outputs), []);
    let indices: Vec<u64> = readings(&outputs, "emg").iter().map(|read| read.index).collect();
    assert_eq!(indices, [0, 2, 4, 6]);
}

#[test]
fn the_imu_has_a_quaternion_g_and_degrees_per_second() {
    let mut myo = MyoSession::new(MyoSettings::default());
    myo.start(secs(0));
    let value: Vec<u8> = [16384_i16, 0, 0, 0, 0, 0, -2048, 0, 0, 16]
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    myo.receive(IMU, &value, millis(20));
    let outputs = drain(&mut myo);
    let last = |stream: &str, at: usize| {
        let scale = outputs.iter().find_map(|output| match output {
            Output::Stream(one) if one.name == stream => Some(one.channels[at].scale),
            _ => None,
        });
        values(&readings(&outputs, stream))[at] * scale.unwrap_or(f64::NAN)
    };
    let converted = vec![last("orientation", 0), last("acceleration", 2), last("gyroscope", 2)];
    assert_eq!(converted, [1.0, -1.0, 1.0]);
}

#[test]
fn poses_and_taps_are_markers() {
    let mut myo = started();
    myo.receive(CLASSIFIER, &[1, 1, 2], secs(1));
    myo.receive(CLASSIFIER, &[3, 1, 0], secs(1));
    myo.receive(CLASSIFIER, &[3, 0xff, 0xff], secs(1));
    myo.receive(MOTION, &[0, 1, 1], secs(1));
    let marker = |name| Event::Marker { name, device_time_ns: None };
    let expected = ["arm_synced", "pose_fist", "pose_unknown", "tap"].map(marker);
    assert_eq!(events(&drain(&mut myo)), expected);
}

#[test]
fn its_serial_number_is_sent_last_byte_first() {
    let mut myo = started();
    let mut information = vec![0x8e, 0x32, 0x94, 0x85, 0x3b, 0xd2];
    information.extend([0; 14]);
    myo.receive(INFORMATION, &information, secs(0));
    myo.receive(FIRMWARE, &[1, 0, 5, 0, 0xb2, 7, 2, 0], secs(0));
    let identified = |part, value: &str| Event::Identified { part, value: value.to_owned() };
    let expected = [
        identified(Identity::Serial, "D2:3B:85:94:32:8E"),
        identified(Identity::Firmware, "1.5.1970"),
    ];
    assert_eq!(events(&drain(&mut myo)), expected);
}

#[test]
fn it_is_kept_awake_every_fifteen_seconds() {
    let mut myo = started();
    for ms in (1000..=15_000).step_by(1000) {
        myo.tick(millis(ms));
        myo.receive(IMU, &[0; 20], millis(ms));
    }
    let asked = requests(drain(&mut myo));
    assert_eq!(asked, [write(Command::StayAwake(true)), write(MODE)]);
}

#[test]
fn a_myo_that_stops_sending_is_set_again_and_then_given_up() {
    let mut myo = started();
    let mut now = secs(0);
    while let Some(next) = myo.next_tick() {
        now = next;
        myo.tick(now);
    }
    let outputs = drain(&mut myo);
    assert_eq!((now, outputs.last()), (secs(8), Some(&Output::Done(Err(Error::Silent("emg"))))));
    assert_eq!(requests(outputs).iter().filter(|one| **one == write(MODE)).count(), 3);
}

#[test]
fn it_is_set_to_rest_at_the_end() {
    let mut myo = started();
    myo.stop(secs(9));
    let outputs = drain(&mut myo);
    assert_eq!(outputs.last(), Some(&Output::Done(Ok(()))));
    let off = Command::SetMode { emg: EmgMode::Off, imu: false, poses: false };
    assert_eq!(requests(outputs), [write(off), write(Command::StayAwake(false))]);
}

#[test]
fn a_lost_link_is_a_gap_and_the_count_goes_on() {
    let mut myo = started();
    myo.receive(EMG[0], &[0; 16], millis(10));
    myo.receive(IMU, &[0; 20], millis(10));
    myo.start(secs(5));
    myo.receive(EMG[3], &[0; 16], secs(6));
    let outputs = drain(&mut myo);
    let gaps = ["emg", "orientation", "acceleration", "gyroscope"]
        .map(|stream| Event::Gap { stream, samples: None });
    assert_eq!(events(&outputs), gaps);
    assert_eq!(readings(&outputs, "emg")[1].index, 2);
}

proptest! {
    #[test]
    fn any_values_are_read_or_discarded(
        arrivals in prop::collection::vec(
            (0_u64..3000, 0_usize..9, prop::collection::vec(any::<u8>(), 0..30)), 0..60,
        ),
    ) {
        let mut myo = started();
        let mut now = secs(0);
        let [first, second, third, fourth] = EMG;
        let all = [first, second, third, fourth, IMU, MOTION, CLASSIFIER, INFORMATION, FIRMWARE];
        for (wait, which, value) in arrivals {
            now += millis(wait);
            myo.tick(now);
            drain(&mut myo);
            myo.receive(all[which], &value, now);
            prop_assert!(drain(&mut myo).len() <= 3);
        }
    }
}
