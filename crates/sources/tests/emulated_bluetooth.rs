//! The emulated Bluetooth, as seen by a client of BlueZ on D-Bus.

use std::collections::HashMap;
use std::pin::Pin;
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_emulators::devices::{
    H10, H10Settings, Myo, Peripheral, Strap, StrapSettings, Wearer,
};
use teampulse_sources::emulated::bluetooth::{
    EmulatedBluetooth, EmulatedBluetoothError, EmulatedDevice, LinkFault, LinkIncident,
};
use tokio::time::timeout;
use zbus::export::futures_core::Stream;
use zbus::{Connection, Message, MessageStream, OwnedObjectPath, OwnedVariant, Variant};

const H10_ADDRESS: &str = "A0:9E:1A:00:00:01";
const H10_PATH: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01";
const ADAPTER: &str = "/org/bluez/hci0";
const CONTROL: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01/service0040/char0041";
const DATA: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01/service0040/char0044";
const HEART_RATE: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01/service000e/char000f";
const BATTERY: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01/service0030/char0031";
/// The longest time that anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// A heart that beats twice a second.
struct Heart;

impl Wearer for Heart {
    fn ecg_uv(&mut self, _: f64) -> f64 {
        500.0
    }

    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let first = (after_secs * 2.0).floor() as u64 + 1;
        let last = (until_secs * 2.0).floor() as u64;
        (first..=last).map(|beat| beat as f64 / 2.0).collect()
    }
}

fn device(address: &str, peripheral: impl Peripheral + 'static) -> EmulatedDevice {
    EmulatedDevice {
        address: address.into(),
        peripheral: Box::new(peripheral),
        wearer: Box::new(Heart),
        incidents: Vec::new(),
    }
}

fn h10() -> EmulatedDevice {
    device(H10_ADDRESS, H10::new(H10Settings::default()))
}

type Properties = HashMap<String, OwnedVariant>;
type Managed = HashMap<OwnedObjectPath, HashMap<String, Properties>>;

/// A client of the emulated BlueZ, which sees all its signals.
struct Client {
    connection: Connection,
    signals: MessageStream,
}

impl Client {
    async fn of(bluetooth: &EmulatedBluetooth) -> Client {
        let builder = zbus::connection::Builder::address(bluetooth.bus_address());
        let connection = builder.build().await.expect("the bus accepts clients");
        let rule = zbus::MatchRule::builder().sender("org.bluez").build().expect("a rule");
        let signals =
            MessageStream::for_match_rule(rule, &connection, None).await.expect("a match");
        Client { connection, signals }
    }

    async fn call<B>(&self, path: &str, method: &str, body: &B) -> zbus::Result<Message>
    where
        B: serde::Serialize + zbus::DynamicType,
    {
        let interface = match path.rsplit('/').next() {
            Some("") => "org.freedesktop.DBus.ObjectManager",
            Some("hci0") => "org.bluez.Adapter1",
            Some(last) if last.starts_with("char") => "org.bluez.GattCharacteristic1",
            _ => "org.bluez.Device1",
        };
        self.connection.call_method(Some("org.bluez"), path, Some(interface), method, body).await
    }

    async fn objects(&self) -> Managed {
        let reply = self.call("/", "GetManagedObjects", &()).await.expect("objects");
        reply.body().deserialize().expect("objects")
    }

    async fn read(&self, characteristic: &str) -> Vec<u8> {
        let options: HashMap<&str, Variant<'_>> = HashMap::new();
        let reply = self.call(characteristic, "ReadValue", &options).await.expect("a value");
        reply.body().deserialize().expect("bytes")
    }

    async fn write(&self, characteristic: &str, value: &[u8]) -> zbus::Result<Message> {
        let options: HashMap<&str, Variant<'_>> = HashMap::new();
        self.call(characteristic, "WriteValue", &(value, options)).await
    }

    /// The next signal that `find` accepts.
    async fn signal<T>(&mut self, find: impl Fn(&Message) -> Option<T>) -> T {
        let search = async {
            loop {
                let next =
                    std::future::poll_fn(|context| Pin::new(&mut self.signals).poll_next(context));
                let message = next.await.expect("the bus is there").expect("a message");
                if let Some(found) = find(&message) {
                    return found;
                }
            }
        };
        timeout(PATIENCE, search).await.expect("the signal comes")
    }

    /// Waits until a property changes to a value.
    async fn changed<T>(&mut self, path: &str, property: &str) -> T
    where
        T: TryFrom<OwnedVariant>,
    {
        self.signal(|message| changed(message, path, property)).await
    }

