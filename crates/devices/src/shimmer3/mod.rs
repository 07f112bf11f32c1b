//! Shimmer3 GSR+ (and other Shimmer3) with the `LogAndStream` firmware, over Bluetooth RFCOMM or a serial port.
//!
//! Sources: the firmware, github.com/ShimmerResearch/log-and-stream-common at 12db787 and shimmer3 at db65e6c; the
//! vendor's Java API; pyshimmer's tests. Little endian unless noted. Every accepted command is answered with `FF`, then
//! its reply; a refused one with `FE`.
//!
//! | command | reply | |
//! |---|---|---|
//! | `20` | | stop streaming |
//! | `3F` | `25` version | hardware: 3 is a Shimmer3, 10 a `Shimmer3R` |
//! | `2E` | `2F` type u16, major u16, minor u8, release u8 | firmware: type 3 is `LogAndStream` |
//! | `95` | `8A 94` adc u16, status u8 | battery: volts = adc · 3 / 4095 · 1.988 |
//! | `2C` | `2D` 4 × 21 bytes | calibration: of LN accelerometer, gyroscope, magnetometer, WR accelerometer |
//! | `05` u16 | | sampling interval in ticks of 1/32768 s |
//! | `08` 3 bytes | | sensors, see [`Sensors`] |
//! | `21` u8 | | range of the conductance: 0 to 3, 4 automatic |
//! | `5E` u8 | | power for the optical sensor |
//! | `A3 00` | | no `FF` before unsolicited status (firmware 0.15.4) |
//! | `8B 02` | | two bytes of [`crc`] after everything |
//! | `01` | `02` ticks u16, config (4 bytes, 7 of a `Shimmer3R`), n u8, buffer u8, n channel IDs | what a packet holds |
//! | `07` | | start streaming |
//!
//! Packet: `00`, time u24 \[1/32768 s\], the channels in the order of `01`, the checksum.
//!
//! Streams of a [`ShimmerSession`], each of one quantity: `eda` (conductance in `uS`) and `eda_raw` (with the range in
//! bits 14–15), `ppg` (`mV`), `acceleration_low_noise`, `acceleration_wide_range` (`m/s^2`), `gyroscope` (`deg/s`) and
//! `magnetometer` (relative to the local flux) as calibrated, each with its `…_raw`, `battery` (`V`), and the other
//! channels unchanged. Device times count from the first packet's 24 bits, and continue across wraps.
//!
//! Quirks, each with a test:
//! - The time wraps every 512 s.
//! - Nothing marks the start of a packet: `00` occurs in the data, too. With a checksum, a packet is accepted when the
//!   checksum matches; without one, when the next packet begins right after it with the right time, so readings are one
//!   packet late. Otherwise the driver searches for three packets in a row. A lost byte costs one packet and shifts no
//!   channel.
//! - Firmware without checksums or without `A3` does not answer these commands: the session continues without them.
//! - Status (`8A 71`, with or without `FF`) arrives unsolicited at any time.
//! - After a session was cut off, the device keeps streaming: stop it, turn checksums off and drain for 300 ms before
//!   any other request.
//! - Settings are refused while the device streams: they are made before, and read back.
//! - The range switches automatically: the raw value states which resistor was active. Before the first value of the
//!   new range, the firmware repeats the last one of the old range for 80 ms, so that `eda` is late by up to 80 ms
//!   there.

pub mod crc;
mod session;
mod setup;
mod packets;
mod framer;
mod channels;
mod sensors;
mod gsr;
mod calibration;
mod clock;

pub use calibration::Calibration;
pub use gsr::{Gsr, GsrRange};
pub use sensors::Sensors;
pub use session::{ShimmerSession, ShimmerSettings};

/// The ticks of the device's clock per second.
pub const TICKS_HZ: u32 = 32768;
