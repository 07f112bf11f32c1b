//! Converts numbers from one unit to another.

use super::spelt;
use crate::stream::Signal;

/// The conversion of numbers from one unit to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    relation: Relation,
    /// The factor of the number, or of its reciprocal.
    factor: f64,
    /// The offset, which is added after multiplication.
    offset: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Relation {
    Same,
    Linear,
    /// A resistance to a conductance, or the reverse.
    Inverse,
}

/// A unit of a quantity: its spellings, other spellings that match in any letter case, its size in the smallest unit of
/// its quantity, and its zero in that unit.
struct Unit(&'static [&'static str], &'static [&'static str], f64, f64);

/// The only table of quantities with several units. Sizes are whole numbers where possible, so that 1 mV is exactly
/// 1000 uV.
const QUANTITIES: &[&[Unit]] =
    &[TIMES, CONDUCTANCES, RESISTANCES, VOLTAGES, WARMTHS, ACCELERATIONS];
/// The indices of conductances and resistances in [`QUANTITIES`].
const CONDUCTANCE: usize = 1;
const RESISTANCE: usize = 2;
const TIMES: &[Unit] = &[
    Unit(&["ns"], &["nsec", "nanosecond", "nanoseconds", "nanos"], 1.0, 0.0),
    Unit(&["us"], &["usec", "microsecond", "microseconds", "micros"], 1e3, 0.0),
    Unit(&["s/1024"], &["1/1024 s"], 976_562.5, 0.0),
    Unit(&["ms"], &["msec", "msecs", "millisecond", "milliseconds", "millis"], 1e6, 0.0),
    Unit(&["s"], &["sec", "secs", "second", "seconds"], 1e9, 0.0),
    Unit(&["min"], &["minute", "minutes"], 60e9, 0.0),
    Unit(&["h"], &["hour", "hours"], 3600e9, 0.0),
];
const CONDUCTANCES: &[Unit] = &[
    Unit(&["nS"], &["nsiemens", "nanosiemens"], 1.0, 0.0),
    Unit(&["uS"], &["usiemens", "microsiemens", "microsiemen", "umho"], 1e3, 0.0),
    Unit(&["mS"], &["millisiemens"], 1e6, 0.0),
    Unit(&["S"], &["siemens"], 1e9, 0.0),
];
const RESISTANCES: &[Unit] = &[
    Unit(&["ohm", "Ohm", "Ω"], &["ohms"], 1.0, 0.0),
    Unit(&["kohm", "kOhm", "kΩ"], &["kohms", "kiloohm", "kiloohms"], 1e3, 0.0),
    Unit(&["Mohm", "MOhm", "MOhms", "MΩ"], &["megaohm", "megaohms"], 1e6, 0.0),
];
/// The product of a resistance and its conductance, each in its smallest unit.
const NANOSIEMENS_OHM: f64 = 1e9;
const VOLTAGES: &[Unit] = &[
    Unit(&["nV"], &["nanovolt", "nanovolts"], 1.0, 0.0),
    Unit(&["uV"], &["uvolt", "uvolts", "microvolt", "microvolts"], 1e3, 0.0),
    Unit(&["mV"], &["mvolt", "mvolts", "millivolt", "millivolts"], 1e6, 0.0),
    Unit(&["V"], &["volt", "volts"], 1e9, 0.0),
];
const WARMTHS: &[Unit] = &[
    Unit(&["degC", "C"], &["celsius", "deg c", "degrees celsius", "degree celsius"], 1.0, 0.0),
    Unit(&["K"], &["kelvin"], 1.0, -273.15),
    Unit(
        &["degF", "F"],
        &["fahrenheit", "deg f", "degrees fahrenheit", "degree fahrenheit"],
        5.0 / 9.0,
        -160.0 / 9.0,
    ),
];
const ACCELERATIONS: &[Unit] = &[
    Unit(&["mg"], &["milli-g", "millig"], 1.0, 0.0),
    Unit(&["g/64"], &["1/64 g", "1/64g"], 15.625, 0.0),
    Unit(&["m/s^2"], &["m/s2", "m/(s^2)", "m/(s2)", "m/s/s", "ms^-2"], 1000.0 / 9.806_65, 0.0),
    Unit(&["g"], &["g-force", "gs"], 1e3, 0.0),
];

impl Conversion {
    /// Leaves numbers unchanged.
    pub const SAME: Conversion = Conversion { relation: Relation::Same, factor: 1.0, offset: 0.0 };

