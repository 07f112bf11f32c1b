//! Decodes a dump of notifications: `cargo run --example decode [dump]`.
//!
//! Each line of a dump has: milliseconds, the first eight digits of the characteristic, the value in hexadecimal
//! digits.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::time::Duration;

use teampulse_devices::polar::{self, Measurement, PolarSession, Selection};
use teampulse_devices::{GattSession, Output, Session, gatt::Uuid, heart_rate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dump = match std::env::args().nth(1) {
        Some(path) => std::fs::read_to_string(path)?,
        None => include_str!("h10.txt").to_owned(),
    };
    let mut strap = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
    strap.start(Duration::ZERO);
    for line in dump.lines().filter(|line| !line.starts_with('#')) {
        let Some((now, characteristic, value)) = parse(line) else {
            return Err(format!("this is no line of a dump: {line}").into());
        };
        strap.tick(now);
        strap.receive(characteristic, &value, now);
        while let Some(output) = strap.poll() {
            print(&output);
        }
    }
    Ok(())
}

fn parse(line: &str) -> Option<(Duration, Uuid, Vec<u8>)> {
    let mut fields = line.split_whitespace();
    let now = Duration::from_millis(fields.next()?.parse().ok()?);
    let name = fields.next()?;
    let known = [polar::CONTROL, polar::DATA, heart_rate::MEASUREMENT];
    let characteristic = known.into_iter().find(|uuid| uuid.to_string().starts_with(name))?;
    let digits = fields.next()?.as_bytes().chunks(2);
    let byte = |digits| u8::from_str_radix(str::from_utf8(digits).ok()?, 16).ok();
    Some((now, characteristic, digits.map(byte).collect::<Option<_>>()?))
}

fn print<R: std::fmt::Debug>(output: &Output<R>) {
    match output {
        Output::Request(request) => println!("do      {request:?}"),
        Output::Stream(stream) => println!("stream  {} {:?} Hz", stream.name, stream.rate_hz),
        Output::Reading(reading) => {
            let (stream, index, count) = (reading.stream, reading.index, reading.values.len());
            println!("reading {stream} from {index}: {count} values, {:?}", reading.device_time_ns);
        }
        Output::Event(event) => println!("event   {event:?}"),
        Output::Done(result) => println!("done    {result:?}"),
    }
}
