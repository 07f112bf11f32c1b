//! A lock on a device between the sessions of one computer: the end of one would disconnect the device of another.
#![expect(clippy::disallowed_methods, reason = "where the bus is, as zbus reads it")]

use std::env;
use std::fs::{File, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use rustix::fs::{FlockOperation, OFlags, flock};

/// Another session holds the lock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Locked;

/// The lock on a device, by its address and that of the bus; `None` where no file can be created.
pub(super) fn of(bus: Option<&str>, device: &str) -> Result<Option<File>, Locked> {
    let bus = bus.map(str::to_owned).or_else(|| env::var("DBUS_SYSTEM_BUS_ADDRESS").ok());
    let mut hasher = DefaultHasher::new();
    (bus, device.to_ascii_uppercase()).hash(&mut hasher);
    let folder = env::var_os("XDG_RUNTIME_DIR").map_or_else(env::temp_dir, PathBuf::from);
    let path = folder.join(format!("teampulse-device-{:016x}.lock", hasher.finish()));
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false).mode(0o600);
    let opened = options.custom_flags(OFlags::NOFOLLOW.bits().cast_signed()).open(path);
    let Ok(file) = opened else { return Ok(None) };
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|_errno| Locked)?;
    Ok(Some(file))
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
