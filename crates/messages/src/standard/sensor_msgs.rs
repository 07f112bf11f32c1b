//! `sensor_msgs`: batteries, temperatures and images.

use super::message;
use super::std_msgs::Header;

/// The state of a battery; NaN for quantities that are not measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatteryState {
    /// The time of measurement.
    pub header: Header,
    /// Voltage [V].
    pub voltage: f32,
    /// Temperature [°C].
    pub temperature: f32,
    /// Current [A], negative while discharging.
    pub current: f32,
    /// The remaining charge [Ah].
    pub charge: f32,
    /// The charge when last full [Ah].
    pub capacity: f32,
    /// The charge when new and full [Ah].
    pub design_capacity: f32,
    /// The state of charge [0..1]; some drivers send percent.
    pub percentage: f32,
    /// One of the `STATUS_…` codes.
    pub power_supply_status: u8,
    /// One of the `HEALTH_…` codes.
    pub power_supply_health: u8,
    /// One of the `TECHNOLOGY_…` codes.
    pub power_supply_technology: u8,
    /// Whether a battery is present.
    pub present: bool,
    /// Voltage of each cell [V]; empty where not measured.
    pub cell_voltage: Vec<f32>,
    /// Temperature of each cell [°C]; empty where not measured.
    pub cell_temperature: Vec<f32>,
    /// The location or slot of the battery.
    pub location: String,
    /// The serial number of the battery.
    pub serial_number: String,
}

message!(
    BatteryState {
        header,
        voltage,
        temperature,
        current,
        charge,
        capacity,
        design_capacity,
        percentage,
        power_supply_status,
        power_supply_health,
        power_supply_technology,
        present,
        cell_voltage,
        cell_temperature,
        location,
        serial_number,
    } = "sensor_msgs/msg/BatteryState"
);

impl BatteryState {
    /// The charging state is unknown.
    pub const STATUS_UNKNOWN: u8 = 0;
    /// The battery is charging.
    pub const STATUS_CHARGING: u8 = 1;
    /// The battery is discharging.
    pub const STATUS_DISCHARGING: u8 = 2;
    /// The battery is on a charger but not charging.
    pub const STATUS_NOT_CHARGING: u8 = 3;
    /// The battery is full.
    pub const STATUS_FULL: u8 = 4;
    /// The health is unknown.
    pub const HEALTH_UNKNOWN: u8 = 0;
    /// The health is good.
    pub const HEALTH_GOOD: u8 = 1;
    /// Lithium ion.
    pub const TECHNOLOGY_LION: u8 = 2;
}

/// A temperature measurement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Temperature {
    /// The time and the location of the measurement.
    pub header: Header,
    /// Temperature [°C].
    pub temperature: f64,
    /// The variance [°C²]; 0 if unknown.
    pub variance: f64,
}

message!(Temperature { header, temperature, variance } = "sensor_msgs/msg/Temperature");

/// An uncompressed image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// The time, and the camera's optical frame.
    pub header: Header,
    /// The number of rows [px].
    pub height: u32,
    /// The number of columns [px].
    pub width: u32,
    /// The pixel encoding: `rgb8`, `mono16`.
    pub encoding: String,
    /// 1 if multi-byte pixels are in big-endian byte order.
    pub is_bigendian: u8,
    /// The length of a row [bytes].
    pub step: u32,
    /// The pixels, row by row.
    pub data: Vec<u8>,
}

message!(
    Image { header, height, width, encoding, is_bigendian, step, data } = "sensor_msgs/msg/Image"
);
