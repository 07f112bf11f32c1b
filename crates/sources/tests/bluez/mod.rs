//! `BlueZ` as far as a driver meets it, over emulated devices: on a `dbus-daemon` of its own.
//!
//! Written from the documentation of its D-Bus API (`org.bluez.Device`, `.GattCharacteristic`), answered by hand.

pub mod worn;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader};
use std::pin::Pin;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_devices::gatt::Uuid;
use zbus::connection::Builder;
use zbus::export::futures_core::Stream;
use zbus::message::Type;
use zbus::{Connection, Message, MessageStream, OwnedObjectPath, OwnedVariant, Variant};

/// The path of the adapter.
const ADAPTER: &str = "/org/bluez/hci0";
const PROPERTIES: &str = "org.freedesktop.DBus.Properties";
/// How often time passes for the devices.
const STEP: Duration = Duration::from_millis(5);

type Properties = BTreeMap<String, OwnedVariant>;
type Interfaces = BTreeMap<String, Properties>;

/// A device with characteristics, whose time is that of the test.
pub trait Peripheral: Send + Sync {
    /// Its characteristics.
    fn characteristics(&self) -> Vec<Uuid>;
    /// Enables notifications.
    fn subscribe(&mut self, of: Uuid) -> bool;
    /// Reads a value.
    fn read(&mut self, of: Uuid) -> Option<Vec<u8>>;
    /// Writes a value.
    fn write(&mut self, of: Uuid, value: &[u8]) -> bool;
    /// What it sends until then.
    fn until(&mut self, secs: f64) -> Vec<(Uuid, Vec<u8>)>;
    /// The link is lost, or was ended.
    fn disconnect(&mut self);
}

/// A device in range.
pub struct Device {
    /// Its address.
    pub address: &'static str,
    /// Its name.
    pub name: &'static str,
    /// The services that it advertises.
    pub services: Vec<Uuid>,
    /// The device itself.
    pub peripheral: Box<dyn Peripheral>,
}

/// What happened to a device, and what is to happen.
#[derive(Debug, Default)]
pub struct Course {
    /// How often it was connected to.
    pub connections: usize,
    /// How often it was disconnected on request.
    pub disconnections: usize,
    /// Its link is to be lost.
    pub drop: bool,
    /// What was written to it.
    pub written: Vec<Vec<u8>>,
}

/// A `BlueZ` with its devices; gone when it is dropped.
pub struct Bluez {
    /// The address of its bus.
    pub address: String,
    /// What happens to each device.
    pub courses: Vec<Arc<Mutex<Course>>>,
    /// The time of its devices.
    pub clock: Stopwatch,
    connection: Connection,
    daemon: Child,
    serving: tokio::task::JoinHandle<()>,
    _folder: tempfile::TempDir,
}

impl Drop for Bluez {
    fn drop(&mut self) {
        self.serving.abort();
        self.daemon.kill().ok();
        self.daemon.wait().ok();
    }
}

impl Bluez {
    /// Starts a bus and a `BlueZ` on it.
    pub async fn start(devices: Vec<Device>) -> Bluez {
        let folder = tempfile::tempdir().expect("a folder");
        let (daemon, address) = daemon(folder.path());
        let builder = Builder::address(address.as_str());
        let connection = builder.build().await.expect("a connection to the bus");
        let calls = MessageStream::from(&connection);
        connection.request_name("org.bluez").await.expect("the name of BlueZ");
        let courses: Vec<_> = devices.iter().map(|_| Arc::default()).collect();
        let clock = Stopwatch::start();
        let served: Vec<Served> = devices
            .into_iter()
            .zip(&courses)
            .map(|(device, course)| Served {
                path: format!("{ADAPTER}/dev_{}", device.address.replace(':', "_")),
                device,
                course: Arc::clone(course),
                connected: false,
                notifying: BTreeSet::new(),
            })
            .collect();
        let server = Server { connection: connection.clone(), devices: served, clock };
        let serving = tokio::spawn(server.serve(calls));
        Bluez { address, courses, clock, connection, daemon, serving, _folder: folder }
    }

    /// How many programs are connected to the bus, without `BlueZ` and the bus.
    pub async fn clients(&self) -> usize {
        let (bus, path) = ("org.freedesktop.DBus", "/org/freedesktop/DBus");
        let reply = self.connection.call_method(Some(bus), path, Some(bus), "ListNames", &()).await;
        let names = reply.expect("names").body().deserialize::<Vec<String>>().expect("names");
        names.iter().filter(|name| name.starts_with(':')).count() - 1
    }
}

