/// The resistor that measures skin resistance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum GsrRange {
    /// 40.2 kΩ, for skin of 8 to 63 kΩ.
    Ohm40k = 0,
    /// 287 kΩ, for skin of 63 to 220 kΩ.
    Ohm287k = 1,
    /// 1 MΩ, for skin of 220 to 680 kΩ.
    Ohm1M = 2,
    /// 3.3 MΩ, for skin of 680 to 4700 kΩ.
    Ohm3M3 = 3,
    /// The device switches automatically.
    #[default]
    Automatic = 4,
}

impl GsrRange {
    /// The smallest and largest resistance that can be measured \[kΩ\].
    const fn limits_kohm(self) -> (f64, f64) {
        match self {
            Self::Ohm40k => (8.0, 63.0),
            Self::Ohm287k => (63.0, 220.0),
            Self::Ohm1M => (220.0, 680.0),
            Self::Ohm3M3 => (680.0, 4700.0),
            Self::Automatic => (8.0, f64::INFINITY),
        }
    }
}

const RESISTORS_KOHM: [f64; 4] = [40.2, 287.0, 1000.0, 3300.0];

/// The ADC value below which the amplifier indicates that no current flows: 0.5 V of 3 V.
const OPEN_CIRCUIT: u16 = 683;

/// A value of the skin conductance channel, by the amplifier's equation: R = Rf / (V / 0.5 V − 1).
///
/// The vendor's older straight-line fit, which `BrainFlow` uses, differs by up to 3 %.
///
/// ```
/// use teampulse_devices::shimmer3::{Gsr, GsrRange};
///
/// let gsr = Gsr { raw: 2 << 14 | 1500 };
/// assert_eq!(gsr.resistor(), 2);
/// assert!((gsr.resistance_kohm(GsrRange::Automatic) - 834.86).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gsr {
    /// The value as sent: the active resistor in bits 14 and 15, the ADC in bits 0 to 11.
    pub raw: u16,
}

impl Gsr {
    /// The number of the active resistor, 0 to 3.
    pub const fn resistor(self) -> u8 {
        (self.raw >> 14) as u8
    }

    /// The skin's resistance \[kΩ\], limited to what the range can measure.
    pub fn resistance_kohm(self, range: GsrRange) -> f64 {
        let adc = (self.raw & 0x0fff).max(OPEN_CIRCUIT);
        let volts = f64::from(adc) * 3.0 / 4095.0;
        let resistor = RESISTORS_KOHM.get(usize::from(self.resistor())).copied();
        let resistance = resistor.unwrap_or(f64::NAN) / (volts / 0.5 - 1.0);
        let (least, most) = range.limits_kohm();
        resistance.clamp(least, most)
    }

    /// The skin conductance \[µS\].
    pub fn conductance_us(self, range: GsrRange) -> f64 {
        1000.0 / self.resistance_kohm(range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thresholds of the firmware: at a switch both resistors measure nearly the same skin.
    #[test]
    fn the_range_switches_by_itself_and_the_resistance_goes_on() {
        for (low, at_low, high, at_high) in
            [(0, 1120, 1, 3960), (1, 1490, 2, 3700), (2, 1630, 3, 3930)]
        {
            let of = |resistor: u16, adc| Gsr { raw: resistor << 14 | adc };
            let before = of(low, at_low).resistance_kohm(GsrRange::Automatic);
            let after = of(high, at_high).resistance_kohm(GsrRange::Automatic);
            assert!((before / after - 1.0).abs() < 0.5, "{before} {after}");
        }
    }

    #[test]
    fn no_current_is_no_infinity() {
        for raw in 0..=u16::MAX {
            let conductance = Gsr { raw }.conductance_us(GsrRange::Automatic);
            assert!(conductance > 0.0 && conductance <= 125.0);
        }
    }

    #[test]
    fn a_fixed_range_ends_where_it_can_measure_no_more() {
        let open = Gsr { raw: 3 << 14 | 0x258 }.resistance_kohm(GsrRange::Ohm3M3);
        let low = Gsr { raw: 0x0fff }.resistance_kohm(GsrRange::Ohm40k);
        assert!((open - 4700.0).abs() < 1e-9 && (low - 8.04).abs() < 1e-9);
    }
}
