//! A Shimmer3, read over a serial port.

use std::time::Duration;

use async_trait::async_trait;
use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::source::{Source, SourceError};
use teampulse_devices::shimmer3::{Sensors, ShimmerSession, ShimmerSettings};
use tokio::time::timeout;

use super::link::Conversation;
use super::session_time::SessionTime;
use super::uses::Use;
use super::worn::Worn;
use crate::SourceContext;
use crate::serial::SerialPort;

/// The name of the device in a study and in the table of latencies.
pub(super) const DEVICE: &str = "shimmer3";
/// The baud rate of the dock; Bluetooth ports have none.
const BAUD: u32 = 115_200;
/// How long a port may take to open: Bluetooth pages a device for up to 20 s.
const PATIENCE: Duration = Duration::from_secs(25);
/// The range of rates to which the device can be set \[Hz\].
const LEAST_HZ: f64 = 1.0;
const MOST_HZ: f64 = 1024.0;

/// A Shimmer3 (GSR+ or another unit, firmware `LogAndStream`) that a person wears: skin conductance, PPG, acceleration,
/// rotation, magnetic field, battery.
///
/// It is reached through a serial port: `sudo rfcomm bind 0 ADDRESS` makes a paired device available as `/dev/rfcomm0`.
/// Its own clock times the samples. If the link loses a byte, one packet is lost, which is counted; no channel shifts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shimmer3 {
    /// The person who wears the device, by pseudonym: `p001`.
    pub person: String,
    /// The serial port.
    #[serde(default = "port")]
    pub port: String,
    /// The sensors to measure with.
    #[serde(default = "sensors")]
    pub sensors: Vec<ShimmerSensor>,
    /// The sampling rate \[Hz\], from 1 to 1024. Above 256 Hz with several sensors, the radio loses bytes.
    #[serde(default = "rate_hz")]
    pub rate_hz: f64,
}

/// A sensor of a Shimmer3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShimmerSensor {
    /// Skin conductance.
    Eda,
    /// The optical pulse sensor.
    Ppg,
    /// The low-noise accelerometer.
    AccelerationLowNoise,
    /// The wide-range accelerometer.
    AccelerationWideRange,
    /// The gyroscope.
    Gyroscope,
    /// The magnetometer.
    Magnetometer,
    /// The voltage of the battery, with every sample.
    Battery,
}

impl ShimmerSensor {
    fn bits(self) -> Sensors {
        match self {
            ShimmerSensor::Eda => Sensors::GSR,
            ShimmerSensor::Ppg => Sensors::PPG,
            ShimmerSensor::AccelerationLowNoise => Sensors::ACCELERATION_LOW_NOISE,
            ShimmerSensor::AccelerationWideRange => Sensors::ACCELERATION_WIDE_RANGE,
            ShimmerSensor::Gyroscope => Sensors::GYROSCOPE,
            ShimmerSensor::Magnetometer => Sensors::MAGNETOMETER,
            ShimmerSensor::Battery => Sensors::BATTERY,
        }
    }
}

fn port() -> String {
    "/dev/rfcomm0".into()
}

fn sensors() -> Vec<ShimmerSensor> {
    vec![ShimmerSensor::Eda, ShimmerSensor::Ppg]
}

fn rate_hz() -> f64 {
    128.0
}

impl Component<dyn Source, SourceContext> for Shimmer3 {
    const EXAMPLE: &'static str = r#"person = "p001""#;

    fn build(self, context: &SourceContext) -> Result<Box<dyn Source>, SettingsError> {
        if !(LEAST_HZ..=MOST_HZ).contains(&self.rate_hz) {
            let message = format!("rate_hz is {}; expected {LEAST_HZ} to {MOST_HZ}", self.rate_hz);
            let hint = "128 is enough for skin conductance and PPG";
            return Err(SettingsError::new(message).at("rate_hz").with_hint(hint));
        }
        let bits = self.sensors.iter().map(|sensor| sensor.bits());
        let Some(sensors) = bits.reduce(|all, sensor| all | sensor) else {
            let error = SettingsError::new("no sensors are listed").at("sensors");
            return Err(error.with_hint("name some, such as [\"eda\", \"ppg\"]"));
        };
        let uses = &context.claims.uses;
        let worn = Worn::new(self.person, DEVICE)?;
        let names = worn.names(uses)?;
        let port = uses.begin(&*self.port).ok_or_else(|| {
            let error = SettingsError::new(format!("two sources read the port {}", self.port));
            error.at("port").with_hint("give each source the port of a different device")
        })?;
        let settings =
            ShimmerSettings { rate_hz: self.rate_hz, sensors, ..ShimmerSettings::default() };
        let session = ShimmerSession::new(settings);
        let conversation = Conversation { session, worn, clock: SessionTime::start() };
        Ok(Box::new(Shimmer { port: self.port, conversation, _uses: [names, port] }))
    }
}

/// A running Shimmer3.
struct Shimmer {
    port: String,
    conversation: Conversation<ShimmerSession>,
    _uses: [Use; 2],
}

#[async_trait]
impl Source for Shimmer {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let opening = timeout(PATIENCE, SerialPort::open(&self.port, BAUD));
        let opened = tokio::select! {
            opened = opening => opened,
            () = outlet.closed() => return Ok(()),
        };
        let opened = opened.map_err(|_elapsed| SourceError::Gone {
            message: format!("open {}: the device does not answer", self.port),
            hint: "is it switched on, paired and near?".into(),
        })?;
        let link = opened
            .map_err(|error| SourceError::Gone { message: error.to_string(), hint: error.hint })?;
        let held = self.conversation.hold(link, outlet).await;
        held.map_err(|error| at_port(error, &self.port))
    }
}

/// Returns the same error with the port.
fn at_port(error: SourceError, port: &str) -> SourceError {
    match error {
        SourceError::Gone { message, .. } => SourceError::Gone {
            message: format!("{message} (Shimmer3 at {port})"),
            hint: "is this the port of a Shimmer3 with LogAndStream, and is it switched on and in range?".into(),
        },
        fatal @ SourceError::Fatal { .. } => fatal,
    }
}
