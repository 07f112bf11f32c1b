//! Polar H10, Verity Sense, OH1: the Polar Measurement Data (PMD) service.
//!
//! Sources: Polar's SDK and its *Online measurement* specification 1.0 (August 2024),
//! github.com/polarofficial/polar-ble-sdk; issues cited by number are of that repository. Little endian.
//!
//! Control point (write with response, indications), one command at a time:
//!
//! | bytes | command | | bytes | answer |
//! |---|---|---|---|---|
//! | 1 | 1 settings? · 2 start · 3 stop | | 1 | `F0` |
//! | 1 | measurement | | 1, 1 | the command's two bytes |
//! | n | settings: kind, count, values | | 1 | status, see [`Status`] |
//! | | | | 1 | whether parameters continue in another answer |
//! | | | | n | parameters, in the layout of settings |
//!
//! Data (notifications):
//!
//! | bytes | field |
//! |---|---|
//! | 1 | measurement in bits 0–5 |
//! | 8 | time of the **last** sample \[ns\] since 2000-01-01 UTC; an H10 that was never set begins at 2019-01-01 |
//! | 1 | frame type; bit 7: compressed |
//! | n | samples; for a compressed frame one whole sample, then blocks of bit width, count and differences |
//!
//! Streams of a [`PolarSession`], as selected: `ecg` (130 Hz, `uV`), `acceleration` (`g`), `ppg`, `gyroscope`
//! (`deg/s`), `magnetometer` (`uT`), `pp_interval` (`ms`); and those of [`heart_rate`](crate::heart_rate), which every
//! model has.
//!
//! Quirks, each with a test:
//! - Streams must be stopped before the link is closed, or an H10 keeps measuring until its battery is removed.
//! - After a lost link a stream may still be on: a start is answered with *already in state*. The stream is stopped and
//!   started again; if it is still on, arriving data are accepted (issues 186, 255).
//! - The answer *invalid MTU* after a reconnect is temporary: disconnect, wait, connect (issue 222).
//! - A read of the control point returns the features, never an answer, and `BlueZ` repeats it as an indication (issue
//!   360).
//! - The stamp is the time of the last sample. After a lost frame the samples keep their period: the gap is before
//!   them.
//! - Stamps may jump back or repeat (issue 387): such frames are dropped.
//! - The rate is 130 Hz within 2 %, and a Verity Sense before 2.1.0 sends PPG at 55 Hz but states 135 Hz: the period is
//!   measured.
//! - The first ECG after a connection may take 20 to 30 s. After ten seconds the device is asked once more to start: a
//!   strap that is measuring answers *already in state*; one that is not starts.
//! - Intervals between pulses arrive five seconds' worth at a time, the first after 25 s, and without a time (issue
//!   484).
//! - While ECG is on, a strap without skin contact keeps its link and sends noise (issue 383).
//! - ECG and acceleration together have broken links: select only what is needed.

mod session;
mod feed;
mod control;
mod settings;
mod frame;
mod delta;
mod layout;
mod timeline;

pub use control::{Command, ControlMessage, Features, Response, Status};
pub use frame::{EPOCH_UNIX_SECS, Frame, PpInterval, Samples};
pub use layout::Measurement;
pub use session::{PolarSession, Selection};
pub use settings::{SettingKind, SettingsList};

use crate::gatt::Uuid;

/// The Polar Measurement Data service.
pub const SERVICE: Uuid = Uuid(0xfb00_5c80_02e7_f387_1cad_8acd_2d8d_f0c8);

/// The control point of the service: features, commands and answers.
pub const CONTROL: Uuid = Uuid(0xfb00_5c81_02e7_f387_1cad_8acd_2d8d_f0c8);

/// The data characteristic of the service.
pub const DATA: Uuid = Uuid(0xfb00_5c82_02e7_f387_1cad_8acd_2d8d_f0c8);
