//! Bluetooth devices of simulated people: all those of a study are behind one private D-Bus.

use std::io;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_emulators::devices::{
    H10, H10Settings, Myo, MyoIncident, Peripheral, Strap, Verity, VerityModel, VeritySettings,
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
    /// The address of its radio, such as `A0:9E:1A:00:00:01`; by default the devices of a study are numbered.
    #[serde(default)]
    pub address: Option<String>,
    /// The faults of its link, in order of time.
    #[serde(default)]
    pub faults: Vec<LinkIncident>,
    /// The properties of the device itself, and its faults.
    #[serde(default)]
    pub device: D,
}

/// The settings of an emulated Myo.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MyoSettings {
    /// Its faults, in order of time.
    pub faults: Vec<MyoIncident>,
}

/// Puts Bluetooth devices on a shared D-Bus; other devices are skipped. Its socket is `bus` in an existing folder, or
/// in one of its own.
pub async fn open(
    wearables: &[&EmulatedWearable],
    wardrobe: &Wardrobe,
    folder: Option<&Path>,
) -> io::Result<Emulation> {
    let mut devices = Vec::new();
    let (mut names, mut lines) = (Vec::new(), Vec::new());
    let mut clock = None;
    for (wearable, place) in wearables.iter().zip(1..) {
        let Some(part) = part(wearable, place)? else { continue };
        let Part { person, address, faults, source, peripheral } = part;
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
struct Part {
    person: String,
    address: String,
    faults: Vec<LinkIncident>,
    /// The source that reads it.
    source: &'static str,
    peripheral: Box<dyn Peripheral>,
}

/// A Bluetooth device at its position in a study; `None` for any other.
fn part(wearable: &EmulatedWearable, place: usize) -> io::Result<Option<Part>> {
    fn of<D: Default>(
        radio: &EmulatedRadio<D>,
        place: usize,
        device: impl FnOnce(&str) -> io::Result<(&'static str, Box<dyn Peripheral>)>,
    ) -> io::Result<Option<Part>> {
        let EmulatedRadio { person, address, faults, .. } = radio;
        let address = address.clone().unwrap_or_else(|| numbered(place));
        check_address(&address).map_err(|error| io::Error::other(error.message))?;
        let (source, peripheral) = device(&address)?;
        let (person, faults) = (person.clone(), faults.clone());
        Ok(Some(Part { person, address, faults, source, peripheral }))
    }
    match wearable {
        EmulatedWearable::PolarH10(radio) => of(radio, place, |address| {
            check_clock(radio.device.clock_fast)?;
            let settings = H10Settings { serial: serial(address), ..radio.device.clone() };
            Ok(("polar", Box::new(H10::new(settings))))
        }),
        EmulatedWearable::PolarVeritySense(radio) => {
            of(radio, place, |address| optical(radio, VerityModel::VeritySense, address))
        }
        EmulatedWearable::PolarOh1(radio) => {
            of(radio, place, |address| optical(radio, VerityModel::Oh1, address))
        }
        EmulatedWearable::HeartRate(radio) => of(radio, place, |_| {
            check_clock(radio.device.clock_fast)?;
            Ok(("heart_rate", Box::new(Strap::new(radio.device.clone()))))
        }),
        EmulatedWearable::Myo(radio) => {
            of(radio, place, |_| Ok(("myo", Box::new(Myo::new(radio.device.faults.clone())))))
        }
        EmulatedWearable::EmpaticaE4(_) | EmulatedWearable::Shimmer3(_) => Ok(None),
    }
}

/// An optical sensor of Polar, with the source that reads it.
fn optical(
    radio: &EmulatedRadio<VeritySettings>,
    model: VerityModel,
    address: &str,
) -> io::Result<(&'static str, Box<dyn Peripheral>)> {
    check_clock(radio.device.clock_fast)?;
    let settings = VeritySettings { model, serial: serial(address), ..radio.device.clone() };
    Ok(("polar", Box::new(Verity::new(settings))))
}

/// The ID of a Polar device: the maker prints the end of the address on it.
fn serial(address: &str) -> String {
    address.replace(':', "").chars().skip(4).collect()
}

/// The address of a device without one.
fn numbered(place: usize) -> String {
    let [high, low] = u16::try_from(place).unwrap_or(u16::MAX).to_be_bytes();
    format!("A0:9E:1A:00:{high:02X}:{low:02X}")
}
