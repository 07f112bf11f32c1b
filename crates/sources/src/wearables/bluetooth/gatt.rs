//! A connected device: its characteristics and their notifications.

use std::collections::{BTreeMap, BTreeSet};
use std::future::Future;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;
use tokio::sync::mpsc;
use zbus::{DynamicType, Message, OwnedFd, Variant};

use teampulse_devices::gatt::{Request, Uuid};

use super::acquired::{Acquired, Receiver};
use super::bus::{Bus, Object, PATIENCE, Value};
use super::choice::Seen;
use super::error::BluetoothError;
use super::objects::{CHARACTERISTIC, Characteristic, DEVICE};

/// How long `BlueZ` may take to connect.
const CONNECT: Duration = Duration::from_secs(15);
/// How long a device may take to list its services, from the connection on.
const RESOLVE: Duration = Duration::from_secs(10);
/// How long a device may take to carry out a request.
const REQUEST: Duration = Duration::from_secs(5);
/// How often, and how long after each other, `BlueZ` is asked for a socket in place of one that was just closed.
const ATTEMPTS: u32 = 5;
const BETWEEN_ATTEMPTS: Duration = Duration::from_millis(100);
/// How long `BlueZ` may take to disconnect.
const DISCONNECT: Duration = Duration::from_secs(2);

/// A connected device. It is disconnected by [`close`](Self::close), or when it is dropped.
#[derive(Debug)]
pub(in crate::wearables) struct GattLink {
    bus: Arc<Bus>,
    /// What it advertised.
    pub seen: Seen,
    characteristics: BTreeMap<Uuid, Characteristic>,
    subscribed: BTreeSet<Uuid>,
    sockets: Sockets,
    values: mpsc::Receiver<Value>,
    receiver: Receiver,
    is_open: bool,
}

/// The open sockets of a link, by their characteristic.
type Sockets = Arc<Mutex<BTreeMap<Uuid, Acquired>>>;

/// How a request ended.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::wearables) enum Answer {
    /// It succeeded; with the value that was read.
    Done(Uuid, Option<Vec<u8>>),
    /// It failed: the device lacks the characteristic, refused, or did not answer.
    Failed(Uuid),
}

impl GattLink {
    /// Connects to a device, or takes over its connection, unless the session is closed meanwhile.
    pub(super) async fn open(
        bus: Arc<Bus>,
        seen: Seen,
        closed: impl Future<Output = ()>,
    ) -> Result<GattLink, BluetoothError> {
        let _one_at_a_time = bus.connecting.lock().await;
        let (values, receiver) = bus.subscribe(&seen.path);
        let mut link = GattLink {
            bus: Arc::clone(&bus),
            seen,
            characteristics: BTreeMap::new(),
            subscribed: BTreeSet::new(),
            sockets: Sockets::default(),
            values,
            receiver,
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

    /// The next notification, in order; `None` when the link is lost.
    pub async fn next(&mut self) -> Option<Value> {
        loop {
            let (characteristic, value) = self.values.recv().await?;
            // `BlueZ` repeats what is read as a notification.
            if self.subscribed.contains(&characteristic) {
                return Some((characteristic, value));
            }
        }
    }

    /// The notifications that were lost here since the last call.
    pub fn take_lost(&self) -> u64 {
        self.receiver.lost.swap(0, Ordering::Relaxed)
    }

    /// Carries out a request of a session.
    pub fn carry_out(&mut self, request: Request) -> impl Future<Output = Answer> + Send + 'static {
        let uuid = match &request {
            Request::Subscribe(uuid) | Request::Read(uuid) | Request::Write(uuid, _) => *uuid,
        };
        let is_again = matches!(request, Request::Subscribe(_)) && !self.subscribed.insert(uuid);
        let asked = Asked {
            bus: Arc::clone(&self.bus),
            sockets: Arc::clone(&self.sockets),
            receiver: self.receiver.clone(),
        };
        let characteristic = self.characteristics.get(&uuid).cloned();
        async move {
            let Some(characteristic) = characteristic else { return Answer::Failed(uuid) };
            let answer = match request {
                Request::Subscribe(_) => {
                    asked.subscribe(&characteristic, is_again).await.map(|()| None)
                }
                Request::Read(_) => asked.read(&characteristic).await.map(Some),
                Request::Write(_, value) => {
                    asked.write(&characteristic, value).await.map(|()| None)
                }
            };
            answer.map_or(Answer::Failed(uuid), |value| Answer::Done(uuid, value))
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
    // A device that is gone already can't be disconnected: that is as good.
    drop(bus.call(Object::bluez(device, DEVICE), "Disconnect", &(), DISCONNECT).await);
}

/// What a request needs of its link; `None` of an answer is a failure.
struct Asked {
    bus: Arc<Bus>,
    sockets: Sockets,
    receiver: Receiver,
}

impl Asked {
    async fn subscribe(&self, characteristic: &Characteristic, is_again: bool) -> Option<()> {
        let before = self.lock().remove(&characteristic.uuid).is_some();
        if is_again && !before {
            // It fell silent: `BlueZ` would only say that it is on.
            drop(self.bus.call(object(characteristic), "StopNotify", &(), PATIENCE).await);
        }
        // `BlueZ` notices by and by that a socket was closed.
        let attempts = if before { ATTEMPTS } else { 1 };
        for attempt in 0..attempts {
            if attempt > 0 {
                tokio::time::sleep(BETWEEN_ATTEMPTS).await;
            }
            if characteristic.is_acquirable && self.acquire(characteristic).await.is_some() {
                return Some(());
            }
        }
        self.call(characteristic, "StartNotify", &()).await.map(drop)
    }

    /// Has the notifications sent to a socket, which `BlueZ` refuses where another program has them.
    async fn acquire(&self, characteristic: &Characteristic) -> Option<()> {
        let reply = self.call(characteristic, "AcquireNotify", &options()).await?;
        let (socket, _) = reply.body().deserialize::<(OwnedFd, u16)>().ok()?;
        let acquired = Acquired::forward(socket.into(), characteristic.uuid, self.receiver.clone());
        self.lock().insert(characteristic.uuid, acquired.ok()?);
        Some(())
    }

    async fn read(&self, characteristic: &Characteristic) -> Option<Vec<u8>> {
        let reply = self.call(characteristic, "ReadValue", &options()).await?;
        reply.body().deserialize().ok()
    }

    async fn write(&self, characteristic: &Characteristic, value: Vec<u8>) -> Option<()> {
        let body = (value, BTreeMap::from([("type", Variant::from("request"))]));
        self.call(characteristic, "WriteValue", &body).await.map(drop)
    }

    async fn call<B: Serialize + DynamicType + Sync>(
        &self,
        characteristic: &Characteristic,
        method: &str,
        body: &B,
    ) -> Option<Message> {
        self.bus.call(object(characteristic), method, body, REQUEST).await.ok()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Uuid, Acquired>> {
        self.sockets.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn object(characteristic: &Characteristic) -> Object<'_> {
    Object::bluez(&characteristic.path, CHARACTERISTIC)
}

fn options() -> BTreeMap<&'static str, Variant<'static>> {
    BTreeMap::new()
}
