//! Wearable Bluetooth devices in range.

use serde::Serialize;
use teampulse_core::counted::counted;
use teampulse_sources::wearables::bluetooth::Seen;
use teampulse_sources::wearables::kind_in_range;

use crate::output;

/// A device that a source can read.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Device {
    name: String,
    address: String,
    /// The type of the source that reads it.
    #[serde(rename = "type")]
    kind: &'static str,
    rssi_dbm: Option<i16>,
    battery_percent: Option<u8>,
}

impl Device {
    /// Describes a device in range; `None` if no source reads it.
    pub fn of(seen: &Seen) -> Option<Device> {
        Some(Device {
            name: seen.name.clone(),
            address: seen.address.clone(),
            kind: kind_in_range(seen)?,
            rssi_dbm: seen.rssi_dbm,
            battery_percent: seen.battery_percent,
        })
    }

    fn line(&self) -> String {
        let unknown = || "?".to_owned();
        let rssi = self.rssi_dbm.map_or_else(unknown, |dbm| format!("{dbm} dBm"));
        let battery = self.battery_percent.map_or_else(unknown, |percent| format!("{percent} %"));
        let Device { name, address, kind, .. } = self;
        format!("  {name:<38} {address:<18} {rssi:>8}  battery {battery:>5}  {kind}")
    }

    fn source(&self, person: usize) -> String {
        let Device { kind, address, .. } = self;
        format!(
            "[[sources]]\ntype    = \"{kind}\"\nperson  = \"p{person:03}\"\naddress = \"{address}\"\n"
        )
    }
}

/// Prints devices, with the lines of a study that read them.
pub fn show(devices: &[Device]) {
    output::line(format!("Bluetooth: {}", counted(devices.len(), "wearable", "wearables")));
    output::lines(devices.iter().map(Device::line));
    if !devices.is_empty() {
        output::line("\nlines for a study, each with the person who wears it:");
    }
    output::lines(devices.iter().zip(1..).map(|(device, person)| device.source(person)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_a_device_are_a_source() {
        let device = Device {
            name: "Polar H10 00000001".into(),
            address: "A0:9E:1A:00:00:01".into(),
            kind: "polar",
            rssi_dbm: Some(-60),
            battery_percent: None,
        };
        assert!(device.line().contains("-60 dBm  battery     ?  polar"), "{}", device.line());
        let study: toml::Table = toml::from_str(&device.source(1)).expect("lines of a study");
        let source = &study["sources"][0];
        assert_eq!(source["type"].as_str(), Some("polar"));
        assert_eq!(source["person"].as_str(), Some("p001"));
        assert_eq!(source["address"].as_str(), Some("A0:9E:1A:00:00:01"));
    }
}