/// A bus for nobody else, and its address.
fn daemon(folder: &std::path::Path) -> (Child, String) {
    let config = folder.join("bus.conf");
    let text = format!(
        "<busconfig><type>system</type><listen>unix:dir={}</listen><auth>EXTERNAL</auth>\
         <policy context=\"default\"><allow send_destination=\"*\" eavesdrop=\"true\"/>\
         <allow eavesdrop=\"true\"/><allow own=\"*\"/></policy></busconfig>",
        folder.display()
    );
    std::fs::write(&config, text).expect("a file");
    let mut daemon = Command::new("dbus-daemon")
        .arg("--nofork")
        .arg("--print-address=1")
        .arg(format!("--config-file={}", config.display()))
        .stdout(Stdio::piped())
        .spawn()
        .expect("dbus-daemon, which `make test` installs");
    let out = daemon.stdout.take().expect("its output");
    let mut address = String::new();
    BufReader::new(out).read_line(&mut address).expect("its address");
    (daemon, address.trim().to_owned())
}

/// A device as it is served.
struct Served {
    path: String,
    device: Device,
    course: Arc<Mutex<Course>>,
    connected: bool,
    notifying: BTreeSet<Uuid>,
}

struct Server {
    connection: Connection,
    devices: Vec<Served>,
    clock: Stopwatch,
}

fn owned<'a>(value: impl Into<Variant<'a>>) -> OwnedVariant {
    OwnedVariant::try_from(value.into()).expect("no descriptor")
}

