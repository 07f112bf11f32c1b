//! Serial ports, and pairs of them without a device: `/dev/ttyUSB0`, `/dev/rfcomm0`, pseudoterminals.
//!
//! Plain termios over tokio: crates for serial ports pull in udev or a second event loop, for four calls.

mod port;
mod pty;
mod found;

pub use found::FoundPort;
pub use port::{SerialError, SerialPort};
pub use pty::Pty;