    /// The conversion to another unit of the same quantity, or from a resistance to a conductance and back; an
    /// undeclared (empty) unit counts as `to`. `None` if there is no conversion: volts to microsiemens, raw counts to
    /// any unit.
    pub fn between(from: &str, to: &str) -> Option<Conversion> {
        let (from, to) = (spelt(from.trim()), spelt(to));
        if from.is_empty() || from == to {
            return Some(Conversion::SAME);
        }
        let (from, to) = (found(&from)?, found(&to)?);
        if from == to {
            return Some(Conversion::SAME);
        }
        let unit = |(quantity, place): (usize, usize)| &QUANTITIES[quantity][place];
        let (from_unit, to_unit) = (unit(from), unit(to));
        if from.0 == to.0 {
            let offset = (from_unit.3 - to_unit.3) / to_unit.2;
            let factor = from_unit.2 / to_unit.2;
            return Some(Conversion { relation: Relation::Linear, factor, offset });
        }
        let is_inverse =
            matches!((from.0, to.0), (CONDUCTANCE, RESISTANCE) | (RESISTANCE, CONDUCTANCE));
        let factor = NANOSIEMENS_OHM / from_unit.2 / to_unit.2;
        is_inverse.then_some(Conversion { relation: Relation::Inverse, factor, offset: 0.0 })
    }

    /// The conversion to the unit in which a signal is analysed; if any unit will do, numbers are left unchanged.
    pub fn for_signal(signal: Signal, from: &str) -> Option<Conversion> {
        worked_in(signal).map_or(Some(Conversion::SAME), |to| Conversion::between(from, to))
    }

    /// Converts a number to the other unit.
    pub fn of(self, number: f64) -> f64 {
        match self.relation {
            Relation::Same => number,
            Relation::Linear => number * self.factor + self.offset,
            Relation::Inverse => self.factor / number,
        }
    }
}

/// The unit in which a signal is analysed and its results are stated; `None` if any unit will do, in which the results
/// are then stated, too.
pub fn worked_in(signal: Signal) -> Option<&'static str> {
    match signal {
        Signal::Eda => Some("uS"),
        Signal::Eeg => Some("uV"),
        Signal::Temperature => Some("degC"),
        Signal::Acceleration => Some("g"),
        Signal::Interval => Some("ms"),
        _ => None,
    }
}

/// The units of the same quantity, and those that can be converted to it.
pub fn accepted(unit: &str) -> Vec<&'static str> {
    let Some((quantity, _)) = found(&spelt(unit)) else { return Vec::new() };
    let inverse = if quantity == CONDUCTANCE { RESISTANCES } else { &[] };
    QUANTITIES[quantity].iter().chain(inverse).map(|unit| unit.0[0]).collect()
}

/// The index of a unit's quantity in [`QUANTITIES`], and of the unit within it.
fn found(unit: &str) -> Option<(usize, usize)> {
    let lower = unit.to_lowercase();
    let place = |is_meant: &dyn Fn(&Unit) -> bool| {
        QUANTITIES
            .iter()
            .enumerate()
            .find_map(|(quantity, units)| Some((quantity, units.iter().position(is_meant)?)))
    };
    place(&|each| each.0.contains(&unit))
        .or_else(|| place(&|each| each.1.iter().any(|name| name.to_lowercase() == lower)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reported(number: f64, from: &str, to: &str) -> Option<f64> {
        Conversion::between(from, to).map(|conversion| conversion.of(number))
    }

    #[test]
    fn numbers_are_converted_without_losing_a_bit() {
        let alike = [
            (0.8, "s", "ms", 800.0),
            (853.0, "s/1024", "ms", 853.0 * 1000.0 / 1024.0),
            (800_000.0, "microseconds", "ms", 800.0),
            (0.000_012, "V", "µV", 12.0),
            (250.0, "nS", "uS", 0.25),
            (400.0, "kOhms", "µS", 2.5),
            (2.5, "uS", "kohm", 400.0),
            (306.15, "K", "degC", 33.0),
            (91.4, "Degrees Fahrenheit", "°C", 33.0),
            (64.0, "1/64 g", "g", 1.0),
            (1000.0, "mg", "g", 1.0),
            (9.806_65, "m/(s^2)", "g", 1.0),
        ];
        for (number, from, to, expected) in alike {
            let number = reported(number, from, to).unwrap();
            assert!((number - expected).abs() < 1e-12 * expected, "{from} to {to}: {number}");
        }
    }

    #[test]
    fn numbers_in_the_same_or_an_undeclared_unit_stay_bit_for_bit() {
        for unit in ["", " ", "ms", "milliseconds"] {
            assert_eq!(reported(0.1 + 0.2, unit, "ms"), Some(0.1 + 0.2), "{unit}");
        }
    }

    #[test]
    fn units_of_different_quantities_are_refused() {
        for (from, to) in [("1", "uS"), ("counts", "uS"), ("mV", "uS"), ("1/min", "ms"), ("S", "s")]
        {
            assert_eq!(Conversion::between(from, to), None, "{from} to {to}");
        }
        assert_eq!(Conversion::for_signal(Signal::Ecg, "counts"), Some(Conversion::SAME));
    }

    #[test]
    fn each_name_of_a_unit_means_one() {
        let names: Vec<&str> = QUANTITIES
            .iter()
            .flat_map(|of| of.iter().flat_map(|unit| unit.0.iter().chain(unit.1).copied()))
            .collect();
        for (place, name) in names.iter().enumerate() {
            assert!(!names[..place].contains(name), "{name}");
        }
    }
}
