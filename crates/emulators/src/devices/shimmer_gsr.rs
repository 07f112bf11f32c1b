//! The skin conductance amplifier of a Shimmer3 GSR+.

/// The resistors of the amplifier \[kΩ\].
const RESISTORS_KOHM: [f64; 4] = [40.2, 287.0, 1000.0, 3300.0];
/// The values below which the automatic range switches to the next larger resistor, and above which to the next smaller
/// one \[ADC\] (the firmware's `GSR` module).
const SWITCH_UP_BELOW: [u16; 4] = [1120, 1490, 1630, 0];
const SWITCH_DOWN_ABOVE: [u16; 4] = [u16::MAX, 3960, 3700, 3930];
/// The time after a switch for which the firmware repeats the last value, while the amplifier settles \[ticks\].
const SETTLING_TICKS: u64 = 2621;
const AUTOMATIC: u8 = 4;

/// The amplifier with its active resistor.
#[derive(Debug, Default)]
pub(super) struct Amplifier {
    resistor: usize,
    /// When the amplifier has settled after the last switch \[ticks\].
    settled_ticks: u64,
    /// The last value that was measured.
    last: u16,
}

impl Amplifier {
    /// Returns the value sent for a skin conductance \[µS\] at a time \[ticks\]: the active resistor in bits 14 and 15,
    /// the ADC value below.
    pub fn value(&mut self, us: f64, range: u8, now_ticks: u64) -> u16 {
        if range < AUTOMATIC {
            self.resistor = usize::from(range);
            self.settled_ticks = 0;
        }
        if now_ticks < self.settled_ticks {
            return self.last;
        }
        let value = adc(us, self.resistor);
        self.last = (self.resistor as u16) << 14 | value;
        if range >= AUTOMATIC {
            self.switch(value, now_ticks);
        }
        self.last
    }

    /// Chooses the resistor for the next measurement.
    fn switch(&mut self, value: u16, now_ticks: u64) {
        let before = self.resistor;
        if value < SWITCH_UP_BELOW[self.resistor] {
            self.resistor += 1;
        } else if value > SWITCH_DOWN_ABOVE[self.resistor] {
            self.resistor -= 1;
        }
        if self.resistor != before {
            self.settled_ticks = now_ticks + SETTLING_TICKS;
        }
    }
}

/// Returns the amplifier's voltage as the ADC reads it.
fn adc(us: f64, resistor: usize) -> u16 {
    let skin_kohm = 1000.0 / us;
    let volts = 0.5 * (1.0 + RESISTORS_KOHM[resistor] / skin_kohm);
    (volts * 4095.0 / 3.0).round().clamp(0.0, 4095.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packets are 256 ticks apart.
    fn course(values_us: &[f64]) -> Vec<u16> {
        let mut amplifier = Amplifier::default();
        let value = |(number, us): (u64, &f64)| amplifier.value(*us, AUTOMATIC, number * 256);
        (0..).zip(values_us).map(value).collect()
    }

    #[test]
    fn a_switch_repeats_the_last_value_for_eighty_milliseconds() {
        let falling: Vec<f64> = (0..200).map(|number| 20.0 - 0.05 * f64::from(number)).collect();
        let values = course(&falling);
        let resistors: Vec<u16> = values.iter().map(|value| value >> 14).collect();
        let switch = resistors.iter().position(|resistor| *resistor == 1).expect("it switches");
        let repeated =
            values[..switch].iter().rev().take_while(|value| **value == values[switch - 1]);
        assert_eq!(repeated.count(), 1 + 10); // 2621 ticks are ten packets and a part
        assert!(resistors[switch..].iter().all(|resistor| *resistor == 1));
    }

    #[test]
    fn near_a_threshold_it_does_not_switch_back_and_forth() {
        let wobbling: Vec<f64> = (0..400).map(|number| 16.0 + f64::from(number % 2)).collect();
        let values = course(&wobbling);
        let switches = values.windows(2).filter(|pair| pair[0] >> 14 != pair[1] >> 14).count();
        assert!(switches <= 1, "{switches}");
    }
}
