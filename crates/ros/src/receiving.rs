//! What receiving at high rates asks of the machine: room for what arrives while the thread that
//! receives waits for a processor, and that it need not wait for long.

#[cfg(target_os = "linux")]
use std::net::UdpSocket;

/// The most that is asked for a socket's receive buffer [bytes]: a second of best-effort images of
/// 1 MiB must not overflow it, nor a tenth of one at 100,000 messages a second of 1 KiB. The kernel
/// gives up to `net.core.rmem_max`, and all of it to whoever administers the network.
pub const BUFFER_BYTES: usize = 32 << 20;

/// The niceness of a thread that receives, where that is permitted: it is woken before others, so
/// that a full machine slows its work down instead of losing what arrives.
#[cfg(target_os = "linux")]
const NICENESS: i32 = -10;

/// How large the receive buffer of a socket of ours becomes [bytes]; `None` where that can't be
/// known.
#[cfg(target_os = "linux")]
pub fn buffer_bytes() -> Option<usize> {
    use rustix::net::sockopt;
    let socket = UdpSocket::bind("127.0.0.1:0").ok()?;
    // More than is permitted becomes as much as is.
    sockopt::set_socket_recv_buffer_size(&socket, BUFFER_BYTES).ok()?;
    sockopt::set_socket_recv_buffer_size_force(&socket, BUFFER_BYTES).ok();
    // The kernel doubles what is asked for, for its own bookkeeping.
    Some(sockopt::socket_recv_buffer_size(&socket).ok()? / 2)
}

#[cfg(not(target_os = "linux"))]
pub fn buffer_bytes() -> Option<usize> {
    None
}

/// Whether threads that receive may come before others; tried on a thread that does nothing else.
pub fn may_come_first() -> bool {
    std::thread::spawn(come_first).join().unwrap_or(false)
}

/// Lets this thread come before others, where that is permitted; says whether it is.
#[cfg(target_os = "linux")]
pub(crate) fn come_first() -> bool {
    let this = rustix::thread::gettid();
    // On Linux a thread has a niceness of its own.
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