fn properties<const N: usize>(all: [(&str, OwnedVariant); N]) -> Properties {
    all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

impl Served {
    fn characteristic_path(&self, of: Uuid) -> Option<String> {
        let all = self.device.peripheral.characteristics();
        let at = all.iter().position(|each| *each == of)?;
        Some(format!("{}/service0010/char{:04x}", self.path, 0x11 + 3 * at))
    }

    fn characteristic_at(&self, path: &str) -> Option<Uuid> {
        let all = self.device.peripheral.characteristics();
        all.into_iter().find(|each| self.characteristic_path(*each).as_deref() == Some(path))
    }

    fn device_properties(&self) -> Properties {
        let services: Vec<String> = self.device.services.iter().map(Uuid::to_string).collect();
        properties([
            ("Address", owned(self.device.address)),
            ("Name", owned(self.device.name)),
            ("RSSI", owned(-60_i16)),
            ("UUIDs", owned(services)),
            ("Connected", owned(self.connected)),
            ("ServicesResolved", owned(self.connected)),
        ])
    }

    /// Its characteristics, as objects.
    fn objects(&self) -> Vec<(String, Interfaces)> {
        let object = |of: Uuid| {
            let all = properties([("UUID", owned(of.to_string()))]);
            let interfaces = Interfaces::from([("org.bluez.GattCharacteristic1".to_owned(), all)]);
            Some((self.characteristic_path(of)?, interfaces))
        };
        self.device.peripheral.characteristics().into_iter().filter_map(object).collect()
    }
}

impl Server {
    async fn serve(mut self, mut calls: MessageStream) {
        let mut step = tokio::time::interval(STEP);
        loop {
            let next = std::future::poll_fn(|context| Pin::new(&mut calls).poll_next(context));
            tokio::select! {
                call = next => match call {
                    Some(Ok(call)) if call.message_type() == Type::MethodCall => {
                        self.answer(&call).await;
                    }
                    Some(Ok(_)) => {}
                    _ => return,
                },
                _ = step.tick() => self.pass().await,
            }
        }
    }

    /// Time passes.
    async fn pass(&mut self) {
        let secs = self.clock.elapsed().as_secs_f64();
        for at in 0..self.devices.len() {
            let device = &mut self.devices[at];
            let sent = device.device.peripheral.until(secs);
            let is_dropped = std::mem::take(&mut device.course.lock().expect("a course").drop);
            for (of, value) in sent {
                if self.devices[at].connected && self.devices[at].notifying.contains(&of) {
                    self.notify(at, of, &value).await;
                }
            }
            if is_dropped && self.devices[at].connected {
                self.disconnect(at).await;
            }
        }
    }

    async fn notify(&self, at: usize, of: Uuid, value: &[u8]) {
        let Some(path) = self.devices[at].characteristic_path(of) else { return };
        let changed = properties([("Value", owned(value.to_vec()))]);
        self.changed(&path, "org.bluez.GattCharacteristic1", changed).await;
    }

    async fn changed(&self, path: &str, interface: &str, changed: Properties) {
        let body = (interface, changed, Vec::<String>::new());
        self.emit(path, PROPERTIES, "PropertiesChanged", &body).await;
    }

    async fn emit<B: serde::Serialize + zbus::DynamicType>(
        &self,
        path: &str,
        interface: &str,
        signal: &str,
        body: &B,
    ) {
        let nobody = None::<&str>;
        let sent = self.connection.emit_signal(nobody, path, interface, signal, body).await;
        sent.expect("a bus");
    }

    async fn connect(&mut self, at: usize) {
        let device = &mut self.devices[at];
        device.connected = true;
        device.course.lock().expect("a course").connections += 1;
        let (path, objects) = (device.path.clone(), device.objects());
        let state = |name| properties([(name, owned(true))]);
        self.changed(&path, "org.bluez.Device1", state("Connected")).await;
        for (path, interfaces) in objects {
            let path = OwnedObjectPath::try_from(path).expect("a path");
            let manager = "org.freedesktop.DBus.ObjectManager";
            self.emit("/", manager, "InterfacesAdded", &(path, interfaces)).await;
        }
        self.changed(&path, "org.bluez.Device1", state("ServicesResolved")).await;
    }

    async fn disconnect(&mut self, at: usize) {
        let device = &mut self.devices[at];
        device.connected = false;
        device.notifying.clear();
        device.device.peripheral.disconnect();
        let (path, objects) = (device.path.clone(), device.objects());
        let state = |name| properties([(name, owned(false))]);
        self.changed(&path, "org.bluez.Device1", state("ServicesResolved")).await;
        for (path, interfaces) in objects {
            let path = OwnedObjectPath::try_from(path).expect("a path");
            let gone: Vec<String> = interfaces.into_keys().collect();
            let manager = "org.freedesktop.DBus.ObjectManager";
            self.emit("/", manager, "InterfacesRemoved", &(path, gone)).await;
        }
        self.changed(&path, "org.bluez.Device1", state("Connected")).await;
    }

    async fn answer(&mut self, call: &Message) {
        let header = call.header();
        let path = header.path().map(ToString::to_string).unwrap_or_default();
        let member = header.member().map(ToString::to_string).unwrap_or_default();
        if member == "GetManagedObjects" {
            let objects = self.managed();
            return self.connection.reply(&header, &objects).await.expect("a bus");
        }
        let at = self.devices.iter().position(|device| path.starts_with(&device.path));
        let value = match (member.as_str(), at) {
            ("SetDiscoveryFilter" | "StartDiscovery" | "StopDiscovery", _) => Some(None),
            ("Connect", Some(at)) => {
                self.connect(at).await;
                Some(None)
            }
            ("Disconnect", Some(at)) => {
                self.devices[at].course.lock().expect("a course").disconnections += 1;
                self.disconnect(at).await;
                Some(None)
            }
            (_, Some(at)) => self.of_characteristic(at, &path, &member, call).await,
            _ => None,
        };
        let sent = match value {
            Some(Some(value)) => self.connection.reply(&header, &value).await,
            Some(None) => self.connection.reply(&header, &()).await,
            None => {
                let name = "org.bluez.Error.Failed";
                self.connection.reply_error(&header, name, &"it can't").await
            }
        };
        sent.expect("a bus");
    }

    /// The answer of a characteristic, with the value that was read; `None` for a refusal.
    async fn of_characteristic(
        &mut self,
        at: usize,
        path: &str,
        member: &str,
        call: &Message,
    ) -> Option<Option<Vec<u8>>> {
        let device = self.devices.get_mut(at).filter(|device| device.connected)?;
        let of = device.characteristic_at(path)?;
        let peripheral = &mut device.device.peripheral;
        match member {
            "StartNotify" => {
                device.notifying.insert(of);
                peripheral.subscribe(of).then_some(None)
            }
            "StopNotify" => {
                device.notifying.remove(&of);
                Some(None)
            }
            "ReadValue" => {
                let value = peripheral.read(of)?;
                // As `BlueZ` does.
                self.notify(at, of, &value).await;
                Some(Some(value))
            }
            "WriteValue" => {
                let body = call.body();
                let (value, _): (Vec<u8>, Properties) = body.deserialize().ok()?;
                device.course.lock().expect("a course").written.push(value.clone());
                peripheral.write(of, &value).then_some(None)
            }
            _ => None,
        }
    }

    fn managed(&self) -> BTreeMap<zbus::ObjectPath<'static>, Interfaces> {
        let path = |path: String| zbus::ObjectPath::try_from(path).expect("a path");
        let adapter = properties([("Powered", owned(true))]);
        let adapter = Interfaces::from([("org.bluez.Adapter1".to_owned(), adapter)]);
        let mut all = BTreeMap::from([(path(ADAPTER.to_owned()), adapter)]);
        for device in &self.devices {
            let properties = device.device_properties();
            let interfaces = Interfaces::from([("org.bluez.Device1".to_owned(), properties)]);
            all.insert(path(device.path.clone()), interfaces);
            let objects = device.objects().into_iter().filter(|_| device.connected);
            all.extend(objects.map(|(each, interfaces)| (path(each), interfaces)));
        }
        all
    }
}
