//! A connected device: its characteristics and their notifications.

use std::collections::{BTreeMap, BTreeSet};
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;
use zbus::Variant;

use teampulse_devices::gatt::{Request, Uuid};

use super::bus::{Bus, Object, PATIENCE, Value};
use super::choice::Seen;
use super::error::BluetoothError;
use super::objects::{CHARACTERISTIC, DEVICE};

/// How long `BlueZ` may take to connect.
const CONNECT: Duration = Duration::from_secs(15);
/// How long a device may take to list its services after connecting.
const RESOLVE: Duration = Duration::from_secs(10);
/// How long a device may take to carry out a request.
const REQUEST: Duration = Duration::from_secs(5);
/// How long `BlueZ` may take to disconnect.
const DISCONNECT: Duration = Duration::from_secs(2);

/// A connected device. It is disconnected by [`close`](Self::close), or when it is dropped.
#[derive(Debug)]
pub(in crate::wearables) struct GattLink {
    bus: Arc<Bus>,
    /// What the device advertised.
    pub seen: Seen,
    characteristics: BTreeMap<Uuid, String>,
    subscribed: BTreeSet<Uuid>,
    values: mpsc::Receiver<Value>,
    lost: Arc<AtomicU64>,
    is_open: bool,
}

/// How a request ended.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::wearables) enum Answer {
    /// The request succeeded, with the value if it was a read.
    Done(Uuid, Option<Vec<u8>>),
    /// The request failed: the device lacks the characteristic, refused, or did not answer.
    Failed(Uuid),
}

impl GattLink {
    /// Connects to a device, or takes over its connection, unless the session closes meanwhile.
    pub(super) async fn open(
        bus: Arc<Bus>,
        seen: Seen,
        closed: impl Future<Output = ()>,
    ) -> Result<GattLink, BluetoothError> {
        let _one_at_a_time = bus.connecting.lock().await;
        let (values, lost) = bus.subscribe(&seen.path);
        let mut link = GattLink {
            bus: Arc::clone(&bus),
            seen,
            characteristics: BTreeMap::new(),
            subscribed: BTreeSet::new(),
            values,
            lost,
            is_open: true,
        };
        let _pause = bus.pause_scan();
        let opened = tokio::select! {
            opened = link.connect() => opened,
            () = closed => Err(BluetoothError::Lost),
        };
        if let Err(error) = opened {
            link.close().await;
            return Err(error);
        }
        Ok(link)
    }

    async fn connect(&mut self) -> Result<(), BluetoothError> {
        let path = self.seen.path.clone();
        if !self.bus.read(|objects| objects.is_connected(&path)) {
            let asked = self.bus.call(Object::bluez(&path, DEVICE), "Connect", &(), CONNECT).await;
            if let Err(refusal) = asked
                && refusal.name != "org.bluez.Error.AlreadyConnected"
            {
                return Err(self.failed(refusal.text));
            }
        }
        let resolved = self.bus.until(RESOLVE, |objects| {
            objects.devices.get(&path).filter(|device| device.services_resolved).map(drop)
        });
        if resolved.await?.is_none() {
            return Err(self.failed("it does not list its services".into()));
        }
        self.discover().await
    }

    /// Reads the list of characteristics.
    async fn discover(&mut self) -> Result<(), BluetoothError> {
        let found = |bus: &Bus| bus.read(|objects| objects.characteristics_of(&self.seen.path));
        let mut characteristics = found(&self.bus);
        if characteristics.is_empty() {
            self.bus.refresh().await.map_err(|refusal| self.failed(refusal.text))?;
            characteristics = found(&self.bus);
        }
        if characteristics.is_empty() {
            return Err(self.failed("it has no characteristics".into()));
        }
        self.characteristics = characteristics;
        Ok(())
    }

    fn failed(&self, reason: String) -> BluetoothError {
        let Seen { name, address, .. } = &self.seen;
        BluetoothError::Connect { device: format!("`{name}` ({address})"), reason }
    }

    /// Returns the next notification, in order; `None` when the link is lost.
    pub async fn next(&mut self) -> Option<Value> {
        loop {
            let (characteristic, value) = self.values.recv().await?;
            // `BlueZ` repeats each value that is read as a notification.
            if self.subscribed.contains(&characteristic) {
                return Some((characteristic, value));
            }
        }
    }

    /// Returns the number of notifications lost on this computer since the last call.
    pub fn take_lost(&self) -> u64 {
        self.lost.swap(0, Ordering::Relaxed)
    }

    /// Carries out a request of a session.
    pub fn carry_out(&mut self, request: Request) -> impl Future<Output = Answer> + Send + 'static {
        let uuid = match &request {
            Request::Subscribe(uuid) | Request::Read(uuid) | Request::Write(uuid, _) => *uuid,
        };
        let is_again = matches!(request, Request::Subscribe(_)) && !self.subscribed.insert(uuid);
        let (bus, path) = (Arc::clone(&self.bus), self.characteristics.get(&uuid).cloned());
        async move {
            let Some(path) = path else { return Answer::Failed(uuid) };
            match ask(&bus, &path, request, is_again).await {
                Some(value) => Answer::Done(uuid, value),
                None => Answer::Failed(uuid),
            }
        }
    }

    /// Disconnects the device.
    pub async fn close(mut self) {
        self.is_open = false;
        disconnect(&self.bus, &self.seen.path).await;
    }
}

impl Drop for GattLink {
    fn drop(&mut self) {
        if !self.is_open {
            return;
        }
        self.bus.unsubscribe(&self.seen.path);
        let (bus, path) = (Arc::clone(&self.bus), self.seen.path.clone());
        if let Ok(runtime) = tokio::runtime::Handle::try_current() {
            runtime.spawn(async move { disconnect(&bus, &path).await });
        }
    }
}

async fn disconnect(bus: &Bus, device: &str) {
    bus.unsubscribe(device);
    // Disconnecting a device that is already gone fails, which does no harm.
    drop(bus.call(Object::bluez(device, DEVICE), "Disconnect", &(), DISCONNECT).await);
}

/// Carries out a request; returns the value that was read, or `None` if it failed.
async fn ask(bus: &Bus, path: &str, request: Request, is_again: bool) -> Option<Option<Vec<u8>>> {
    let characteristic = Object::bluez(path, CHARACTERISTIC);
    let no_options = BTreeMap::<&str, Variant<'_>>::new();
    match request {
        Request::Subscribe(_) => {
            if is_again {
                // The characteristic fell silent; without this, `BlueZ` would only answer that notifications are on.
                drop(bus.call(characteristic, "StopNotify", &(), PATIENCE).await);
            }
            let asked = bus.call(characteristic, "StartNotify", &(), REQUEST).await;
            asked.ok().map(|_| None)
        }
        Request::Read(_) => {
            let reply = bus.call(characteristic, "ReadValue", &no_options, REQUEST).await;
            reply.ok()?.body().deserialize::<Vec<u8>>().ok().map(Some)
        }
        Request::Write(_, value) => {
            let options = BTreeMap::from([("type", Variant::from("request"))]);
            let body = (value, options);
            let asked = bus.call(characteristic, "WriteValue", &body, REQUEST).await;
            asked.ok().map(|_| None)
        }
    }
}
