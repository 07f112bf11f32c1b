//! The objects of `BlueZ` on D-Bus, tracked by its signals.

use std::collections::{BTreeMap, HashMap};

use zbus::{OwnedObjectPath, OwnedVariant, Variant};

use teampulse_devices::gatt::Uuid;

/// The properties of an interface.
pub(super) type Properties = BTreeMap<String, OwnedVariant>;
/// The interfaces of an object.
pub(super) type Interfaces = BTreeMap<String, Properties>;
/// All objects, as `GetManagedObjects` lists them.
pub(super) type Managed = HashMap<OwnedObjectPath, Interfaces>;

pub(super) const ADAPTER: &str = "org.bluez.Adapter1";
pub(super) const DEVICE: &str = "org.bluez.Device1";
const BATTERY: &str = "org.bluez.Battery1";
pub(super) const CHARACTERISTIC: &str = "org.bluez.GattCharacteristic1";

/// The largest number of objects kept of each kind: enough for a hall full of devices with changing addresses.
const MOST: usize = 10_000;

/// The known objects of `BlueZ`, by their paths.
#[derive(Debug, Default)]
pub(super) struct Objects {
    pub adapters: BTreeMap<String, Adapter>,
    pub devices: BTreeMap<String, Device>,
    pub characteristics: BTreeMap<String, Uuid>,
}

/// A Bluetooth adapter of this computer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Adapter {
    /// Whether it is powered; `None` if `BlueZ` does not state it.
    pub powered: Option<bool>,
}

/// A device that `BlueZ` knows: in range, connected, or remembered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Device {
    pub address: String,
    pub name: String,
    /// The signal strength [dBm], only while the device is in range.
    pub rssi_dbm: Option<i16>,
    pub services: Vec<Uuid>,
    pub connected: bool,
    pub services_resolved: bool,
    pub battery_percent: Option<u8>,
}

impl Objects {
    /// Adds all listed objects.
    pub fn add_all(&mut self, managed: &Managed) {
        let by_path = managed.iter().map(|(path, interfaces)| (path.as_str(), interfaces));
        for (path, interfaces) in by_path.collect::<BTreeMap<_, _>>() {
            self.add(path, interfaces);
        }
    }

    /// Adds an object that appeared, or the new interfaces of a known one.
    pub fn add(&mut self, path: &str, interfaces: &Interfaces) {
        for (interface, properties) in interfaces {
            match interface.as_str() {
                ADAPTER if self.adapters.len() < MOST => {
                    self.adapters.entry(path.to_owned()).or_default();
                }
                DEVICE if self.devices.len() < MOST => {
                    self.devices.entry(path.to_owned()).or_default();
                }
                CHARACTERISTIC if self.characteristics.len() < MOST => {
                    if let Some(uuid) = text_of(properties, "UUID").and_then(parse_uuid) {
                        self.characteristics.insert(path.to_owned(), uuid);
                    }
                }
                _ => {}
            }
            self.change(path, interface, properties, &[]);
        }
    }

    /// Removes the interfaces that an object lost.
    pub fn remove(&mut self, path: &str, interfaces: &[String]) {
        for interface in interfaces {
            match interface.as_str() {
                ADAPTER => drop(self.adapters.remove(path)),
                DEVICE => drop(self.devices.remove(path)),
                CHARACTERISTIC => drop(self.characteristics.remove(path)),
                BATTERY => self.set_battery(path, None),
                _ => {}
            }
        }
    }

    /// Applies changed properties of a known object; those in `invalidated` no longer have a value.
    pub fn change(
        &mut self,
        path: &str,
        interface: &str,
        properties: &Properties,
        invalidated: &[String],
    ) {
        match interface {
            ADAPTER => {
                let Some(adapter) = self.adapters.get_mut(path) else { return };
                adapter.powered = bool_of(properties, "Powered").or(adapter.powered);
            }
            DEVICE => {
                let Some(device) = self.devices.get_mut(path) else { return };
                device.change(properties, invalidated);
            }
            BATTERY => self.set_battery(path, byte_of(properties, "Percentage")),
            _ => {}
        }
    }

    fn set_battery(&mut self, path: &str, percent: Option<u8>) {
        if let Some(device) = self.devices.get_mut(path) {
            device.battery_percent = percent;
        }
    }

    /// Whether a device is connected.
    pub fn is_connected(&self, device: &str) -> bool {
        self.devices.get(device).is_some_and(|device| device.connected)
    }

    /// Returns the characteristics of a device, each with its path; of two with the same UUID, the first.
    pub fn characteristics_of(&self, device: &str) -> BTreeMap<Uuid, String> {
        let prefix = format!("{device}/");
        let below = self.characteristics.range(prefix.clone()..);
        let below = below.take_while(|(path, _)| path.starts_with(&prefix));
        let mut found = BTreeMap::new();
        for (path, uuid) in below {
            found.entry(*uuid).or_insert_with(|| path.clone());
        }
        found
    }
}

