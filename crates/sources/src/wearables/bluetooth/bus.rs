//! The connection to `BlueZ`, shared by all Bluetooth sources of a session.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;
use tokio::sync::{mpsc, watch};
use tokio::task::AbortHandle;
use tokio::time::timeout;
use zbus::as_variant::Deserialize;
use zbus::connection::Builder;
use zbus::export::futures_core::Stream;
use zbus::message::{Body, Type};
use zbus::{Connection, DynamicType, Message, MessageStream, OwnedObjectPath};

use teampulse_devices::gatt::Uuid;

use super::error::BluetoothError;
use super::objects::{CHARACTERISTIC, Interfaces, Managed, Objects, Properties, bytes_of};
use super::scanning::{self, Demand};

const BLUEZ: &str = "org.bluez";
const OBJECT_MANAGER: &str = "org.freedesktop.DBus.ObjectManager";
const DBUS: &str = "org.freedesktop.DBus";
/// How long D-Bus and `BlueZ` may take to answer requests that need no radio.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);
/// The largest number of D-Bus signals that may wait: several seconds' worth from many devices.
const QUEUED: NonZeroUsize = NonZeroUsize::new(4096).expect("not zero");
/// The largest number of notifications of one device that may wait: 20 s of a Myo.
const NOTIFICATIONS: usize = 4096;

/// `BlueZ` on D-Bus, with the present state of its objects. The connection is closed when this is dropped.
#[derive(Debug)]
pub(super) struct Bus {
    connection: Connection,
    state: Arc<State>,
    /// The number of searches that need a scan, and of connections being made.
    pub(super) demand: watch::Sender<Demand>,
    /// Held while connecting to a device, as adapters make one connection at a time.
    pub(super) connecting: tokio::sync::Mutex<()>,
    tasks: Vec<AbortHandle>,
}

/// An interface of an object on D-Bus.
#[derive(Clone, Copy, Debug)]
pub(super) struct Object<'a> {
    service: &'a str,
    path: &'a str,
    interface: &'a str,
}

const ROOT: Object<'static> = Object { service: BLUEZ, path: "/", interface: OBJECT_MANAGER };

impl<'a> Object<'a> {
    /// An interface of an object of `BlueZ`.
    pub fn bluez(path: &'a str, interface: &'a str) -> Object<'a> {
        Object { service: BLUEZ, path, interface }
    }
}

/// A notification: the characteristic and its value.
pub(super) type Value = (Uuid, Vec<u8>);

#[derive(Debug)]
pub(super) struct State {
    known: Mutex<Known>,
    /// The number of changes so far.
    changes: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Known {
    objects: Objects,
    links: BTreeMap<String, Subscriber>,
    /// The reason why nothing more will arrive, once there is one.
    gone: Option<String>,
}

/// The receiver of a device's notifications.
#[derive(Debug)]
struct Subscriber {
    values: mpsc::Sender<Value>,
    lost: Arc<AtomicU64>,
}

/// An error returned by `BlueZ`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    /// The name of the error, such as `org.bluez.Error.InProgress`; empty for none.
    pub name: String,
    /// The error message.
    pub text: String,
}

impl Drop for Bus {
    fn drop(&mut self) {
        self.tasks.iter().for_each(AbortHandle::abort);
    }
}

impl Bus {
    /// Connects to the system bus, or to the bus at an address, and reads the objects of `BlueZ`.
    pub async fn connect(address: Option<&str>) -> Result<Bus, BluetoothError> {
        let builder = address.map_or_else(Builder::system, Builder::address);
        let connecting = timeout(PATIENCE, builder.max_queued(QUEUED).build()).await;
        let connection = connecting
            .map_err(|_elapsed| BluetoothError::Bus("it does not answer".into()))?
            .map_err(|error| BluetoothError::Bus(error.to_string()))?;
        let signals = MessageStream::from(&connection);
        for rule in [
            format!("type='signal',sender='{BLUEZ}'"),
            format!("type='signal',sender='{DBUS}',member='NameOwnerChanged',arg0='{BLUEZ}'"),
        ] {
            let daemon = Object { service: DBUS, path: "/org/freedesktop/DBus", interface: DBUS };
            call(&connection, daemon, "AddMatch", &rule, PATIENCE)
                .await
                .map_err(|refusal| BluetoothError::Bus(refusal.text))?;
        }
        let managed = call(&connection, ROOT, "GetManagedObjects", &(), PATIENCE)
            .await
            .map_err(|refusal| BluetoothError::Daemon(refusal.text))?;
        let managed = managed.body().deserialize::<Managed>();
        let managed = managed.map_err(|error| BluetoothError::Daemon(error.to_string()))?;
        let mut known = Known::default();
        known.objects.add_all(&managed);
        let state = Arc::new(State { known: Mutex::new(known), changes: watch::Sender::new(0) });
        let demand = watch::Sender::new(Demand::default());
        let listening = tokio::spawn(listen(signals, Arc::clone(&state)));
        let scanning = scanning::run(connection.clone(), Arc::clone(&state), demand.subscribe());
        let tasks = vec![listening.abort_handle(), tokio::spawn(scanning).abort_handle()];
        let connecting = tokio::sync::Mutex::default();
        Ok(Bus { connection, state, demand, connecting, tasks })
    }

