//! Emulated wearables on real transports, for drivers and programs that do not know about the emulation.
//!
//! The devices are those of `teampulse_emulators::devices`, worn by simulated people; here they are put on the
//! transport of the real ones. [`EmulatedWearable`] is the table. A Bluetooth type needs only its settings, with their
//! `RadioDevice` in `bluetooth/wearable.rs`; any other type is a file with its settings and an `open`, which returns
//! where the device can be reached and the task that serves it.

pub mod bluetooth;
mod wardrobe;
mod empatica_e4;
mod shimmer3;

use std::io;
use std::pin::Pin;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_emulators::body::Sensor;
use teampulse_emulators::devices::{H10Settings, StrapSettings, VeritySettings};

use bluetooth::Radio;
pub use bluetooth::{EmulatedRadio, MyoSettings, Oh1Settings};
pub use empatica_e4::EmulatedE4;
pub use shimmer3::{EmulatedShimmer, serve_shimmer};
pub use wardrobe::{PersonError, Wardrobe};

/// A wearable of a simulated person, which `teampulse emulate` puts on its transport.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum EmulatedWearable {
    /// The streaming server of an Empatica E4, on loopback.
    EmpaticaE4(EmulatedE4),
    /// A Shimmer3 GSR+, on a pseudoterminal in place of its serial port.
    Shimmer3(EmulatedShimmer),
    /// A Polar H10, behind a BlueZ on a private D-Bus.
    PolarH10(EmulatedRadio<H10Settings>),
    /// A Polar Verity Sense, behind a BlueZ on a private D-Bus.
    PolarVeritySense(EmulatedRadio<VeritySettings>),
    /// A Polar OH1, behind a BlueZ on a private D-Bus.
    PolarOh1(EmulatedRadio<Oh1Settings>),
    /// A heart rate strap of any maker, behind a BlueZ on a private D-Bus.
    HeartRate(EmulatedRadio<StrapSettings>),
    /// A Myo armband, behind a BlueZ on a private D-Bus.
    Myo(EmulatedRadio<MyoSettings>),
}

/// A wearable, by its transport.
enum Transport<'a> {
    Server(&'a EmulatedE4),
    Port(&'a EmulatedShimmer),
    Bluetooth(&'a dyn Radio),
}

impl EmulatedWearable {
    fn transport(&self) -> Transport<'_> {
        match self {
            EmulatedWearable::EmpaticaE4(e4) => Transport::Server(e4),
            EmulatedWearable::Shimmer3(shimmer) => Transport::Port(shimmer),
            EmulatedWearable::PolarH10(radio) => Transport::Bluetooth(radio),
            EmulatedWearable::PolarVeritySense(radio) => Transport::Bluetooth(radio),
            EmulatedWearable::PolarOh1(radio) => Transport::Bluetooth(radio),
            EmulatedWearable::HeartRate(radio) => Transport::Bluetooth(radio),
            EmulatedWearable::Myo(radio) => Transport::Bluetooth(radio),
        }
    }

    /// The person who wears the device.
    pub fn person(&self) -> &str {
        match self.transport() {
            Transport::Server(e4) => &e4.person,
            Transport::Port(shimmer) => &shimmer.person,
            Transport::Bluetooth(radio) => radio.person(),
        }
    }

    /// Whether the device is reached over Bluetooth; [`bluetooth::open`] puts several on one bus.
    pub fn is_bluetooth(&self) -> bool {
        self.radio().is_some()
    }

    fn radio(&self) -> Option<&dyn Radio> {
        match self.transport() {
            Transport::Bluetooth(radio) => Some(radio),
            Transport::Server(_) | Transport::Port(_) => None,
        }
    }

    /// The body signals that the device measures, among those that simulated people can also publish on ROS.
    pub fn senses(&self) -> &'static [Sensor] {
        match self.transport() {
            Transport::Server(_) => {
                &[Sensor::Ppg, Sensor::EdaWrist, Sensor::Temperature, Sensor::Acceleration]
            }
            Transport::Port(_) => &[Sensor::EdaFingers],
            Transport::Bluetooth(radio) => radio.senses(),
        }
    }

    /// Puts the device on its transport.
    pub async fn open(&self, wardrobe: &Wardrobe) -> io::Result<Emulation> {
        let worn = wardrobe.worn_by(self.person()).map_err(io::Error::other)?;
        match self.transport() {
            Transport::Server(e4) => e4.open(worn).await,
            Transport::Port(shimmer) => shimmer.open(worn),
            Transport::Bluetooth(_) => bluetooth::open(&[self], wardrobe, None).await,
        }
    }
}

/// The largest rate error that the clock of a device may have.
const CLOCK_OFF: f64 = 0.1;

/// Returns an error for a clock that runs implausibly fast or slow.
fn check_clock(fast: f64) -> io::Result<()> {
    if fast.abs() <= CLOCK_OFF {
        return Ok(());
    }
    Err(io::Error::other(format!("clock_fast is {fast}; expected -{CLOCK_OFF} to {CLOCK_OFF}")))
}

/// An emulated device that can be reached.
pub struct Emulation {
    /// The device and its wearer, such as `Shimmer3 of p001`.
    pub device: String,
    /// Where the device can be reached.
    pub address: String,
    /// The lines of a study file that read the device.
    pub study: String,
    /// Serves the device until it fails or is dropped.
    pub serving: Serving,
}

/// A task that serves a device.
pub type Serving = Pin<Box<dyn Future<Output = io::Result<()>> + Send>>;

#[cfg(test)]
mod tests {
    use teampulse_emulators::devices::Fault;

    use super::*;

    #[test]
    fn a_study_says_what_a_device_is_like_and_how_it_fails() {
        let worn: EmulatedWearable = toml::from_str(
            r#"
            type   = "polar_h10"
            person = "p001"
            faults = [{ at_secs = 5.0, fault = "drop" }]
            [device]
            clock_fast      = 0.02
            battery_percent = 12
            faults          = [
                { at_secs = 10.0, fault = { late_answer = 0.5 } },
                { at_secs = 20.0, fault = "strap_off" },
            ]
            "#,
        )
        .expect("settings");
        let EmulatedWearable::PolarH10(strap) = worn else { panic!("not an H10") };
        assert_eq!((strap.faults.len(), strap.device.incidents.len()), (1, 2));
        assert_eq!(strap.device.incidents[0].fault, Fault::LateAnswer(0.5));
        assert!((strap.device.clock_fast - 0.02).abs() < 1e-12);
    }

    #[test]
    fn no_clock_stands_still_or_runs_backwards() {
        for fast in [-1.0, 0.5, f64::NAN, f64::INFINITY] {
            assert!(check_clock(fast).is_err(), "{fast}");
        }
        assert!(check_clock(0.02).is_ok());
    }
}
