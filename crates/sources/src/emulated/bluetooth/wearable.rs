//! Bluetooth devices of simulated people; all devices of a study are behind one private D-Bus.

use std::io;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_emulators::body::Sensor;
use teampulse_emulators::devices::{
    H10, H10Settings, Myo, MyoIncident, Peripheral, Strap, StrapSettings, Verity, VerityModel,
    VeritySettings,
};

use super::{EmulatedBluetooth, EmulatedDevice, LinkIncident};
use crate::emulated::{EmulatedWearable, Emulation, Wardrobe, check_clock};
use crate::wearables::bluetooth::check_address;

/// A Bluetooth device that a simulated person wears, behind a BlueZ on a private D-Bus.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmulatedRadio<D: Default> {
    /// The person who wears it: `p001`.
    pub person: String,
    /// The device's Bluetooth address, such as `A0:9E:1A:00:00:01`; by default the devices of a study are numbered.
    #[serde(default)]
    pub address: Option<String>,
    /// The faults of the link, in order of time.
    #[serde(default)]
    pub faults: Vec<LinkIncident>,
    /// The properties and faults of the device itself.
    #[serde(default)]
    pub device: D,
}

/// The settings of an emulated Myo.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MyoSettings {
    /// The faults of the Myo, in order of time.
    pub faults: Vec<MyoIncident>,
}

/// The settings of an emulated Polar OH1: the same as those of a Verity Sense.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Oh1Settings(pub VeritySettings);

/// The settings of a kind of Bluetooth device: everything it needs besides its row in [`EmulatedWearable`].
trait RadioDevice: Default {
    /// The type of the source that reads the device.
    const SOURCE: &'static str;
    /// The body signals that the device measures, among those that simulated people can also publish on ROS.
    const SENSES: &'static [Sensor];

    /// Creates the device with a Bluetooth address.
    fn peripheral(&self, address: &str) -> io::Result<Box<dyn Peripheral>>;
}

impl RadioDevice for H10Settings {
    const SOURCE: &'static str = "polar";
    const SENSES: &'static [Sensor] = &[Sensor::Ecg];

    fn peripheral(&self, address: &str) -> io::Result<Box<dyn Peripheral>> {
        check_clock(self.clock_fast)?;
        Ok(Box::new(H10::new(H10Settings { serial: serial(address), ..self.clone() })))
    }
}

impl RadioDevice for VeritySettings {
    const SOURCE: &'static str = "polar";
    const SENSES: &'static [Sensor] = &[Sensor::Ppg];

    fn peripheral(&self, address: &str) -> io::Result<Box<dyn Peripheral>> {
        optical(self, VerityModel::VeritySense, address)
    }
}

impl RadioDevice for Oh1Settings {
    const SOURCE: &'static str = "polar";
    const SENSES: &'static [Sensor] = &[Sensor::Ppg];

    fn peripheral(&self, address: &str) -> io::Result<Box<dyn Peripheral>> {
        optical(&self.0, VerityModel::Oh1, address)
    }
}

impl RadioDevice for StrapSettings {
    const SOURCE: &'static str = "heart_rate";
    const SENSES: &'static [Sensor] = &[];

    fn peripheral(&self, _: &str) -> io::Result<Box<dyn Peripheral>> {
        check_clock(self.clock_fast)?;
        Ok(Box::new(Strap::new(self.clone())))
    }
}

impl RadioDevice for MyoSettings {
    const SOURCE: &'static str = "myo";
    const SENSES: &'static [Sensor] = &[Sensor::Emg];

    fn peripheral(&self, _: &str) -> io::Result<Box<dyn Peripheral>> {
        Ok(Box::new(Myo::new(self.faults.clone())))
    }
}

/// A Bluetooth device of any kind.
pub(in crate::emulated) trait Radio {
    /// The person who wears it.
    fn person(&self) -> &str;

