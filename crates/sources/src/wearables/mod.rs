//! Wearables that this computer reads directly, over their own protocols (`teampulse-devices`).

mod link;
mod session_time;
mod worn;
mod beats;
pub(crate) mod uses;
pub mod bluetooth;
pub mod empatica_e4;
pub mod heart_rate;
pub mod polar;
pub mod myo;
pub mod shimmer3;

use teampulse_core::registry::SettingsError;
use teampulse_devices::heart_rate::HeartRateSession;
use teampulse_devices::myo::MyoSession;
use teampulse_devices::polar::PolarSession;

use bluetooth::{Seen, Wearable};

/// A kind of source for a device worn by a person.
struct Kind {
    /// The `type` of the source in a study.
    name: &'static str,
    /// Whether the source reads a device, by the device name of its streams.
    reads: fn(device: &str) -> bool,
    /// Whether the source reads a Bluetooth device in range; `None` if its devices don't use Bluetooth Low Energy.
    is_in_range: Option<fn(&Seen) -> bool>,
    /// Whether the devices have the Heart Rate service, so that a source for any strap could take them, too.
    is_strap: bool,
}

/// All kinds of sources. Polar comes before the generic strap, as its sensors measure more.
const KINDS: &[Kind] = &[
    Kind {
        name: polar::DEVICE,
        reads: |device| device.starts_with(polar::DEVICE),
        is_in_range: Some(PolarSession::is_kind),
        is_strap: true,
    },
    Kind {
        name: myo::DEVICE,
        reads: |device| device == myo::DEVICE,
        is_in_range: Some(MyoSession::is_kind),
        is_strap: false,
    },
    Kind {
        name: heart_rate::KIND,
        reads: |device| device == heart_rate::DEVICE,
        is_in_range: Some(HeartRateSession::is_kind),
        is_strap: true,
    },
    Kind {
        name: shimmer3::DEVICE,
        reads: |device| device == shimmer3::DEVICE,
        is_in_range: None,
        is_strap: false,
    },
    Kind {
        name: empatica_e4::DEVICE,
        reads: |device| device == empatica_e4::DEVICE,
        is_in_range: None,
        is_strap: false,
    },
];

/// Returns the kinds of sources for devices worn by people, by their `type` in a study.
pub fn kinds() -> impl Iterator<Item = &'static str> {
    KINDS.iter().map(|kind| kind.name)
}

/// Returns an error if a person's id can't be part of a topic.
pub(crate) fn check_person(person: &str) -> Result<(), SettingsError> {
    worn::Worn::check(person)
}

/// Returns the kind of source that reads a Bluetooth device in range.
pub fn kind_in_range(seen: &Seen) -> Option<&'static str> {
    let is_it = |kind: &&Kind| kind.is_in_range.is_some_and(|is_in_range| is_in_range(seen));
    KINDS.iter().find(is_it).map(|kind| kind.name)
}

/// Whether the devices of a kind of source have the Heart Rate service.
fn is_strap(kind: &str) -> bool {
    KINDS.iter().any(|known| known.name == kind && known.is_strap)
}

/// Returns the kind of source that reads a device, by the device name of its streams.
pub fn kind_of(device: &str) -> Option<&'static str> {
    let sensor = sensor_of(device);
    KINDS.iter().find(|kind| (kind.reads)(sensor)).map(|kind| kind.name)
}

/// Returns the sensor behind a stream's device: the beats that a Polar reports have the clock of a strap.
pub fn sensor_of(device: &str) -> &str {
    device.strip_prefix("heart_rate_strap_").unwrap_or(device)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_belongs_to_the_source_that_reads_it() {
        for (device, kind) in [
            ("empatica_e4", Some("empatica_e4")),
            ("heart_rate_strap", Some("heart_rate")),
            ("polar_h10", Some("polar")),
            ("heart_rate_strap_polar_h10", Some("polar")),
            ("myo", Some("myo")),
            ("shimmer3", Some("shimmer3")),
            ("camera", None),
        ] {
            assert_eq!(kind_of(device), kind);
            assert!(kind.is_none_or(|kind| kinds().any(|each| each == kind)));
        }
    }
}