    /// Whether the connection is gone and nothing more will arrive.
    pub fn is_gone(&self) -> bool {
        self.state.known().gone.is_some()
    }

    /// Reads the present objects.
    pub fn read<T>(&self, read: impl FnOnce(&Objects) -> T) -> T {
        read(&self.state.known().objects)
    }

    /// Waits until `find` returns a value; `None` if that takes longer than `limit`.
    pub async fn until<T>(
        &self,
        limit: Duration,
        find: impl Fn(&Objects) -> Option<T>,
    ) -> Result<Option<T>, BluetoothError> {
        self.state.until(limit, find).await
    }

    /// Reads all objects again.
    pub async fn refresh(&self) -> Result<(), Refusal> {
        let reply = self.call(ROOT, "GetManagedObjects", &(), PATIENCE).await?;
        let read = reply.body().deserialize::<Managed>();
        let managed = read.map_err(|error| Refusal::of(&error))?;
        self.state.change(|known| known.objects.add_all(&managed));
        Ok(())
    }

    /// Calls a method of `BlueZ`.
    pub async fn call<B: Serialize + DynamicType + Sync>(
        &self,
        object: Object<'_>,
        method: &str,
        body: &B,
        limit: Duration,
    ) -> Result<Message, Refusal> {
        call(&self.connection, object, method, body, limit).await
    }

    /// Returns the notifications of a device from now on, until its link is lost; and a count of those dropped.
    pub fn subscribe(&self, device: &str) -> (mpsc::Receiver<Value>, Arc<AtomicU64>) {
        let (values, receiver) = mpsc::channel(NOTIFICATIONS);
        let lost = Arc::new(AtomicU64::new(0));
        let subscriber = Subscriber { values, lost: Arc::clone(&lost) };
        let mut known = self.state.known();
        if known.gone.is_none() {
            known.links.insert(device.to_owned(), subscriber);
        }
        (receiver, lost)
    }

    /// Ends the subscription to a device.
    pub fn unsubscribe(&self, device: &str) {
        self.state.known().links.remove(device);
    }
}

impl State {
    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change<T>(&self, change: impl FnOnce(&mut Known) -> T) -> T {
        let result = change(&mut self.known());
        self.changes.send_modify(|count| *count += 1);
        result
    }

    /// Waits like [`Bus::until`].
    pub async fn until<T>(
        &self,
        limit: Duration,
        find: impl Fn(&Objects) -> Option<T>,
    ) -> Result<Option<T>, BluetoothError> {
        let mut changes = self.changes.subscribe();
        let search = async {
            loop {
                {
                    let known = self.known();
                    if let Some(found) = find(&known.objects) {
                        return Ok(found);
                    }
                    if let Some(why) = &known.gone {
                        return Err(BluetoothError::Daemon(why.clone()));
                    }
                }
                if changes.changed().await.is_err() {
                    return Err(BluetoothError::Daemon("it left".into()));
                }
            }
        };
        timeout(limit, search).await.map_or(Ok(None), |found| found.map(Some))
    }

    fn end(&self, why: &str) {
        self.change(|known| {
            known.links.clear();
            known.gone.get_or_insert_with(|| why.to_owned());
        });
    }