impl Device {
    fn change(&mut self, properties: &Properties, invalidated: &[String]) {
        let text = |name| text_of(properties, name).map(str::to_owned);
        self.address = text("Address").unwrap_or(std::mem::take(&mut self.address));
        let name = text("Name").or_else(|| text("Alias").filter(|_| self.name.is_empty()));
        self.name = name.unwrap_or(std::mem::take(&mut self.name));
        if let Some(Variant::I16(rssi_dbm)) = properties.get("RSSI").map(|value| &**value) {
            self.rssi_dbm = Some(*rssi_dbm);
        } else if invalidated.iter().any(|name| name == "RSSI") {
            self.rssi_dbm = None;
        }
        self.connected = bool_of(properties, "Connected").unwrap_or(self.connected);
        self.services_resolved =
            bool_of(properties, "ServicesResolved").unwrap_or(self.services_resolved);
        if let Some(Variant::Array(uuids)) = properties.get("UUIDs").map(|value| &**value) {
            let uuid = |value: &Variant<'_>| match value {
                Variant::Str(text) => parse_uuid(text.as_str()),
                _ => None,
            };
            self.services = uuids.inner().iter().filter_map(uuid).collect();
        }
    }
}

fn text_of<'a>(properties: &'a Properties, name: &str) -> Option<&'a str> {
    match &**properties.get(name)? {
        Variant::Str(text) => Some(text.as_str()),
        _ => None,
    }
}

fn bool_of(properties: &Properties, name: &str) -> Option<bool> {
    match &**properties.get(name)? {
        Variant::Bool(is) => Some(*is),
        _ => None,
    }
}

fn byte_of(properties: &Properties, name: &str) -> Option<u8> {
    match &**properties.get(name)? {
        Variant::U8(byte) => Some(*byte),
        _ => None,
    }
}

/// Returns the bytes of a property.
pub(super) fn bytes_of(properties: &Properties, name: &str) -> Option<Vec<u8>> {
    let Variant::Array(bytes) = &**properties.get(name)? else { return None };
    let byte = |value: &Variant<'_>| match value {
        Variant::U8(byte) => Some(*byte),
        _ => None,
    };
    bytes.inner().iter().map(byte).collect()
}

/// Parses a UUID as written by `BlueZ`.
fn parse_uuid(text: &str) -> Option<Uuid> {
    let is_uuid = text.len() == 36;
    let digits = is_uuid.then(|| text.replace('-', ""))?;
    u128::from_str_radix(&digits, 16).ok().map(Uuid)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRAP: &str = "/org/bluez/hci0/dev_A0_9E_1A_00_00_01";

    fn properties<const N: usize>(all: [(&str, Variant<'static>); N]) -> Properties {
        let owned = |value: Variant<'static>| OwnedVariant::try_from(value).expect("no descriptor");
        all.into_iter().map(|(name, value)| (name.to_owned(), owned(value))).collect()
    }

    fn strap() -> Objects {
        let mut objects = Objects::default();
        let uuids = vec!["0000180d-0000-1000-8000-00805f9b34fb".to_owned()];
        let strap = properties([
            ("Address", Variant::from("A0:9E:1A:00:00:01")),
            ("Alias", Variant::from("A0-9E-1A-00-00-01")),
            ("Name", Variant::from("Polar H10 00000001")),
            ("RSSI", Variant::from(-60_i16)),
            ("UUIDs", Variant::from(uuids)),
        ]);
        objects.add(STRAP, &Interfaces::from([(DEVICE.to_owned(), strap)]));
        objects
    }

    #[test]
    fn a_device_is_known_by_what_bluez_says_of_it() {
        let objects = strap();
        let device = &objects.devices[STRAP];
        assert_eq!(
            (device.name.as_str(), device.rssi_dbm, device.connected),
            ("Polar H10 00000001", Some(-60), false)
        );
        assert_eq!(device.services, [Uuid::short(0x180d)]);
    }

    #[test]
    fn a_device_out_of_range_has_no_signal_strength() {
        let mut objects = strap();
        objects.change(STRAP, DEVICE, &Properties::new(), &["RSSI".to_owned()]);
        assert_eq!(objects.devices[STRAP].rssi_dbm, None);
        objects.remove(STRAP, &[DEVICE.to_owned()]);
        assert!(objects.devices.is_empty());
        objects.change(STRAP, DEVICE, &Properties::new(), &[]);
        assert!(objects.devices.is_empty(), "what was removed stays so");
    }

    #[test]
    fn characteristics_are_those_below_their_device() {
        let mut objects = strap();
        let uuid = || Variant::from("00002a37-0000-1000-8000-00805f9b34fb");
        for path in [
            format!("{STRAP}/service0010/char0011"),
            format!("{STRAP}/service0020/char0021"),
            format!("{STRAP}0/service0010/char0011"),
        ] {
            let interfaces =
                Interfaces::from([(CHARACTERISTIC.to_owned(), properties([("UUID", uuid())]))]);
            objects.add(&path, &interfaces);
        }
        let found = objects.characteristics_of(STRAP);
        let first = format!("{STRAP}/service0010/char0011");
        assert_eq!(found, BTreeMap::from([(Uuid::short(0x2a37), first)]));
    }

    #[test]
    fn a_property_of_another_type_is_left_out() {
        let mut objects = strap();
        let odd = properties([("RSSI", Variant::from("near")), ("Connected", Variant::from(1_u8))]);
        objects.change(STRAP, DEVICE, &odd, &[]);
        let device = &objects.devices[STRAP];
        assert_eq!((device.rssi_dbm, device.connected), (Some(-60), false));
        assert_eq!(parse_uuid("180d"), None);
    }
}
