//! Bluetooth devices of simulated people: all of a study behind one private D-Bus.

use std::io;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_emulators::devices::{H10, H10Settings, Myo, Peripheral, Strap, StrapSettings};

use super::{EmulatedBluetooth, EmulatedDevice, LinkIncident};
use crate::emulated::{EmulatedWearable, Emulation, Wardrobe};

/// A Bluetooth device that a simulated person wears, behind a BlueZ on a private D-Bus.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EmulatedRadio {
    /// The person who wears it: `p001`.
    pub person: String,
    /// Of its radio, such as `A0:9E:1A:00:00:01`; without it the devices of a study are numbered.
    #[serde(default)]
    pub address: Option<String>,
    /// What goes wrong with its link, in the order of time.
    #[serde(default)]
    pub faults: Vec<LinkIncident>,
}

/// Puts Bluetooth devices on a D-Bus that they share; others are left out. Its socket is `bus` in a folder that is
/// there, or in one of its own.
pub async fn open(
    wearables: &[&EmulatedWearable],
    wardrobe: &Wardrobe,
    folder: Option<&Path>,
) -> io::Result<Emulation> {
    let mut devices = Vec::new();
    let (mut names, mut lines) = (Vec::new(), Vec::new());
    let mut clock = None;
    for (place, wearable) in wearables.iter().enumerate() {
        let Some(radio) = radio(wearable) else { continue };
        let address = radio.address.clone().unwrap_or_else(|| numbered(place + 1));
        let Some((source, peripheral)) = parts(wearable, &address) else { continue };
        let worn = wardrobe.worn_by(&radio.person).map_err(io::Error::other)?;
        names.push(format!("{} of {}", peripheral.advertisement().name, radio.person));
        lines.push(format!(
            "[[sources]]\ntype    = \"{source}\"\nperson  = \"{}\"\naddress = \"{}\"",
            radio.person, address
        ));
        clock = Some(worn.clock);
        devices.push(EmulatedDevice {
            address,
            peripheral,
            wearer: Box::new(worn.wearer),
            incidents: radio.faults.clone(),
        });
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

/// The settings of a Bluetooth device.
fn radio(wearable: &EmulatedWearable) -> Option<&EmulatedRadio> {
    match wearable {
        EmulatedWearable::PolarH10(radio)
        | EmulatedWearable::HeartRate(radio)
        | EmulatedWearable::Myo(radio) => Some(radio),
        EmulatedWearable::EmpaticaE4(_) | EmulatedWearable::Shimmer3(_) => None,
    }
}

/// The source that reads a Bluetooth device, and the device itself.
fn parts(
    wearable: &EmulatedWearable,
    address: &str,
) -> Option<(&'static str, Box<dyn Peripheral>)> {
    match wearable {
        EmulatedWearable::PolarH10(_) => {
            // The maker prints the end of the address on it.
            let serial = address.replace(':', "").chars().skip(4).collect();
            let settings = H10Settings { serial, ..H10Settings::default() };
            Some(("polar", Box::new(H10::new(settings))))
        }
        EmulatedWearable::HeartRate(_) => {
            Some(("heart_rate", Box::new(Strap::new(StrapSettings::default()))))
        }
        EmulatedWearable::Myo(_) => Some(("myo", Box::new(Myo::default()))),
        EmulatedWearable::EmpaticaE4(_) | EmulatedWearable::Shimmer3(_) => None,
    }
}

/// The address of a device without one.
fn numbered(place: usize) -> String {
    let [high, low] = u16::try_from(place).unwrap_or(u16::MAX).to_be_bytes();
    format!("A0:9E:1A:00:{high:02X}:{low:02X}")
}