    /// Finds the strap, and connects to it.
    async fn connect(&mut self, path: &str) {
        self.call(ADAPTER, "StartDiscovery", &()).await.expect("a discovery");
        self.signal(|message| added(message).filter(|added| added == path)).await;
        self.call(ADAPTER, "StopDiscovery", &()).await.expect("it discovers");
        self.call(path, "Connect", &()).await.expect("a connection");
        assert!(self.changed::<bool>(path, "ServicesResolved").await);
    }
}

fn changed<T: TryFrom<OwnedVariant>>(message: &Message, path: &str, property: &str) -> Option<T> {
    let header = message.header();
    if header.member()?.as_str() != "PropertiesChanged" || header.path()?.as_str() != path {
        return None;
    }
    let body = message.body();
    let (_, mut properties, _): (String, Properties, Vec<String>) = body.deserialize().ok()?;
    T::try_from(properties.remove(property)?).ok()
}

fn added(message: &Message) -> Option<String> {
    if message.header().member()?.as_str() != "InterfacesAdded" {
        return None;
    }
    let body = message.body();
    let (path, _): (OwnedObjectPath, HashMap<String, Properties>) = body.deserialize().ok()?;
    Some(path.to_string())
}

fn name_of(error: &zbus::Error) -> &str {
    match error {
        zbus::Error::MethodError(name, ..) => name.as_str(),
        _ => "",
    }
}

async fn start(devices: Vec<EmulatedDevice>) -> EmulatedBluetooth {
    EmulatedBluetooth::start(devices, Stopwatch::start()).await.expect("dbus-daemon is installed")
}

#[tokio::test]
async fn devices_appear_while_somebody_discovers() {
    let strap = device("C0:00:00:00:00:02", Strap::new(StrapSettings::default()));
    let bluetooth = start(vec![h10(), strap, device("D2:3B:85:94:32:8E", Myo::default())]).await;
    let mut client = Client::of(&bluetooth).await;
    let before = client.objects().await;
    assert!(before.keys().all(|path| !path.as_str().contains("dev_")));
    client.call(ADAPTER, "StartDiscovery", &()).await.expect("a discovery");
    let twice = client.call(ADAPTER, "StartDiscovery", &()).await.expect_err("one at a time");
    assert_eq!(name_of(&twice), "org.bluez.Error.InProgress");
    let first: i16 = client.changed(H10_PATH, "RSSI").await;
    let second: i16 = client.changed(H10_PATH, "RSSI").await;
    assert_ne!(first, second);
    let objects = client.objects().await;
    let devices = objects.iter().filter(|(path, _)| path.as_str().contains("dev_"));
    let mut names: Vec<String> = devices
        .map(|(_, interfaces)| interfaces["org.bluez.Device1"]["Name"].to_string())
        .collect();
    names.sort();
    assert_eq!(names, ["\"Heart Strap\"", "\"My Myo\"", "\"Polar H10 A1B2C3D4\""]);
}

#[tokio::test]
async fn a_read_is_answered_and_repeated_as_a_change() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    assert_eq!(client.read(BATTERY).await, [87]);
    assert_eq!(client.changed::<Vec<u8>>(BATTERY, "Value").await, [87]);
    assert_eq!(client.read(CONTROL).await[..2], [0x0f, 0x05]);
    assert_eq!(client.changed::<Vec<u8>>(CONTROL, "Value").await[..2], [0x0f, 0x05]);
}

#[tokio::test]
async fn commands_are_answered_and_frames_follow() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    let start = [2, 0, 0, 1, 130, 0, 1, 1, 14, 0];
    let early = client.write(CONTROL, &start).await.expect_err("indications are off");
    assert_eq!(name_of(&early), "org.bluez.Error.Failed");
    for characteristic in [CONTROL, DATA, HEART_RATE] {
        client.call(characteristic, "StartNotify", &()).await.expect("a subscription");
    }
    client.write(CONTROL, &start).await.expect("it accepts commands");
    let answer: Vec<u8> = client.changed(CONTROL, "Value").await;
    assert_eq!(answer, [0xf0, 2, 0, 0, 0]);
    let frame: Vec<u8> = client.changed(DATA, "Value").await;
    assert_eq!(frame.len(), 10 + 3 * 73);
    assert_eq!(frame[10..13], [0xf4, 0x01, 0]); // 500 µV
    // Two intervals of half a second in each second.
    let rates = |message: &Message| {
        changed::<Vec<u8>>(message, HEART_RATE, "Value").filter(|value| value.len() == 6)
    };
    assert_eq!(client.signal(rates).await, [0x10, 120, 0, 2, 0, 2]);
}

