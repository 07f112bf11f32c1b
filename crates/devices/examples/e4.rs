//! Prints the samples of an Empatica E4: `cargo run --example e4 [server:28000]`.
//!
//! Everything that a driver over TCP needs: a socket, a clock, and the session.

#![expect(clippy::print_stdout, reason = "an example prints")]

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use teampulse_devices::empatica_e4::{E4Session, E4Settings};
use teampulse_devices::{ByteSession, Output, Session};

#[expect(clippy::disallowed_methods, reason = "a driver brings the time")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let server = std::env::args().nth(1).unwrap_or_else(|| "127.0.0.1:28000".to_owned());
    let mut socket = TcpStream::connect(server)?;
    let begin = Instant::now();
    let mut e4 = E4Session::new(E4Settings::default());
    e4.start(begin.elapsed());
    let mut bytes = [0; 4096];
    loop {
        while let Some(output) = e4.poll() {
            match output {
                Output::Request(line) => socket.write_all(&line)?,
                Output::Reading(reading) => println!("{} {:?}", reading.stream, reading.values),
                Output::Stream(stream) => println!("{stream:?}"),
                Output::Event(event) => println!("{event:?}"),
                Output::Done(result) => return Ok(result?),
            }
        }
        let deadline = e4.next_tick().unwrap_or(Duration::MAX).saturating_sub(begin.elapsed());
        // A time-out of zero would be none.
        socket.set_read_timeout(Some(
            deadline.clamp(Duration::from_millis(1), Duration::from_secs(1)),
        ))?;
        match socket.read(&mut bytes) {
            Ok(0) => return Err("the server closed the connection".into()),
            Ok(count) => e4.receive(bytes.get(..count).unwrap_or_default(), begin.elapsed()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error.into()),
        }
        e4.tick(begin.elapsed());
    }
}
