//! Serial ports (`/dev/ttyUSB0`, `/dev/rfcomm0`), and pseudoterminals that stand for a port without a device.
//!
//! Plain termios over tokio: crates for serial ports pull in udev or a second event loop, for four calls.

mod port;
mod pty;
mod found;

pub use found::FoundPort;
pub use port::{SerialError, SerialPort};
pub use pty::Pty;