#[tokio::test]
async fn a_lost_link_is_reported_and_what_streamed_goes_on() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    for _ in 0..3 {
        client.connect(H10_PATH).await;
        client.call(CONTROL, "StartNotify", &()).await.expect("a subscription");
        client.write(CONTROL, &[2, 0, 0, 1, 130, 0, 1, 1, 14, 0]).await.expect("a command");
        let answer: Vec<u8> = client.changed(CONTROL, "Value").await;
        assert!(matches!(answer[3], 0 | 6), "{answer:?}");
        assert!(bluetooth.suffer(H10_ADDRESS, LinkFault::Drop).await);
        assert!(!client.changed::<bool>(H10_PATH, "ServicesResolved").await);
        assert!(!client.changed::<bool>(H10_PATH, "Connected").await);
        assert!(!bluetooth.is_connected(H10_ADDRESS));
        let gone = client.write(CONTROL, &[3, 0]).await;
        assert!(gone.is_err());
        // For the next discovery to add it.
        let path = zbus::ObjectPath::try_from(H10_PATH).expect("a path");
        client.call(ADAPTER, "RemoveDevice", &path).await.expect("it is known");
    }
    client.connect(H10_PATH).await;
    client.call(CONTROL, "StartNotify", &()).await.expect("a subscription");
    client.write(CONTROL, &[2, 0, 0, 1, 130, 0, 1, 1, 14, 0]).await.expect("a command");
    let answer: Vec<u8> = client.changed(CONTROL, "Value").await;
    assert_eq!(answer, [0xf0, 2, 0, 6]); // already in this state
}

#[tokio::test]
async fn a_disconnect_is_answered_before_it_is_reported() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    let mut all = MessageStream::from(&client.connection);
    client.call(H10_PATH, "Disconnect", &()).await.expect("it is connected");
    client.signal(|message| changed(message, H10_PATH, "Connected").filter(|on: &bool| !on)).await;
    let mut next = async || std::future::poll_fn(|cx| Pin::new(&mut all).poll_next(cx)).await;
    let first = loop {
        let message = next().await.expect("the bus is there").expect("a message");
        let is_report = message.header().member().is_some();
        if is_report || message.message_type() == zbus::message::Type::MethodReturn {
            break message;
        }
    };
    assert_eq!(first.message_type(), zbus::message::Type::MethodReturn);
    let again = client.call(H10_PATH, "Disconnect", &()).await.expect_err("it is not connected");
    assert_eq!(name_of(&again), "org.bluez.Error.NotConnected");
}

#[tokio::test]
async fn a_device_out_of_range_is_connected_to_when_it_is_back() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    assert!(bluetooth.suffer(H10_ADDRESS, LinkFault::Away(0.5)).await);
    client.call(H10_PATH, "Connect", &()).await.expect("it comes back");
    assert!(bluetooth.is_connected(H10_ADDRESS));
}

#[tokio::test]
async fn what_is_scheduled_happens_at_its_time() {
    let clock = Stopwatch::start();
    let mut strap = h10();
    strap.incidents = vec![LinkIncident { at_secs: 2.0, fault: LinkFault::Drop }];
    let bluetooth = EmulatedBluetooth::start(vec![strap], clock).await.expect("dbus-daemon");
    let mut client = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    assert!(!client.changed::<bool>(H10_PATH, "ServicesResolved").await);
    assert!(clock.elapsed() >= Duration::from_secs(2));
}

#[tokio::test]
async fn a_client_that_leaves_leaves_no_subscription_and_no_discovery() {
    let bluetooth = start(vec![h10()]).await;
    let mut client = Client::of(&bluetooth).await;
    let other = Client::of(&bluetooth).await;
    client.connect(H10_PATH).await;
    other.call(HEART_RATE, "StartNotify", &()).await.expect("a subscription");
    other.call(ADAPTER, "StartDiscovery", &()).await.expect("a discovery");
    assert!(client.changed::<bool>(ADAPTER, "Discovering").await);
    drop(other);
    let off = |message: &Message| changed::<bool>(message, ADAPTER, "Discovering").filter(|on| !on);
    client.signal(off).await;
    let objects = client.objects().await;
    let path = OwnedObjectPath::try_from(HEART_RATE).expect("a path");
    let notifying = &objects[&path]["org.bluez.GattCharacteristic1"]["Notifying"];
    assert_eq!(*notifying, OwnedVariant::from(false));
    assert!(bluetooth.is_connected(H10_ADDRESS));
}

#[tokio::test]
async fn two_devices_of_one_address_are_refused() {
    let result = EmulatedBluetooth::start(vec![h10(), h10()], Stopwatch::start()).await;
    assert!(matches!(result.err(), Some(EmulatedBluetoothError::SameAddress(_))));
}
