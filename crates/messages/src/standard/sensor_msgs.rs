//! `sensor_msgs`: batteries, temperatures and images.

use super::message;
use super::std_msgs::Header;

/// The state of a battery; NaN where a quantity is not measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatteryState {
    /// When.
    pub header: Header,
    /// Voltage [V].
    pub voltage: f32,
    /// Temperature [°C].
    pub temperature: f32,
    /// Current [A], negative while discharging.
    pub current: f32,
    /// Charge that is left [Ah].
    pub charge: f32,
    /// Charge when last full [Ah].
    pub capacity: f32,
    /// Charge when new and full [Ah].
    pub design_capacity: f32,
    /// Charge that is left [0..1]; some drivers send percent.
    pub percentage: f32,
    /// One of the `STATUS_…` codes.
    pub power_supply_status: u8,
    /// One of the `HEALTH_…` codes.
    pub power_supply_health: u8,
    /// One of the `TECHNOLOGY_…` codes.
    pub power_supply_technology: u8,
    /// Whether there is a battery at all.
    pub present: bool,
    /// Voltage of each cell [V]; empty where not measured.
    pub cell_voltage: Vec<f32>,
    /// Temperature of each cell [°C]; empty where not measured.
    pub cell_temperature: Vec<f32>,
    /// Where it is plugged in.
    pub location: String,
    /// Its serial number.
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
    /// Not known whether it charges.
    pub const STATUS_UNKNOWN: u8 = 0;
    /// It is being charged.
    pub const STATUS_CHARGING: u8 = 1;
    /// It is being discharged.
    pub const STATUS_DISCHARGING: u8 = 2;
    /// It is on a charger that does not charge.
    pub const STATUS_NOT_CHARGING: u8 = 3;
    /// It is full.
    pub const STATUS_FULL: u8 = 4;
    /// Its health is not known.
    pub const HEALTH_UNKNOWN: u8 = 0;
    /// It is in good health.
    pub const HEALTH_GOOD: u8 = 1;
    /// Lithium ion.
    pub const TECHNOLOGY_LION: u8 = 2;
}

/// One temperature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Temperature {
    /// When, and where.
    pub header: Header,
    /// Temperature [°C].
    pub temperature: f64,
    /// Its variance [°C²]; 0 where unknown.
    pub variance: f64,
}

message!(Temperature { header, temperature, variance } = "sensor_msgs/msg/Temperature");

/// An uncompressed picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// When, and the camera's optical frame.
    pub header: Header,
    /// How many rows [px].
    pub height: u32,
    /// How many columns [px].
    pub width: u32,
    /// How pixels are coded: `rgb8`, `mono16`.
    pub encoding: String,
    /// 1 when wide pixels come with their highest byte first.
    pub is_bigendian: u8,
    /// The length of a row [bytes].
    pub step: u32,
    /// Row by row.
    pub data: Vec<u8>,
}

message!(
    Image { header, height, width, encoding, is_bigendian, step, data } = "sensor_msgs/msg/Image"
);
