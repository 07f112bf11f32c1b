//! Driving sessions in tests.
#![allow(dead_code, reason = "each test uses a part")]

use std::time::Duration;

use teampulse_devices::{Event, Output, Reading, Session};

pub const fn secs(secs: u64) -> Duration {
    Duration::from_secs(secs)
}

pub const fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// All outputs that a session has now.
pub fn drain<R>(session: &mut dyn Session<Request = R>) -> Vec<Output<R>> {
    std::iter::from_fn(|| session.poll()).collect()
}

pub fn requests<R>(outputs: Vec<Output<R>>) -> Vec<R> {
    let request = |output| if let Output::Request(request) = output { Some(request) } else { None };
    outputs.into_iter().filter_map(request).collect()
}

pub fn readings<R>(outputs: &[Output<R>], stream: &str) -> Vec<Reading> {
    let of_stream = |output: &Output<R>| match output {
        Output::Reading(reading) if reading.stream == stream => Some(reading.clone()),
        _ => None,
    };
    outputs.iter().filter_map(of_stream).collect()
}

pub fn events<R>(outputs: &[Output<R>]) -> Vec<Event> {
    let event =
        |output: &Output<R>| if let Output::Event(e) = output { Some(e.clone()) } else { None };
    outputs.iter().filter_map(event).collect()
}

pub fn values(readings: &[Reading]) -> Vec<f64> {
    readings.iter().flat_map(|reading| reading.values.iter().copied()).collect()
}

/// The bytes of a line of hexadecimal digits; spaces are ignored.
pub fn hex(digits: &str) -> Vec<u8> {
    let digits: Vec<u32> = digits.chars().filter_map(|c| c.to_digit(16)).collect();
    digits
        .chunks(2)
        .map(|pair| pair.iter().fold(0, |byte, digit| byte << 4 | *digit as u8))
        .collect()
}
