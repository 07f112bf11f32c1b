//! Emulated Bluetooth devices behind a private BlueZ, for programs that reach devices through BlueZ.
//!
//! [`EmulatedBluetooth`] starts a private `dbus-daemon` and serves `org.bluez` on it: an adapter, and devices with
//! their services. Programs use it with its address in `DBUS_SYSTEM_BUS_ADDRESS`; the machine's own Bluetooth is not
//! touched.
//!
//! It behaves like BlueZ 5.66, as far as clients (bleak, btleplug, bluer) depend on it:
//! - A device has an object from its first advertisement during a discovery. While a client is discovering, the
//!   device's RSSI changes; when the discovery stops, the RSSI is invalidated.
//! - `Connect` answers when the link is up, before the services are known; `ServicesResolved` follows.
//! - Services and characteristics are objects while the device is connected. A characteristic's path contains the
//!   handle of its declaration.
//! - A read changes `Value`, as a notification does.
//! - `Disconnect` answers before it reports anything: bleak 0.20 closes its connection when it sees the report.
//! - A lost link is reported by `ServicesResolved`, then by `Connected`; then the objects of its services are removed.
//! - Discoveries and subscriptions end with the client that started them; links do not.

mod device;
mod link;
mod adapter;
mod objects;
mod gatt;
mod central;
mod daemon;
mod error;
mod wearable;

use std::collections::BTreeSet;
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::clock::Stopwatch;
use teampulse_emulators::devices::{Peripheral, Wearer};
use tokio::task::JoinSet;
use zbus::export::futures_core::Stream;
use zbus::fdo::ObjectManager;
use zbus::{Connection, MatchRule, MessageStream, Variant};

use self::adapter::{ADAPTER, Adapter};
use self::central::{ADAPTER_PATH, Central};
use self::daemon::Daemon;
use self::device::Handle;
use self::link::Link;

pub use self::daemon::is_installed;
pub use self::error::EmulatedBluetoothError;
pub(super) use self::wearable::Radio;
pub use self::wearable::{EmulatedRadio, MyoSettings, Oh1Settings, open};

/// A device for [`EmulatedBluetooth`].
pub struct EmulatedDevice {
    /// The Bluetooth address: `A0:9E:1A:00:00:01`.
    pub address: String,
    /// The device.
    pub peripheral: Box<dyn Peripheral>,
    /// The person who wears the device.
    pub wearer: Box<dyn Wearer + Send>,
    /// The faults of the link, in order of time.
    pub incidents: Vec<LinkIncident>,
}

/// A fault of a link at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkIncident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: LinkFault,
}

/// The possible faults of a link.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinkFault {
    /// The link is lost, and may be set up again at once.
    Drop,
    /// The link is lost, and the device is out of range for this long \[s\].
    Away(f64),
    /// The link stays up, but nothing arrives for this long \[s\].
    Silence(f64),
}

/// Devices behind a BlueZ on a private D-Bus, until this is dropped.
pub struct EmulatedBluetooth {
    devices: Vec<Handle>,
    // Dropped before the daemon, which the tasks' connection needs.
    _tasks: JoinSet<zbus::Result<()>>,
    daemon: Daemon,
}

impl EmulatedBluetooth {
    /// Starts the devices, which take their time from `clock`.
    pub async fn start(
        devices: Vec<EmulatedDevice>,
        clock: Stopwatch,
    ) -> Result<Self, EmulatedBluetoothError> {
        Self::check(&devices)?;
        Self::serve(devices, clock, Daemon::start().await?).await
    }

    /// Starts the devices like [`start`](Self::start), on a D-Bus whose socket is the file `bus` in `folder`, which must
    /// exist.
    pub async fn start_in(
        folder: &Path,
        devices: Vec<EmulatedDevice>,
        clock: Stopwatch,
    ) -> Result<Self, EmulatedBluetoothError> {
        Self::check(&devices)?;
        Self::serve(devices, clock, Daemon::start_in(folder).await?).await
    }

    fn check(devices: &[EmulatedDevice]) -> Result<(), EmulatedBluetoothError> {
        let mut addresses = BTreeSet::new();
        if let Some(twice) =
            devices.iter().find(|one| !addresses.insert(one.address.to_uppercase()))
        {
            return Err(EmulatedBluetoothError::SameAddress(twice.address.clone()));
        }
        Ok(())
    }

    async fn serve(
        devices: Vec<EmulatedDevice>,
        clock: Stopwatch,
        daemon: Daemon,
    ) -> Result<Self, EmulatedBluetoothError> {
        let builder = zbus::connection::Builder::address(daemon.address.as_str());
        let connection = builder.build().await?;
        let central = Arc::new(Central::new(connection.clone(), clock));
        let mut tasks = JoinSet::new();
        let mut handles = Vec::new();
        for mut device in devices {
            let incidents = std::mem::take(&mut device.incidents);
            let (handle, requests) = Handle::new(device, &central);
            tasks.spawn(Link::new(handle.clone(), incidents).run(requests));
            handles.push(handle);
        }
        let objects = connection.object_server();
        objects.at("/", ObjectManager).await?;
        let adapter = Adapter { central: Arc::clone(&central), devices: handles.clone() };
        objects.at(ADAPTER_PATH, adapter).await?;
        let leaving = departures(&connection).await?;
        tasks.spawn(forget_departed(leaving, central, handles.clone()));
        connection.request_name("org.bluez").await?;
        Ok(Self { devices: handles, _tasks: tasks, daemon })
    }

    /// The address of the bus, for `DBUS_SYSTEM_BUS_ADDRESS`.
    pub fn bus_address(&self) -> &str {
        &self.daemon.address
    }

    /// Triggers a fault in the link of the device with this address, and waits until it has happened. Returns whether
    /// there is such a device.
    pub async fn suffer(&self, address: &str, fault: LinkFault) -> bool {
        let found = self.devices.iter().find(|one| one.address().eq_ignore_ascii_case(address));
        match found {
            Some(device) => device.suffer(fault).await.is_ok(),
            None => false,
        }
    }

    /// Whether a client is connected to the device with this address.
    pub fn is_connected(&self, address: &str) -> bool {
        let mut devices = self.devices.iter();
        let found = devices.find(|one| one.address().eq_ignore_ascii_case(address));
        found.is_some_and(|device| device.state().is_connected)
    }
}

/// Returns a stream of the clients that leave the bus, as `NameOwnerChanged` signals.
async fn departures(connection: &Connection) -> zbus::Result<MessageStream> {
    let rule = MatchRule::builder()
        .msg_type(zbus::message::Type::Signal)
        .sender("org.freedesktop.DBus")
        .member("NameOwnerChanged")
        .build()?;
    MessageStream::for_match_rule(rule, connection, None).await
}

async fn forget_departed(
    mut leaving: MessageStream,
    central: Arc<Central>,
    devices: Vec<Handle>,
) -> zbus::Result<()> {
    let mut next =
        async || std::future::poll_fn(|context| Pin::new(&mut leaving).poll_next(context)).await;
    while let Some(message) = next().await {
        let (name, _, owner): (String, String, String) = message?.body().deserialize()?;
        if !owner.is_empty() {
            continue;
        }
        for device in &devices {
            device.forget(&name);
        }
        if central.discoverers(|clients| clients.remove(&name) && clients.is_empty()) {
            let value = Variant::from(false);
            central.changed(ADAPTER_PATH, ADAPTER, "Discovering", value).await?;
        }
    }
    Ok(())
}
