//! Any values at any times, in sessions with wearables: readings or discarded bytes, never a panic.
#![no_main]

use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use teampulse_devices::empatica_e4::{E4Session, E4Settings};
use teampulse_devices::gatt::Uuid;
use teampulse_devices::heart_rate::{self, HeartRateSession};
use teampulse_devices::inputs::evdev::{Abilities, Translator};
use teampulse_devices::inputs::{Kind, Seconds};
use teampulse_devices::myo::{self, MyoSession, MyoSettings};
use teampulse_devices::polar::{self, Measurement, PolarSession, Selection};
use teampulse_devices::shimmer3::{ShimmerSession, ShimmerSettings};
use teampulse_devices::{ByteSession, GattSession, Output, Session};

const BATTERY: Uuid = Uuid::short(0x2a19);

/// When a Shimmer has been drained.
const START: Duration = Duration::from_millis(300);

/// Milliseconds that pass, which characteristic, and its value.
type Arrival<'a> = (u16, u8, &'a [u8]);

fuzz_target!(|arrivals: Vec<Arrival<'_>>| {
    let mut e4 = E4Session::new(E4Settings::default());
    e4.start(Duration::ZERO);
    bytes(e4, &arrivals);
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(Duration::ZERO);
    bytes(shimmer, &arrivals);
    bytes(streaming_shimmer(), &arrivals);
    let [first, second, third, fourth] = myo::EMG;
    let myo = [first, second, third, fourth, myo::IMU, myo::CLASSIFIER, myo::INFORMATION];
    gatt(MyoSession::new(MyoSettings::default()), &myo, &arrivals);
    let all = Measurement::ALL.map(Selection::of);
    gatt(PolarSession::new(&all), &[polar::DATA, polar::CONTROL], &arrivals);
    gatt(HeartRateSession::new(), &[heart_rate::MEASUREMENT, BATTERY], &arrivals);
    inputs(&arrivals);
});

fn gatt(mut session: impl GattSession, characteristics: &[Uuid], arrivals: &[Arrival<'_>]) {
    let mut now = Duration::ZERO;
    session.start(now);
    for (wait, which, value) in arrivals {
        now += Duration::from_millis((*wait).into());
        session.tick(now);
        session.receive(characteristics[usize::from(*which) % characteristics.len()], value, now);
        drain(&mut session, value.len());
    }
    session.stop(now);
    while let Some(next) = session.next_tick() {
        session.tick(next);
        drain(&mut session, 0);
    }
}

/// A Shimmer without checksums that was set up: skin conductance and PPG at 128 Hz.
fn streaming_shimmer() -> ShimmerSession {
    let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
    shimmer.start(Duration::ZERO);
    shimmer.tick(START);
    shimmer.receive(&[0xff, 0x25, 3, 0xff, 0x2f, 3, 0, 0, 0, 16, 11, 0xff, 0xfe, 0xfe], START);
    shimmer.receive(&[0xff; 4], START);
    shimmer.receive(&[0xff, 2, 0, 1, 2, 9, 0, 9, 2, 1, 0x12, 0x1c, 0xfe], START);
    assert!(std::iter::from_fn(|| shimmer.poll()).any(|output| output == Output::Request(vec![7])));
    shimmer
}

fn bytes(mut session: impl ByteSession, arrivals: &[Arrival<'_>]) {
    let mut now = START;
    for (wait, _, bytes) in arrivals {
        now += Duration::from_millis((*wait).into());
        session.tick(now);
        session.receive(bytes, now);
        drain(&mut session, bytes.len());
    }
    session.stop(now);
    while let Some(next) = session.next_tick() {
        session.tick(next);
        drain(&mut session, 0);
    }
}

/// A byte makes no more than 64 outputs.
fn drain<R>(session: &mut dyn Session<Request = R>, bytes: usize) {
    let outputs = std::iter::from_fn(|| session.poll()).count();
    assert!(outputs <= 64 + 64 * bytes);
}

/// A keyboard, mouse and gamepad in one, with axes of any ranges.
fn inputs(arrivals: &[Arrival<'_>]) {
    let range = |(code, (least, most, _)): (u16, &Arrival<'_>)| {
        (code, i32::from(*least) - 0x8000, i32::from(*most))
    };
    let absolute = (0..24).zip(arrivals).map(range).collect();
    let keys = vec![16, 57, 0x110, 0x130];
    let abilities = Abilities { keys, relative: vec![0, 1, 8], absolute };
    let mut translator = Translator::new(&abilities, &Kind::ALL);
    let mut all = Kind::ALL.map(|kind| Seconds::new(kind, 0));
    let mut at_ns = 0_i64;
    for (wait_ms, which, value) in arrivals {
        at_ns = at_ns.saturating_add(i64::from(*wait_ms) * 1_000_000);
        for value in value.chunks_exact(4) {
            let number = i32::from_le_bytes(value.try_into().expect("four bytes"));
            let acts = translator.take(u16::from(*which % 4), u16::from(value[0]) * 3, number);
            for seconds in &mut all {
                acts.iter().for_each(|act| seconds.take(at_ns, act));
                seconds.until(at_ns);
            }
        }
    }
}
