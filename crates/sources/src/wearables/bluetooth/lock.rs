//! A lock on a device between the sessions of one computer: a session that ends would disconnect another session's
//! device.
#![expect(clippy::disallowed_methods, reason = "where the bus is, as zbus reads it")]

use std::env;

use crate::lock::{Lock, Locked};

/// Takes the lock on a device, by the addresses of its bus and its radio; `None` where locks can't be created.
pub(super) fn of(bus: Option<&str>, device: &str) -> Result<Option<Lock>, Locked> {
    let bus = bus.map(str::to_owned).or_else(|| env::var("DBUS_SYSTEM_BUS_ADDRESS").ok());
    // A bus address may or may not contain the GUID of its bus.
    let bus = bus.as_deref().and_then(|bus| bus.split(",guid=").next());
    Lock::on("device", (bus, device.to_ascii_uppercase()))
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
