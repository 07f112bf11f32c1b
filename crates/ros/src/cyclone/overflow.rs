//! Packets that this machine dropped because one of our receive buffers was full, as the kernel counts them for each
//! socket.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use teampulse_core::time::Time;

use super::sockets::{self, Socket};

/// The interval at which the counters are read.
const PERIOD: Duration = Duration::from_secs(1);

/// Counts the packets for which the sockets of one domain had no room.
#[derive(Debug)]
pub(super) struct Overflow {
    ports: Range<u32>,
    /// The last count of each socket, by its inode.
    known: BTreeMap<u64, u32>,
    due: Time,
}

impl Overflow {
    /// Creates a counter for the sockets of a domain.
    pub(super) fn of(domain: u32) -> Overflow {
        Overflow { ports: sockets::ports(domain), known: BTreeMap::new(), due: Time::EPOCH }
    }

    /// The number of packets dropped since the last reading; 0 before the period has passed, and if the kernel does not
    /// count them.
    pub(super) fn look(&mut self, now: Time) -> u64 {
        if now < self.due {
            return 0;
        }
        self.due = now + PERIOD;
        self.count(sockets::own().into_iter().map(|(_, socket)| socket))
    }

    fn count(&mut self, sockets: impl Iterator<Item = Socket>) -> u64 {
        let mut dropped = 0;
        for socket in sockets.filter(|socket| self.ports.contains(&socket.port)) {
            let before = self.known.insert(socket.inode, socket.dropped).unwrap_or(0);
            dropped += u64::from(socket.dropped.wrapping_sub(before));
        }
        dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::UdpSocket;

    #[test]
    fn what_was_counted_is_not_counted_again_nor_that_of_other_domains() {
        let mut overflow = Overflow::of(0);
        let mut count =
            |port, dropped| overflow.count([Socket { port, inode: 5, dropped }].into_iter());
        assert_eq!([count(7411, 3), count(7411, 10), count(7411, 10)], [3, 7, 0]);
        assert_eq!(count(7650, 99), 0, "it is of domain 1");
    }

    #[test]
    fn a_socket_without_room_says_so() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = socket.local_addr().unwrap();
        let port = u32::from(address.port());
        let mut overflow = Overflow { ports: port..port + 1, ..Overflow::of(0) };
        assert_eq!(overflow.look(Time::from_nanos(1)), 0);
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        let datagram = vec![0; 32_000];
        // More than the default receive buffer of any machine.
        for _ in 0..2_000 {
            sender.send_to(&datagram, address).unwrap();
        }
        assert!(overflow.look(Time::from_stamp(2, 0)) > 0);
        assert_eq!(overflow.look(Time::from_stamp(9, 0)), 0, "each is counted once");
    }
}
