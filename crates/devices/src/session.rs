use std::time::Duration;

use crate::Output;
use crate::gatt::{self, Uuid};

/// The protocol of one device, without the link: the caller supplies the bytes and the time.
///
/// `now` is the time since any fixed point, by a clock that never steps back. After each call,
/// [`poll`](Self::poll) until it returns `None`; call [`tick`](Self::tick) no later than
/// [`next_tick`](Self::next_tick).
pub trait Session {
    /// A request of the session to its caller.
    type Request;

    /// Starts the session when the link is up, for the first time or again. Sample indices continue.
    fn start(&mut self, now: Duration);

    /// Advances the time: repeats requests, restarts silent streams, or gives up.
    fn tick(&mut self, now: Duration);

    /// When [`tick`](Self::tick) has to be called next; `None` while nothing is awaited.
    fn next_tick(&self) -> Option<Duration>;

    /// Ends the exchange as the device expects; [`Output::Done`] follows.
    ///
    /// Without this, some devices keep measuring after the link is closed until their battery is empty.
    fn stop(&mut self, now: Duration);

    /// Returns the next output, in order.
    fn poll(&mut self) -> Option<Output<Self::Request>>;
}

/// A session with a Bluetooth Low Energy device. Requests are carried out one after the other.
pub trait GattSession: Session<Request = gatt::Request> {
    /// Handles a notification or indication of a characteristic, or the value read from it.
    fn receive(&mut self, characteristic: Uuid, value: &[u8], now: Duration);

    /// Records that a request for this characteristic failed: it is missing, or refused the request.
    fn fail(&mut self, characteristic: Uuid, now: Duration);
}

/// A session over a stream of bytes: a serial port or a TCP connection.
pub trait ByteSession: Session<Request = Vec<u8>> {
    /// Handles bytes, split anywhere.
    fn receive(&mut self, bytes: &[u8], now: Duration);
}
