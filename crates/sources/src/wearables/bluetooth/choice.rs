//! Chooses the wanted device among those in range.

use std::collections::BTreeSet;

use teampulse_devices::gatt::Uuid;

use super::error::BluetoothError;
use super::objects::{Device, Objects};

/// A Bluetooth device in range, as it advertises itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The Bluetooth address: `A0:9E:1A:00:00:01`.
    pub address: String,
    /// The advertised name; may be empty.
    pub name: String,
    /// The signal strength \[dBm\]; `None` while the device is connected.
    pub rssi_dbm: Option<i16>,
    /// The battery charge \[%\], if `BlueZ` knows it.
    pub battery_percent: Option<u8>,
    /// The advertised services.
    pub services: Vec<Uuid>,
    /// The path of the device's object in `BlueZ`.
    pub(super) path: String,
}

/// The device that a source looks for.
#[derive(Clone, Debug)]
pub(in crate::wearables) struct Wanted {
    /// The type of the source: `polar`.
    pub kind: &'static str,
    /// Whether a device is of the kind that the source reads.
    pub is_kind: fn(&Seen) -> bool,
    /// The device's address, if known from the study or an earlier connection.
    pub address: Option<String>,
    /// The device's name, if the study states it.
    pub name: Option<String>,
}

impl Seen {
    fn of(path: &str, device: &Device) -> Seen {
        Seen {
            address: device.address.clone(),
            name: device.name.clone(),
            rssi_dbm: device.rssi_dbm,
            battery_percent: device.battery_percent,
            services: device.services.clone(),
            path: path.to_owned(),
        }
    }

    /// Returns the devices in range of an adapter: advertising now, or connected.
    pub(super) fn all<'a>(
        objects: &'a Objects,
        adapter: &'a str,
    ) -> impl Iterator<Item = Seen> + 'a {
        let near = |device: &Device| device.rssi_dbm.is_some() || device.connected;
        let of_adapter =
            move |path: &str| path.strip_prefix(adapter).is_some_and(|rest| rest.starts_with('/'));
        let devices = objects.devices.iter();
        let near = devices.filter(move |(path, device)| of_adapter(path) && near(device));
        near.map(|(path, device)| Seen::of(path, device))
    }
}

impl Wanted {
    /// Whether the wanted device is identified by its address, so that the first match is the right one.
    pub fn is_certain(&self) -> bool {
        self.address.is_some()
    }

    /// Returns the wanted device among those in range, except for `others`.
    pub(super) fn choose(
        &self,
        in_range: impl Iterator<Item = Seen>,
        others: &BTreeSet<String>,
    ) -> Result<Seen, BluetoothError> {
        let mut fitting: Vec<Seen> = in_range.filter(|seen| self.fits(seen, others)).collect();
        let first = fitting.pop().ok_or_else(|| BluetoothError::NotInRange(self.to_string()))?;
        if fitting.is_empty() {
            return Ok(first);
        }
        fitting.push(first);
        let found: Vec<String> =
            fitting.iter().map(|seen| format!("`{}` ({})", seen.name, seen.address)).collect();
        Err(BluetoothError::Several {
            wanted: self.to_string(),
            found: found.join(" and "),
            setting: format!(
                "say which: address = \"{}\" below the study's type = \"{}\"",
                fitting[0].address, self.kind
            ),
        })
    }

    fn fits(&self, seen: &Seen, others: &BTreeSet<String>) -> bool {
        if let Some(address) = &self.address {
            return seen.address.eq_ignore_ascii_case(address);
        }
        let named = self.name.as_ref().is_none_or(|name| seen.name == *name);
        named && (self.is_kind)(seen) && !others.contains(&seen.address)
    }
}

impl std::fmt::Display for Wanted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (&self.address, &self.name) {
            (Some(address), _) => write!(f, "the device {address} of type {}", self.kind),
            (None, Some(name)) => write!(f, "the device `{name}` of type {}", self.kind),
            (None, None) => write!(f, "a device of type {}", self.kind),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strap(address: &str) -> Seen {
        Seen {
            address: address.to_owned(),
            name: format!("Strap {address}"),
            rssi_dbm: Some(-60),
            battery_percent: None,
            services: vec![Uuid::short(0x180d)],
            path: format!("/{address}"),
        }
    }

    fn wanted(address: Option<&str>, name: Option<&str>) -> Wanted {
        Wanted {
            kind: "heart_rate",
            is_kind: |seen| seen.services.contains(&Uuid::short(0x180d)),
            address: address.map(str::to_owned),
            name: name.map(str::to_owned),
        }
    }

    fn chosen(wanted: &Wanted, others: &[&str]) -> Result<String, String> {
        let in_range = [strap("A"), strap("B"), Seen { services: vec![], ..strap("C") }];
        let others = others.iter().map(|each| (*each).to_owned()).collect();
        let chosen = wanted.choose(in_range.into_iter(), &others);
        chosen.map(|seen| seen.address).map_err(|error| error.to_string())
    }

    #[test]
    fn an_address_or_a_name_says_which_one_is_meant() {
        assert_eq!(chosen(&wanted(Some("b"), None), &[]), Ok("B".into()));
        assert_eq!(chosen(&wanted(None, Some("Strap A")), &[]), Ok("A".into()));
        let missing = "find the device Z of type heart_rate: it is not in range";
        assert_eq!(chosen(&wanted(Some("Z"), None), &[]), Err(missing.into()));
    }

    #[test]
    fn of_two_of_one_kind_none_is_guessed() {
        let both =
            "choose a device of type heart_rate: `Strap A` (A) and `Strap B` (B) are in range";
        assert_eq!(chosen(&wanted(None, None), &[]), Err(both.into()));
        assert_eq!(chosen(&wanted(None, None), &["A"]), Ok("B".into()));
    }
}
