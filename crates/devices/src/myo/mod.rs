//! Myo armband: eight EMG electrodes and an IMU over Bluetooth Low Energy. Sold until 2018.
//!
//! Sources: github.com/thalmiclabs/myo-bluetooth (`myohw.h`, Apache-2.0), which says big endian where the device sends
//! little endian; the clients dl-myo, myo-raw, Dongleless-myo and Open-Myo, whose issues are cited. UUIDs are
//! `d506nnnn-a904-deb9-4748-2c7f4a124842`, with `nnnn` from the table; the supplied USB dongle is not needed.
//!
//! | characteristic | bytes | |
//! |---|---|---|
//! | `0101` read | 20: serial number (6, last first), pose, classifier, SKU | |
//! | `0201` read | 8: major, minor, patch, hardware, each u16 | |
//! | `0401` write | command, length, payload; see [`Command`] | |
//! | `0402` notify | 20: quaternion w x y z in 1/16384, acceleration in 1/2048 g, rotation in 1/16 deg/s, each i16 | 50 Hz |
//! | `0502` indicate | 3: 0 tap, direction, count | |
//! | `0103` indicate | 3: 1 synced · 2 unsynced · 3 pose (u16) · 4 unlocked · 5 locked · 6 sync failed | |
//! | `0105`, `0205`, `0305`, `0405` notify | 16: two samples of eight i8, one after the other | 200 Hz together |
//!
//! Streams of a [`MyoSession`]: `emg` (no unit: the maker published none), `orientation`, `acceleration` (`g`),
//! `gyroscope` (`deg/s`), `battery`; poses, taps and synchronisation are markers. There is no clock and no counter.
//!
//! Quirks, each with a test:
//! - A notification holds two samples, 5 ms apart, and the four characteristics take turns: all four are subscribed to.
//! - Which of the four sends next acts as a two-bit counter: up to three lost notifications are a gap of known length.
//! - After a silence on a link that stays up, the count continues: Bluetooth repeats what was not acknowledged.
//! - It sleeps after 30 s without movement, even with sleep switched off, unless that command is repeated: every 15 s.
//! - It may stop sending: its mode is set again after two seconds.
//! - A user can't see whether it is connected, so it vibrates briefly.
//! - Left in streaming mode, it drains its battery: the mode is reset at the end.

mod session;
mod command;
mod emg;

pub use command::{Command, EmgMode, Vibration};
pub use session::{MyoSession, MyoSettings};

use crate::gatt::Uuid;

/// Returns the UUID of a Myo's service or characteristic, by its number in the table.
pub const fn uuid(number: u16) -> Uuid {
    Uuid(0xd506_0000_a904_deb9_4748_2c7f_4a12_4842 | (number as u128) << 96)
}

/// The control service, by which a Myo is recognised, as users can change its name.
pub const SERVICE: Uuid = uuid(0x0001);

/// The characteristic for commands.
pub const COMMAND: Uuid = uuid(0x0401);

/// The characteristic with the serial number and other information.
pub const INFORMATION: Uuid = uuid(0x0101);

/// The characteristic with the firmware version.
pub const FIRMWARE: Uuid = uuid(0x0201);

/// The characteristic with orientation, acceleration and rotation.
pub const IMU: Uuid = uuid(0x0402);

/// The characteristic with taps.
pub const MOTION: Uuid = uuid(0x0502);

/// The characteristic with poses.
pub const CLASSIFIER: Uuid = uuid(0x0103);

/// The four characteristics with EMG, which take turns.
pub const EMG: [Uuid; 4] = [uuid(0x0105), uuid(0x0205), uuid(0x0305), uuid(0x0405)];