    /// The body signals that the device measures, among those that simulated people can also publish on ROS.
    fn senses(&self) -> &'static [Sensor];

    /// Returns the device, numbered by its place in the study.
    fn part(&self, place: usize) -> io::Result<Part>;
}

impl<D: RadioDevice> Radio for EmulatedRadio<D> {
    fn person(&self) -> &str {
        &self.person
    }

    fn senses(&self) -> &'static [Sensor] {
        D::SENSES
    }

    fn part(&self, place: usize) -> io::Result<Part> {
        let EmulatedRadio { person, address, faults, device } = self;
        let address = address.clone().unwrap_or_else(|| numbered(place));
        check_address(&address).map_err(|error| io::Error::other(error.message))?;
        let peripheral = device.peripheral(&address)?;
        let (person, faults) = (person.clone(), faults.clone());
        Ok(Part { person, address, faults, source: D::SOURCE, peripheral })
    }
}

/// Puts Bluetooth devices on a shared D-Bus, whose socket is `bus` in `folder`, or in a temporary folder if that is
/// `None`; other devices are skipped.
pub async fn open(
    wearables: &[&EmulatedWearable],
    wardrobe: &Wardrobe,
    folder: Option<&Path>,
) -> io::Result<Emulation> {
    let mut devices = Vec::new();
    let (mut names, mut lines) = (Vec::new(), Vec::new());
    let mut clock = None;
    for (wearable, place) in wearables.iter().zip(1..) {
        let Some(radio) = wearable.radio() else { continue };
        let Part { person, address, faults, source, peripheral } = radio.part(place)?;
        let worn = wardrobe.worn_by(&person).map_err(io::Error::other)?;
        names.push(format!("{} of {person}", peripheral.advertisement().name));
        lines.push(format!(
            "[[sources]]\ntype    = \"{source}\"\nperson  = \"{person}\"\naddress = \"{address}\""
        ));
        clock = Some(worn.clock);
        let wearer = Box::new(worn.wearer);
        devices.push(EmulatedDevice { address, peripheral, wearer, incidents: faults });
    }
    let clock = clock.ok_or_else(|| io::Error::other("no Bluetooth device is worn"))?;
    let bluetooth = match folder {
        Some(folder) => EmulatedBluetooth::start_in(folder, devices, clock).await,
        None => EmulatedBluetooth::start(devices, clock).await,
    };
    let bluetooth = bluetooth
        .map_err(|error| io::Error::other(format!("failed to {error}; {}", error.hint())))?;
    Ok(Emulation {
        device: names.join(", "),
        address: format!("DBUS_SYSTEM_BUS_ADDRESS={}", bluetooth.bus_address()),
        study: lines.join("\n"),
        serving: Box::pin(async move {
            let _served = bluetooth;
            std::future::pending().await
        }),
    })
}

/// A Bluetooth device, ready to be put on a bus.
pub(in crate::emulated) struct Part {
    person: String,
    address: String,
    faults: Vec<LinkIncident>,
    /// The type of the source that reads the device.
    source: &'static str,
    peripheral: Box<dyn Peripheral>,
}

/// Creates a Polar optical sensor.
fn optical(
    settings: &VeritySettings,
    model: VerityModel,
    address: &str,
) -> io::Result<Box<dyn Peripheral>> {
    check_clock(settings.clock_fast)?;
    let settings = VeritySettings { model, serial: serial(address), ..settings.clone() };
    Ok(Box::new(Verity::new(settings)))
}

/// Returns the ID of a Polar device, which is the end of its address, as printed on it.
fn serial(address: &str) -> String {
    address.replace(':', "").chars().skip(4).collect()
}

/// Returns the address of a device for which the study gives none.
fn numbered(place: usize) -> String {
    let [high, low] = u16::try_from(place).unwrap_or(u16::MAX).to_be_bytes();
    format!("A0:9E:1A:00:{high:02X}:{low:02X}")
}
