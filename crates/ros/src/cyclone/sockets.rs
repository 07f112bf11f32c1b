//! The receiving sockets of the library, as listed by the kernel.

use std::fs;
use std::ops::Range;

/// The kernel's tables of the sockets in this network namespace.
const TABLES: [&str; 2] = ["/proc/self/net/udp", "/proc/self/net/udp6"];

/// A socket in the kernel's table.
#[derive(Debug, PartialEq)]
pub(super) struct Socket {
    pub(super) port: u32,
    pub(super) inode: u64,
    /// The number of packets dropped because the socket's receive buffer was full.
    pub(super) dropped: u32,
}

/// The port range of a domain: 250 ports, as defined by RTPS.
pub(super) fn ports(domain: u32) -> Range<u32> {
    let first = 7400_u32.saturating_add(domain.saturating_mul(250));
    first..first.saturating_add(250)
}

/// The sockets of this process, each with its file descriptor.
pub(super) fn own() -> Vec<(i32, Socket)> {
    let files = own_files();
    let text = TABLES.map(|path| fs::read_to_string(path).unwrap_or_default()).concat();
    let listed = text.lines().filter_map(read);
    let file_of = |inode| files.iter().find(|(_, each)| *each == inode).map(|(file, _)| *file);
    listed.filter_map(|socket| Some((file_of(socket.inode)?, socket))).collect()
}

/// The file descriptors of this process that are sockets, with the inodes of the sockets.
fn own_files() -> Vec<(i32, u64)> {
    let files = fs::read_dir("/proc/self/fd").into_iter().flatten().flatten();
    let numbers = files.filter_map(|file| {
        let link = fs::read_link(file.path()).ok()?;
        let inode = link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok()?;
        Some((file.file_name().to_str()?.parse().ok()?, inode))
    });
    numbers.collect()
}

/// Parses a line of the kernel's table; `None` for the heading.
fn read(line: &str) -> Option<Socket> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let (_, port) = fields.get(1)?.rsplit_once(':')?;
    Some(Socket {
        port: u32::from_str_radix(port, 16).ok()?,
        inode: fields.get(9)?.parse().ok()?,
        dropped: fields.get(12)?.parse().ok()?,
    })
}

/// Enlarges the receive buffers of a domain's sockets beyond `net.core.rmem_max` where permitted, which the library
/// does not attempt. Returns the size of the smallest buffer afterwards [bytes].
///
/// The user's configuration is respected: only sizes that the kernel cut to its limit are requested again.
#[cfg(target_os = "linux")]
pub(super) fn enlarge(domain: u32) -> Option<usize> {
    use crate::receiving::BUFFER_BYTES;
    use rustix::net::sockopt;
    use std::os::fd::BorrowedFd;

    let limit = fs::read_to_string("/proc/sys/net/core/rmem_max").ok();
    let limit: Option<usize> = limit.and_then(|text| text.trim().parse().ok());
    let ours = own().into_iter().filter(|(_, socket)| ports(domain).contains(&socket.port));
    let sizes = ours.filter_map(|(file, _)| {
        // SAFETY: it was open a moment ago, and stays open as long as the domain that the caller has
        // joined.
        let socket = unsafe { BorrowedFd::borrow_raw(file) };
        // The kernel doubles the requested size.
        let size = || sockopt::socket_recv_buffer_size(socket).map(|bytes| bytes / 2);
        if size().ok()? < BUFFER_BYTES && limit.is_none_or(|limit| size() == Ok(limit)) {
            let larger = sockopt::set_socket_recv_buffer_size_force(socket, BUFFER_BYTES);
            larger.unwrap_or_else(|error| tracing::debug!("receive buffers stay small: {error}"));
        }
        size().ok()
    });
    sizes.min()
}

#[cfg(not(target_os = "linux"))]
pub(super) fn enlarge(_domain: u32) -> Option<usize> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::UdpSocket;

    const LISTED: &str = "   sl  local_address rem_address   st tx_queue rx_queue tr tm->when \
        retrnsmt   uid  timeout inode ref pointer drops\n \
        4294: 00000000:1CF3 00000000:0000 07 00000000:00034700 00:00000000 00000000  1000 \
        0 918273 2 0000000000000000 1234";

    #[test]
    fn a_line_of_the_kernel_is_read_and_its_heading_is_not() {
        let read: Vec<_> = LISTED.lines().filter_map(read).collect();
        assert_eq!(read, [Socket { port: 7411, inode: 918_273, dropped: 1234 }]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn own_sockets_are_found_with_their_files() {
        use std::os::fd::AsRawFd;
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let port = u32::from(socket.local_addr().unwrap().port());
        let found: Vec<i32> =
            own().into_iter().filter(|(_, each)| each.port == port).map(|(file, _)| file).collect();
        assert!(found.contains(&socket.as_raw_fd()), "{found:?}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn buffers_that_the_kernel_cut_become_as_large_as_permitted_and_others_stay() {
        use crate::receiving;
        use rustix::net::sockopt;
        // A separate domain, far from those that other tests join.
        let (domain, first) = (200, ports(200).start as u16);
        let bind =
            |from: u16| (from..from + 40).find_map(|p| UdpSocket::bind(("127.0.0.1", p)).ok());
        let (cut, chosen) = (bind(first + 100).unwrap(), bind(first + 150).unwrap());
        sockopt::set_socket_recv_buffer_size(&cut, receiving::BUFFER_BYTES).unwrap();
        sockopt::set_socket_recv_buffer_size(&chosen, 64 << 10).unwrap();
        assert_eq!(enlarge(domain), Some(64 << 10), "what the user configured has the last word");
        let size = sockopt::socket_recv_buffer_size(&cut).unwrap() / 2;
        assert_eq!(Some(size), receiving::buffer_bytes());
    }
}
