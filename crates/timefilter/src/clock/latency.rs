//! The fixed latency of a device, which cannot be observed from one-way timestamps.

/// The shortest time from the measurement of the last sample of a packet to the packet's arrival. The duration of the
/// packet is not part of it: clocks know it from the number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latency {
    /// The latency [s].
    pub secs: f64,
    /// Half the width of its 95 % interval [s].
    pub uncertainty_secs: f64,
}

impl Latency {
    /// The default for Bluetooth: a sensor's filters and at least one connection event, which are 7.5 to 50 ms apart
    /// on an ordinary host.
    pub const BLUETOOTH: Latency = Latency::new(0.050, 0.050);
    /// The default for Wi-Fi: one medium access and the network stacks of both ends.
    pub const WIFI: Latency = Latency::new(0.005, 0.005);
    /// The default for USB: from a mouse polled every millisecond to the readout of a camera frame.
    pub const USB: Latency = Latency::new(0.020, 0.020);

    /// Creates a latency with its uncertainty [s].
    pub const fn new(secs: f64, uncertainty_secs: f64) -> Latency {
        Latency { secs, uncertainty_secs }
    }
}

/// The prior knowledge of a kind of device, before calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownDevice {
    /// The device's name in streams: `polar_h10`.
    pub name: &'static str,
    /// The fixed latency.
    pub latency: Latency,
    /// The time after which the device's counter wraps [ns]; `None` if it does not wrap or there is no
    /// counter.
    pub wraps_nanos: Option<i64>,
    /// The source of the figures.
    pub source: &'static str,
}

impl KnownDevice {
    /// Finds a device by its name, or by the longest name in the table that is a prefix of it:
    /// `shimmer3_gsr` is a `shimmer3`.
    pub fn find(name: &str) -> Option<&'static KnownDevice> {
        DEVICES
            .iter()
            .filter(|device| begins(name, device.name))
            .max_by_key(|device| device.name.len())
    }

    const fn new(name: &'static str, millis: (f64, f64), source: &'static str) -> KnownDevice {
        let latency = Latency::new(millis.0 / 1e3, millis.1 / 1e3);
        KnownDevice { name, latency, wraps_nanos: None, source }
    }

    const fn wrapping(self, nanos: i64) -> KnownDevice {
        KnownDevice { wraps_nanos: Some(nanos), ..self }
    }
}

/// Whether a name is `word`, alone or followed by an underscore and a suffix.
fn begins(name: &str, word: &str) -> bool {
    name.strip_prefix(word).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
}

const BLUETOOTH: &str = "no published figure; assumed as for any Bluetooth Low Energy sensor";

/// The known devices. Latencies are `(centre, half of the 95 % interval)` [ms], wide where no measurement
/// is published; `calibrate` narrows them.
pub const DEVICES: &[KnownDevice] = &[
    KnownDevice::new("polar_h10", (50.0, 50.0), BLUETOOTH),
    KnownDevice::new("polar_verity_sense", (50.0, 50.0), BLUETOOTH),
    KnownDevice::new("polar_oh1", (50.0, 50.0), BLUETOOTH),
    KnownDevice::new(
        "heart_rate_strap",
        (1500.0, 1500.0),
        "intervals between beats are up to 3 or 4 s late: polar-ble-sdk issues 227, 508",
    ),
    KnownDevice::new("myo", (20.0, 20.0), "no published figure: notifications come 10 ms apart"),
    KnownDevice::new(
        "empatica_e4",
        (200.0, 200.0),
        "no published figure: Bluetooth, then a program that stamps and relays by TCP",
    ),
    KnownDevice::new("shimmer3", (40.0, 40.0), "no published figure: Bluetooth Classic, RFCOMM")
        .wrapping(512_000_000_000),
    KnownDevice::new(
        "microphone",
        (25.0, 25.0),
        "no published figure: converter and driver, and a block of the sound system",
    ),
    KnownDevice::new(
        "microphone_voice",
        (250.0, 30.0),
        "the pitch of a frame is decided 0.223 s after its middle; a block of the sound system",
    ),
    KnownDevice::new(
        "camera_usb",
        (50.0, 35.0),
        "half an exposure, a frame read out (33 ms at 30 Hz), transfer",
    ),
    KnownDevice::new("camera", (50.0, 50.0), "as over USB, make unknown"),
    KnownDevice::new(
        "keyboard",
        (30.0, 25.0),
        "15 to 60 ms from the start of the key press: D. Luu, Keyboard latency, 2017",
    ),
    KnownDevice::new("mouse", (10.0, 10.0), "polled every 1 to 8 ms, and debounced"),
    KnownDevice::new("bluetooth", (50.0, 50.0), "`Latency::BLUETOOTH`"),
    KnownDevice::new("wifi", (5.0, 5.0), "`Latency::WIFI`"),
    KnownDevice::new("usb", (20.0, 20.0), "`Latency::USB`"),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_device_is_found_by_the_beginning_of_its_name() {
        let name = |name| KnownDevice::find(name).map(|device| device.name);
        assert_eq!(name("shimmer3"), Some("shimmer3"));
        assert_eq!(name("shimmer3_gsr"), Some("shimmer3"));
        assert_eq!(name("camera_usb"), Some("camera_usb"));
        assert_eq!(name("camera_front"), Some("camera"));
        assert_eq!(name("shimmer32"), None);
        assert_eq!(name(""), None);
    }

    #[test]
    fn a_device_is_in_the_table_once() {
        let names: BTreeSet<&str> = DEVICES.iter().map(|device| device.name).collect();
        assert_eq!(names.len(), DEVICES.len());
    }

    #[test]
    fn no_latency_can_be_negative() {
        for device in DEVICES {
            let Latency { secs, uncertainty_secs } = device.latency;
            assert!(secs > 0.0 && (0.0..=secs).contains(&uncertainty_secs), "{}", device.name);
            assert!(!device.source.is_empty());
        }
    }

    #[test]
    fn transports_are_in_the_table_as_they_are() {
        for (name, latency) in
            [("bluetooth", Latency::BLUETOOTH), ("wifi", Latency::WIFI), ("usb", Latency::USB)]
        {
            assert_eq!(KnownDevice::find(name).map(|device| device.latency), Some(latency));
        }
    }
}
