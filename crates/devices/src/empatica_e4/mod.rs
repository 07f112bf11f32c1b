//! Empatica E4 through its streaming server: a Windows program with the E4's dongle, lines of text over TCP.
//!
//! Empatica ended the E4 and its software on 2025-02-14; the server still runs where it is installed. Sources: the
//! server's protocol pages as kept by github.com/phelstab/sensoring, and issues of
//! github.com/empatica/ble-client-windows and github.com/empatica/empalink. TCP port 28000, UTF-8, lines end with
//! `\r\n`, one E4 for each connection.
//!
//! | request | answer |
//! |---|---|
//! | `device_list` | `R device_list 1 \| 9ff167 Empatica_E4` |
//! | `device_connect 9ff167` | `R device_connect OK` or `… ERR <reason>` |
//! | `pause ON` or `OFF` | `R pause ON` |
//! | `device_subscribe bvp ON` | `R device_subscribe bvp OK` or `… ERR <reason>` |
//! | `device_disconnect` | `R device_disconnect OK`, and the server closes the connection |
//!
//! | line | stream | unit | rate |
//! |---|---|---|---|
//! | `E4_Acc <time> <x> <y> <z>` | `acceleration` | 1/64 `g` | 32 Hz |
//! | `E4_Bvp <time> <v>` | `ppg` | none | 64 Hz |
//! | `E4_Gsr <time> <v>` | `eda` | `uS` | 4 Hz |
//! | `E4_Temperature <time> <v>`, also `E4_Temp` | `temperature` | `degC` | 4 Hz |
//! | `E4_Ibi <time> <v>` | `ibi`, stamped with its beat | `s` | |
//! | `E4_Hr <time> <v>` | `heart_rate` | `1/min` | |
//! | `E4_Battery <time> <v>` | `battery` | 0 to 1 | |
//! | `E4_Tag <time>` | a marker `tag`: the button was pressed | | |
//!
//! Device times are Unix times, but they follow no clock: the server counts samples from the arrival of the first one.
//! The times drift against every clock, and start again after the radio link was lost.
//!
//! Quirks, each with a test:
//! - Lines are split anywhere, several arrive at once, and samples arrive before an answer.
//! - The server writes a decimal comma where Windows does.
//! - `device_subscribe` is answered with `OK` or with an echo of `ON`.
//! - Subscriptions outlast a lost radio link; times after it may precede earlier ones.
//! - If there are no samples despite subscriptions, the driver subscribes again, then gives up. Restarting the server
//!   as administrator helps.
//! - A conductance that stays 0 means that the E4 is not worn. It is passed on unchanged.

mod session;
mod message;
mod line_buffer;
mod grid;

pub use message::{Channels, Message, Sample};
pub use session::{E4Session, E4Settings};

/// The TCP port of the streaming server.
pub const PORT: u16 = 28000;
