use std::time::Duration;

use crate::Output;
use crate::gatt::{self, Uuid};

/// A conversation with one device, without the link: the caller carries the bytes and the time.
///
/// `now` is the time since any fixed moment, of a clock that never steps back. After each call,
/// [`poll`](Self::poll) until it returns `None`; at [`next_tick`](Self::next_tick) at the latest, call
/// [`tick`](Self::tick).
pub trait Session {
    /// What the session asks its caller to do.
    type Request;

    /// The link is up: begins, or begins again after the link was lost. Indices of samples go on.
    fn start(&mut self, now: Duration);

    /// Time has passed: asks again, restarts what is silent, or gives up.
    fn tick(&mut self, now: Duration);

    /// When [`tick`](Self::tick) has to be called next; `None` while nothing is awaited.
    fn next_tick(&self) -> Option<Duration>;

    /// Ends the conversation as the device expects it; [`Output::Done`] follows.
    ///
    /// Some devices go on measuring until their battery is empty when their link is cut without.
    fn stop(&mut self, now: Duration);

    /// The next thing to carry out or to take note of, in order.
    fn poll(&mut self) -> Option<Output<Self::Request>>;
}

/// A session with a Bluetooth Low Energy device. Requests are carried out one after the other.
pub trait GattSession: Session<Request = gatt::Request> {
    /// A notification or indication of a characteristic, or the value that was read from it.
    fn receive(&mut self, characteristic: Uuid, value: &[u8], now: Duration);

    /// A request for this characteristic could not be carried out: it is missing, or refused it.
    fn fail(&mut self, characteristic: Uuid, now: Duration);
}

/// A session over a stream of bytes: a serial port or a TCP connection.
pub trait ByteSession: Session<Request = Vec<u8>> {
    /// Bytes that arrived, cut anywhere.
    fn receive(&mut self, bytes: &[u8], now: Duration);
}
