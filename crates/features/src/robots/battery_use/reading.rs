//! The reading of a battery at one time.

use std::ops::RangeInclusive;

use teampulse_core::stream::Stream;

/// A quantity that a battery may report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Voltage,
    Current,
    /// The remaining fraction of charge, as given by the driver: 0–1 or 0–100.
    Fraction,
    Charge,
    Capacity,
    Energy,
    Power,
    /// `power_supply_status` of `sensor_msgs/msg/BatteryState`.
    Status,
}

/// The reading of a battery at one time; NaN for missing and implausible quantities.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading([f64; Quantity::ALL.len()]);

/// The channel of each quantity in a stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    channels: [Option<usize>; Quantity::ALL.len()],
}

impl Quantity {
    const ALL: [Quantity; 8] = [
        Quantity::Voltage,
        Quantity::Current,
        Quantity::Fraction,
        Quantity::Charge,
        Quantity::Capacity,
        Quantity::Energy,
        Quantity::Power,
        Quantity::Status,
    ];

    /// The quantity of a channel: by its unit, and by its name where units are shared.
    fn of(channel: &str, unit: &str) -> Option<Quantity> {
        let field = channel.rsplit('.').next().unwrap_or(channel);
        match (field, unit) {
            ("power_supply_status", _) => Some(Quantity::Status),
            ("capacity", "Ah") => Some(Quantity::Capacity),
            (_, "Ah") => Some(Quantity::Charge),
            (_, "V") => Some(Quantity::Voltage),
            (_, "A") => Some(Quantity::Current),
            (_, "J") => Some(Quantity::Energy),
            (_, "W") => Some(Quantity::Power),
            (_, "1" | "%") => Some(Quantity::Fraction),
            _ => None,
        }
    }

    /// The plausible range for any battery of a robot: up to 2 kV, 10 kA, 100 kAh.
    fn plausible(self) -> RangeInclusive<f64> {
        match self {
            Quantity::Voltage => 1e-3..=2e3,
            Quantity::Current => -1e4..=1e4,
            Quantity::Fraction => -0.01..=105.0,
            Quantity::Charge => 0.0..=1e5,
            Quantity::Capacity => 1e-6..=1e5,
            Quantity::Energy => 0.0..=1e12,
            Quantity::Power => -2e7..=2e7,
            Quantity::Status => 0.0..=4.0,
        }
    }
}

impl Reading {
    /// The number of a quantity; NaN where there is none.
    pub(super) fn get(&self, quantity: Quantity) -> f64 {
        self.0[quantity as usize]
    }
}

impl Layout {
    /// The layout of a stream; the first channel with a quantity is used.
    pub(super) fn of(stream: &Stream) -> Layout {
        let mut layout = Layout::default();
        for (index, channel) in stream.channels.iter().enumerate() {
            if let Some(quantity) = Quantity::of(&channel.name, &channel.unit) {
                layout.channels[quantity as usize].get_or_insert(index);
            }
        }
        layout
    }

    /// Whether the use of the battery can be computed from these channels.
    pub(super) fn shows_use(&self) -> bool {
        let has = |quantity: Quantity| self.channels[quantity as usize].is_some();
        let alone = [Quantity::Fraction, Quantity::Charge, Quantity::Energy, Quantity::Power];
        alone.into_iter().any(has) || (has(Quantity::Voltage) && has(Quantity::Current))
    }

    /// The reading in a sample's numbers.
    pub(super) fn reading(&self, numbers: &[f64]) -> Reading {
        Reading(Quantity::ALL.map(|quantity| {
            let number = self.channels[quantity as usize].and_then(|index| numbers.get(index));
            let plausible = number.filter(|number| quantity.plausible().contains(number));
            plausible.copied().unwrap_or(f64::NAN)
        }))
    }
}
