//! The addresses of this computer.

use std::net::Ipv4Addr;

/// The addresses of this computer; none if the kernel's routing table can't be read.
pub(crate) fn local_addresses() -> Vec<Ipv4Addr> {
    let table = std::fs::read_to_string("/proc/net/fib_trie").unwrap_or_default();
    teampulse_devices::lsl::addresses(&table)
}
