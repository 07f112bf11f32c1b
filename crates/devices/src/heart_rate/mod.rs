//! Any heart rate strap: the Heart Rate service (0x180D) of the Bluetooth SIG.
//!
//! Heart Rate Measurement (0x2A37), notified about once a second. Little endian; Heart Rate Service
//! 1.0, 3.1, and GATT Specification Supplement, 3.115.
//!
//! | bytes | field | unit |
//! |---|---|---|
//! | 1 | flags: bit 0 heart rate has 16 bits · bit 1 contact · bit 2 contact is measured · bit 3 energy follows · bit 4 intervals follow | |
//! | 1 or 2 | heart rate | 1/min |
//! | 0 or 2 | energy expended since its last reset | kJ |
//! | 0, 2, 4 … | RR intervals, oldest first, up to nine in one notification | 1/1024 s |
//!
//! Streams of a [`HeartRateSession`]: `heart_rate` with its `contact` (1 on the skin, 0 off, NaN not
//! measured), `rr_interval`, `energy_expended`, `battery`. The service has no clock and no counter.
//!
//! Quirks, each with a test:
//! - One notification carries several intervals, or none. A driver that takes only the first one loses beats.
//! - An interval is in units of 1/1024 s, not 1 ms: the scale of the channel is 1000/1024.
//! - Intervals arrive up to four seconds late and have no stamps: only if their sum falls short of the elapsed time by
//!   more than three seconds is that a gap.
//! - If contact is not measured, its bit has no meaning.

mod measurement;
mod receiver;
mod session;

pub use measurement::{HeartRateMeasurement, RR_INTERVAL_MS};
pub use session::HeartRateSession;

pub(crate) use receiver::HeartRateReceiver;

use crate::gatt::Uuid;

/// The Heart Rate service.
pub const SERVICE: Uuid = Uuid::short(0x180d);

/// The Heart Rate Measurement characteristic.
pub const MEASUREMENT: Uuid = Uuid::short(0x2a37);
