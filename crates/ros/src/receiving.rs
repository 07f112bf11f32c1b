//! Requirements of receiving at high rates: buffers for messages that arrive while the receiving thread
//! waits for a processor, and a priority that keeps this wait short.

#[cfg(target_os = "linux")]
use std::net::UdpSocket;

/// The requested size of a socket's receive buffer [bytes]: it must hold a second of best-effort images of 1 MiB, or a
/// tenth of a second at 100,000 messages a second of 1 KiB. The kernel grants up to `net.core.rmem_max`, or the full
/// size with network administration rights.
pub const BUFFER_BYTES: usize = 32 << 20;

/// The niceness of a receiving thread, if permitted: it runs before other threads, so that an overloaded machine slows
/// down instead of losing messages.
#[cfg(target_os = "linux")]
const NICENESS: i32 = -10;

/// The size of the receive buffer that one of our sockets is granted [bytes]; `None` if unknown.
#[cfg(target_os = "linux")]
pub fn buffer_bytes() -> Option<usize> {
    use rustix::net::sockopt;
    let socket = UdpSocket::bind("127.0.0.1:0").ok()?;
    // A size beyond the limit is reduced to the limit.
    sockopt::set_socket_recv_buffer_size(&socket, BUFFER_BYTES).ok()?;
    sockopt::set_socket_recv_buffer_size_force(&socket, BUFFER_BYTES).ok();
    // The kernel doubles the requested size, for its own bookkeeping.
    Some(sockopt::socket_recv_buffer_size(&socket).ok()? / 2)
}

#[cfg(not(target_os = "linux"))]
pub fn buffer_bytes() -> Option<usize> {
    None
}

/// Whether receiving threads may have a higher priority; tried on a separate thread.
pub fn may_come_first() -> bool {
    std::thread::spawn(come_first).join().unwrap_or(false)
}

/// Raises the priority of this thread, if permitted; returns whether it did.
#[cfg(target_os = "linux")]
pub(crate) fn come_first() -> bool {
    let this = rustix::thread::gettid();
    // On Linux each thread has its own niceness.
    rustix::process::setpriority_process(Some(this), NICENESS).is_ok()
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn come_first() -> bool {
    false
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    fn niceness() -> i32 {
        rustix::process::getpriority_process(Some(rustix::thread::gettid())).expect("a priority")
    }

    #[test]
    fn a_thread_comes_first_alone_and_only_where_that_is_permitted() {
        let before = niceness();
        let comes_first = std::thread::spawn(|| {
            let may = come_first();
            (may, niceness())
        });
        let (may, its_own) = comes_first.join().unwrap();
        assert_eq!(its_own, if may { NICENESS } else { before });
        assert_eq!((may_come_first(), niceness()), (may, before));
    }

    #[test]
    fn a_buffer_is_as_large_as_the_machine_permits() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let unasked = rustix::net::sockopt::socket_recv_buffer_size(&socket).unwrap() / 2;
        let asked = buffer_bytes().unwrap();
        assert!((unasked.min(BUFFER_BYTES)..=BUFFER_BYTES).contains(&asked), "{asked}");
    }
}
