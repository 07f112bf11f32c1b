//! A lock on a device between the sessions of one computer: the end of one would disconnect the device of another.
#![expect(clippy::disallowed_methods, reason = "where the bus is, as zbus reads it")]

use std::env;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

/// A lock that is held until it is dropped, or its process ends: the name of a socket, which needs no file.
#[derive(Debug)]
pub(super) struct Lock {
    _socket: UnixDatagram,
}

/// Another session holds the lock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Locked;

/// The lock on a device, by the addresses of its bus and of its radio; `None` where such sockets can't be created.
pub(super) fn of(bus: Option<&str>, device: &str) -> Result<Option<Lock>, Locked> {
    let bus = bus.map(str::to_owned).or_else(|| env::var("DBUS_SYSTEM_BUS_ADDRESS").ok());
    // An address may or may not name the bus that it is of.
    let bus = bus.as_deref().and_then(|bus| bus.split(",guid=").next());
    let mut hasher = DefaultHasher::new();
    (bus, device.to_ascii_uppercase()).hash(&mut hasher);
    let name = format!("teampulse-device-{:016x}", hasher.finish());
    let address = SocketAddr::from_abstract_name(name);
    match address.and_then(|address| UnixDatagram::bind_addr(&address)) {
        Ok(socket) => Ok(Some(Lock { _socket: socket })),
        Err(error) if error.kind() == io::ErrorKind::AddrInUse => Err(Locked),
        Err(_) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_locked_until_its_lock_is_dropped() {
        let bus = format!("unix:path=/tmp/bus_of_{}", std::process::id());
        let lock = of(Some(&bus), "a0:9e:1a:00:00:02");
        assert!(lock.is_ok() && of(Some(&bus), "A0:9E:1A:00:00:02").is_err());
        assert!(of(Some(&bus), "A0:9E:1A:00:00:03").is_ok());
        drop(lock);
        assert!(of(Some(&bus), "A0:9E:1A:00:00:02").is_ok());
    }
}
