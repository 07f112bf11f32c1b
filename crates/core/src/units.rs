//! The spellings of units, machine-readable and for display, and conversions between units.

mod conversion;

pub use conversion::{Conversion, accepted, worked_in};

/// The only table of spellings: machine-readable (ASCII, in messages, bags, tables and JSON, as in most ROS drivers and
/// BIDS), for display, and synonyms.
const SPELLINGS: &[(&str, &str, &[&str])] = &[
    ("degC", "°C", &["℃"]),
    ("deg", "°", &[]),
    ("^2", "²", &[]),
    ("^3", "³", &[]),
    ("1/min", "1/min", &["bpm"]),
    (" ", "·", &["⋅"]),
    ("u", "µ", &["μ"]),
];
/// The only table of units: all units of our own streams, in their machine-readable spelling. Each unit is also known
/// per second (`V/s`).
pub const UNITS: &[&str] = &[
    "1", "%", "%/min", "s", "ms", "ms^2", "ln(ms)", "ln(ms^2)", "1/min", "Hz", "Hz/min", "uS",
    "uS^2", "uS/min", "uS s", "mV", "uV", "uV^2", "uV s", "degC", "degC/min", "g", "g s/min",
    "deg", "m", "m/s", "m/s^2", "rad/s", "V", "A", "Ah", "W", "J", "dB", "dBm", "dB/oct",
    "semitone", "Mb/s",
];

/// Whether a unit is in the table.
pub fn is_known(unit: &str) -> bool {
    UNITS.contains(&unit) || unit.strip_suffix("/s").is_some_and(|of| UNITS.contains(&of))
}

/// Units that may follow a `u` for micro; the arbitrary unit `u` stands alone.
const OF_MICRO: &[&str] = &["A", "S", "V", "W", "g", "m", "s"];

/// The machine-readable spelling of a unit: `uS`, `degC`, `m/s^2`, `1/min`.
pub fn spelt(unit: &str) -> String {
    SPELLINGS.iter().fold(unit.to_owned(), |unit, (machine, shown, others)| {
        let alike = others.iter().chain([shown]);
        alike.fold(unit, |unit, other| unit.replace(other, machine))
    })
}

/// The spelling of a unit for display: `µS`, `°C`, `m/s²`; empty for a number without a unit.
pub fn shown(unit: &str) -> String {
    let unit = spelt(unit);
    if unit == "1" {
        return String::new();
    }
    let mut shown = String::new();
    let is_end = |each: char| !each.is_alphabetic();
    for part in unit.split_inclusive(is_end) {
        let word = part.trim_end_matches(is_end);
        let of_micro = word.strip_prefix('u').filter(|of| OF_MICRO.contains(of));
        match of_micro {
            Some(of) => shown.extend(["µ", of]),
            None => shown.push_str(word),
        }
        shown.push_str(&part[word.len()..]);
    }
    let plain = SPELLINGS.iter().filter(|(machine, ..)| *machine != "u");
    plain.fold(shown, |shown, (machine, people, _)| shown.replace(machine, people))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_unit_has_one_spelling_for_machines_and_one_for_people() {
        let alike = [
            (&["µS", "μS", "uS"][..], "uS", "µS"),
            (&["°C", "degC"], "degC", "°C"),
            (&["µV²", "uV^2", "uV²"], "uV^2", "µV²"),
            (&["bpm", "1/min"], "1/min", "1/min"),
            (&["m/s²", "m/s^2"], "m/s^2", "m/s²"),
            (&["µS·s", "uS s"], "uS s", "µS·s"),
            (&["g·s/min"], "g s/min", "g·s/min"),
            (&["°C/min"], "degC/min", "°C/min"),
            (&["°"], "deg", "°"),
            (&["u²"], "u^2", "u²"),
            (&["ln(ms²)", "ln(ms^2)"], "ln(ms^2)", "ln(ms²)"),
            (&["1"], "1", ""),
        ];
        for (units, machine, people) in alike {
            for unit in units {
                assert_eq!(
                    (spelt(unit).as_str(), shown(unit).as_str()),
                    (machine, people),
                    "{unit}"
                );
            }
        }
    }

    #[test]
    fn for_machines_a_unit_is_spelt_in_ascii_and_stays_so() {
        for unit in ["µS·s", "°C/min", "µV²", "m/s²", "Ah", "%", "bpm", ""] {
            let once = spelt(unit);
            assert!(once.is_ascii() && spelt(&once) == once, "{unit}: {once}");
        }
    }
}
