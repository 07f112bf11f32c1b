//! Bluetooth Low Energy through `BlueZ`, the Bluetooth service of Linux, over D-Bus.
//!
//! `zbus` implements D-Bus in pure Rust; `btleplug` and `bluer` need libdbus and a C compiler to build.

mod error;
mod objects;
mod bus;
mod scanning;
mod choice;
mod gatt;
mod source;
mod lock;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use crate::lock::Lock;

use bus::Bus;
pub use choice::Seen;
pub(super) use choice::Wanted;
pub use error::BluetoothError;
pub(super) use gatt::{Answer, GattLink};
pub(crate) use source::check_address;
pub(super) use source::{Pairing, Wearable, Wireless};

/// How long a known device may take to appear.
const SEARCH: Duration = Duration::from_secs(10);
/// How long to listen for other devices of the same kind before the only one found is chosen.
const COMPARE: Duration = Duration::from_secs(3);

/// This computer's Bluetooth, for all sources of a session; clones share one connection and one scan.
#[derive(Clone, Debug, Default)]
pub struct Bluetooth(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    /// The address of the bus; `None` for the system bus.
    address: Option<String>,
    bus: tokio::sync::Mutex<Weak<Bus>>,
    /// The devices that sources name by address, each with the number of those sources; no other source chooses them.
    reserved: Mutex<BTreeMap<String, usize>>,
    in_use: Mutex<BTreeSet<String>>,
}

/// The right to use a device, until it is dropped.
#[derive(Debug)]
pub(super) struct Hold {
    shared: Arc<Shared>,
    address: String,
    /// The lock that keeps other sessions from using the device.
    _lock: Option<Lock>,
}

impl Bluetooth {
    /// Uses the `BlueZ` on the D-Bus at an address, such as `unix:path=/tmp/bus`; the default is the system bus, or the
    /// bus of `DBUS_SYSTEM_BUS_ADDRESS`.
    pub fn at(address: impl Into<String>) -> Bluetooth {
        Bluetooth(Arc::new(Shared { address: Some(address.into()), ..Shared::default() }))
    }

    /// Returns the devices in range, after listening for this long.
    pub async fn in_range(&self, listen: Duration) -> Result<Vec<Seen>, BluetoothError> {
        let bus = self.bus().await?;
        let adapter = adapter(&bus)?;
        let scan = bus.scan();
        // This waits only for the end of the time, or of `BlueZ`.
        let nothing: Option<()> = bus.until(listen, |_| None).await?;
        debug_assert!(nothing.is_none());
        let seen = bus.read(|objects| Seen::all(objects, &adapter).collect());
        drop(scan);
        Ok(seen)
    }

    /// Reserves this device for the source that names it.
    pub(super) fn reserve(&self, address: &str) {
        let mut reserved = self.0.reserved.lock().unwrap_or_else(PoisonError::into_inner);
        *reserved.entry(address.to_ascii_uppercase()).or_default() += 1;
    }

    /// Finds the wanted device.
    pub(super) async fn find(&self, wanted: &Wanted) -> Result<Seen, BluetoothError> {
        let bus = self.bus().await?;
        let adapter = adapter(&bus)?;
        let scan = bus.scan();
        let choose = |objects: &objects::Objects| {
            wanted.choose(Seen::all(objects, &adapter), &self.others())
        };
        if !wanted.is_certain() {
            let nothing: Option<()> = bus.until(COMPARE, |_| None).await?;
            debug_assert!(nothing.is_none());
        }
        let found = bus.until(SEARCH, |objects| match choose(objects) {
            Err(BluetoothError::NotInRange(_)) => None,
            chosen => Some(chosen),
        });
        let found = found.await?;
        drop(scan);
        found.unwrap_or_else(|| bus.read(choose))
    }

    /// Connects to a device that was found, unless the session closes meanwhile.
    pub(super) async fn connect(
        &self,
        seen: Seen,
        closed: impl Future<Output = ()>,
    ) -> Result<(GattLink, Hold), BluetoothError> {
        let hold = self.hold(&seen)?;
        let link = GattLink::open(self.bus().await?, seen, closed).await?;
        Ok((link, hold))
    }

    fn hold(&self, seen: &Seen) -> Result<Hold, BluetoothError> {
        let mut in_use = self.0.in_use.lock().unwrap_or_else(PoisonError::into_inner);
        let name = || format!("`{}` ({})", seen.name, seen.address);
        if in_use.contains(&seen.address) {
            return Err(BluetoothError::Taken(name()));
        }
        let lock = lock::of(self.0.address.as_deref(), &seen.address)
            .map_err(|_locked| BluetoothError::Elsewhere(name()))?;
        in_use.insert(seen.address.clone());
        Ok(Hold { shared: Arc::clone(&self.0), address: seen.address.clone(), _lock: lock })
    }

    /// Returns the devices that belong to other sources.
    fn others(&self) -> BTreeSet<String> {
        let reserved = self.0.reserved.lock().unwrap_or_else(PoisonError::into_inner);
        let in_use = self.0.in_use.lock().unwrap_or_else(PoisonError::into_inner);
        reserved.keys().chain(&*in_use).cloned().collect()
    }

    /// Returns the shared connection to `BlueZ`; a new one if there is none or the last one is gone.
    async fn bus(&self) -> Result<Arc<Bus>, BluetoothError> {
        let mut shared = self.0.bus.lock().await;
        if let Some(bus) = shared.upgrade().filter(|bus| !bus.is_gone()) {
            return Ok(bus);
        }
        let bus = Arc::new(Bus::connect(self.0.address.as_deref()).await?);
        *shared = Arc::downgrade(&bus);
        Ok(bus)
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        let mut in_use = self.shared.in_use.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.remove(&self.address);
    }
}

/// Returns the adapter to use.
fn adapter(bus: &Bus) -> Result<String, BluetoothError> {
    bus.read(|objects| {
        let off = || {
            let path = objects.adapters.keys().next()?;
            Some(BluetoothError::Off(path.rsplit('/').next().unwrap_or_default().to_owned()))
        };
        let found = scanning::adapter(objects).map(str::to_owned);
        found.ok_or_else(|| off().unwrap_or(BluetoothError::Adapter))
    })
}
