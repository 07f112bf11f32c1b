//! Wearables that this computer reads itself, over their own protocols (`teampulse-devices`).

mod link;
mod worn;
mod beats;
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

/// The kinds of sources that are a device which a person wears.
pub const KINDS: [&str; 5] =
    [empatica_e4::DEVICE, heart_rate::KIND, polar::DEVICE, myo::DEVICE, shimmer3::DEVICE];

/// An error where a person's id can't be a part of a topic.
pub(crate) fn check_person(person: &str) -> Result<(), SettingsError> {
    worn::Worn::check(person)
}

/// The kind of source that reads a Bluetooth device in range; a Polar is more than a strap.
pub fn kind_in_range(seen: &Seen) -> Option<&'static str> {
    type IsKind = fn(&Seen) -> bool;
    const KINDS: [(&str, IsKind); 3] = [
        (polar::DEVICE, PolarSession::is_kind),
        (myo::DEVICE, MyoSession::is_kind),
        (heart_rate::KIND, HeartRateSession::is_kind),
    ];
    KINDS.iter().find(|(_, is_kind)| is_kind(seen)).map(|(kind, _)| *kind)
}

/// The kind of source that reads a device, by the device of its streams.
pub fn kind_of(device: &str) -> Option<&'static str> {
    // Beats that a Polar reports have the clock of a strap.
    let sensor = device.strip_prefix("heart_rate_strap_").unwrap_or(device);
    match sensor {
        empatica_e4::DEVICE => Some(empatica_e4::DEVICE),
        heart_rate::DEVICE => Some(heart_rate::KIND),
        myo::DEVICE => Some(myo::DEVICE),
        shimmer3::DEVICE => Some(shimmer3::DEVICE),
        _ => sensor.starts_with(polar::DEVICE).then_some(polar::DEVICE),
    }
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
            assert!(kind.is_none_or(|kind| KINDS.contains(&kind)));
        }
    }
}