    /// Handles a signal.
    fn take(&self, message: &Message) {
        let header = message.header();
        let (Some(interface), Some(member)) = (header.interface(), header.member()) else {
            return;
        };
        let body = message.body();
        match (interface.as_str(), member.as_str()) {
            (DBUS, "NameOwnerChanged") => {
                let owners = body.deserialize::<(String, String, String)>();
                if owners.is_ok_and(|(_, before, _)| !before.is_empty()) {
                    self.end("bluetoothd stopped");
                }
            }
            (OBJECT_MANAGER, "InterfacesAdded") => {
                if let Ok((path, added)) = body.deserialize::<(OwnedObjectPath, Interfaces)>() {
                    self.change(|known| known.objects.add(path.as_str(), &added));
                }
            }
            (OBJECT_MANAGER, "InterfacesRemoved") => {
                if let Ok((path, gone)) = body.deserialize::<(OwnedObjectPath, Vec<String>)>() {
                    self.change(|known| {
                        known.losing_links(path.as_str(), |objects| {
                            objects.remove(path.as_str(), &gone);
                        });
                    });
                }
            }
            ("org.freedesktop.DBus.Properties", "PropertiesChanged") => {
                let Some(path) = header.path() else { return };
                if let Some(value) = notified(&body) {
                    return self.known().hand_over(path.as_str(), value);
                }
                let changed = body.deserialize::<(String, Properties, Vec<String>)>();
                if let Ok((interface, properties, gone)) = changed {
                    self.take_properties(path.as_str(), &interface, &properties, &gone);
                }
            }
            _ => {}
        }
    }

    fn take_properties(
        &self,
        path: &str,
        interface: &str,
        properties: &Properties,
        invalidated: &[String],
    ) {
        if interface == CHARACTERISTIC {
            // Values change often, and no code waits for them in the objects.
            if let Some(value) = bytes_of(properties, "Value") {
                self.known().hand_over(path, value);
            }
            return;
        }
        self.change(|known| {
            known.losing_links(path, |objects| {
                objects.change(path, interface, properties, invalidated);
            });
        });
    }
}

impl Known {
    /// Applies a change, and ends the subscription to a device whose link the change ends. Changes of devices without a
    /// link are common: when a scan stops, the signal strength of every device disappears.
    fn losing_links(&mut self, device: &str, change: impl FnOnce(&mut Objects)) {
        let was_connected = self.objects.is_connected(device);
        change(&mut self.objects);
        if was_connected && !self.objects.is_connected(device) {
            self.links.remove(device);
        }
    }

    fn hand_over(&mut self, characteristic: &str, value: Vec<u8>) {
        let Some(uuid) = self.objects.characteristics.get(characteristic) else { return };
        // …/dev_A0_9E_1A_00_00_01/service0010/char0011
        let device = characteristic.rsplitn(3, '/').nth(2).unwrap_or_default();
        let Some(subscriber) = self.links.get(device) else { return };
        if subscriber.values.try_send((*uuid, value)).is_err() {
            subscriber.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Returns the value of a characteristic in a signal that contains nothing else. Most signals are like this, and this
/// path avoids a variant for each byte.
fn notified(body: &Body) -> Option<Vec<u8>> {
    type Notification<'a> = (&'a str, BTreeMap<&'a str, Deserialize<'a, Vec<u8>>>, Vec<&'a str>);
    let (interface, mut properties, _) = body.deserialize::<Notification<'_>>().ok()?;
    let value = properties.remove("Value").filter(|_| interface == CHARACTERISTIC)?;
    Some(value.0)
}

async fn listen(mut signals: MessageStream, state: Arc<State>) {
    loop {
        let next = std::future::poll_fn(|context| Pin::new(&mut signals).poll_next(context));
        match next.await {
            Some(Ok(message)) if message.message_type() == Type::Signal => state.take(&message),
            Some(Ok(_)) => {}
            Some(Err(_)) | None => break,
        }
    }
    state.end("the connection to D-Bus was closed");
}

/// Calls a method; never waits longer than `limit`.
pub(super) async fn call<B: Serialize + DynamicType + Sync>(
    connection: &Connection,
    object: Object<'_>,
    method: &str,
    body: &B,
    limit: Duration,
) -> Result<Message, Refusal> {
    let Object { service, path, interface } = object;
    let reply = connection.call_method(Some(service), path, Some(interface), method, body);
    match timeout(limit, reply).await {
        Ok(Ok(reply)) => Ok(reply),
        Ok(Err(error)) => Err(Refusal::of(&error)),
        Err(_elapsed) => Err(Refusal {
            name: String::new(),
            text: format!("{method} took longer than {} s", limit.as_secs()),
        }),
    }
}

impl Refusal {
    fn of(error: &zbus::Error) -> Refusal {
        match error {
            zbus::Error::MethodError(name, text, _) => Refusal {
                name: name.to_string(),
                text: text.clone().unwrap_or_else(|| name.to_string()),
            },
            other => Refusal { name: String::new(), text: other.to_string() },
        }
    }
}
