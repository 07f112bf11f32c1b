//! The units of a table's columns.

use teampulse_core::units::{self, Conversion};

use super::columns::Wanted;
use super::head::Head;

/// Spellings of raw counts of a converter.
const RAW: [&str; 9] =
    ["counts", "count", "adc", "raw", "lsb", "digits", "no_units", "adu", "codes"];

/// Returns the unit of a column: below its name, in brackets after it, or at its end; in a file of an E4, the file's
/// fixed unit. `None` if the table states no unit.
pub fn unit(head: &Head, place: usize, wanted: &Wanted) -> Option<String> {
    if head.is_e4 {
        let units =
            [("acceleration", "g/64"), ("eda", "uS"), ("temperature", "degC"), ("interval", "s")];
        return units.iter().find(|each| each.0 == wanted.signal).map(|each| each.1.to_owned());
    }
    let below = head.units.get(place).map(String::as_str);
    let name = head.names.get(place)?;
    below.into_iter().chain(in_brackets(name)).map(mended).find(|unit| is_unit(unit)).or_else(
        || match wanted.unit {
            Some(to) => of_ending(name, to),
            None => of_voltage(name).filter(|_| ["ecg", "emg"].contains(&wanted.signal)),
        },
    )
}

/// Returns the text in the last brackets of a name.
pub fn in_brackets(name: &str) -> Option<&str> {
    let end = name.rfind([']', ')'])?;
    let open = if name[end..].starts_with(']') { '[' } else { '(' };
    // `m/(s^2)` itself contains brackets.
    let begin = name.find(open)?;
    (begin < end).then(|| name[begin + 1..end].trim())
}

/// Returns the unit at the end of a name if it can be converted to the wanted unit: `temp_celsius`, `eda_usiemens`,
/// `rr_ms`.
fn of_ending(name: &str, to: &str) -> Option<String> {
    let ending = name.rsplit('_').next().filter(|ending| ending.len() < name.len())?;
    let upper = ending.to_uppercase();
    let micro = (to == "uS" && upper == "US").then_some("uS");
    let units = micro.into_iter().chain([ending, &upper]);
    let mut units = units.filter(|unit| Conversion::between(unit, to).is_some());
    units.next().map(str::to_owned)
}

/// Returns the unit of a voltage at the end of a name, in upper or lower case: `ecg_mV`. A single `V` may name a lead.
fn of_voltage(name: &str) -> Option<String> {
    let (_, ending) = name.rsplit_once('_')?;
    let unit = ["nV", "uV", "mV"].into_iter().find(|unit| ending.eq_ignore_ascii_case(unit));
    unit.map(str::to_owned)
}

/// Returns a name without the unit in brackets at its end.
pub fn without_unit(name: &str) -> &str {
    let unit = in_brackets(name).filter(|unit| is_unit(&mended(unit)));
    let open = unit.and_then(|_| name.rfind(['[', '(']));
    match open.map(|open| name[..open].trim_end()) {
        Some(plain) if !plain.is_empty() && name.ends_with([']', ')']) => plain,
        _ => name,
    }
}

/// Windows programs write the micro and degree signs in bytes that are not UTF-8.
fn mended(unit: &str) -> String {
    let unit = unit.trim();
    match unit.strip_prefix('\u{fffd}') {
        Some(degree @ ("C" | "F")) => format!("deg{degree}"),
        Some(of_micro) => format!("u{of_micro}"),
        None => unit.to_owned(),
    }
}

/// Whether this is a unit that can be stored or converted, or raw counts.
pub fn is_unit(unit: &str) -> bool {
    !unit.is_empty()
        && (is_raw(unit)
            || units::is_known(&units::spelt(unit))
            || !units::accepted(unit).is_empty())
}

/// Whether numbers of this unit are raw counts of a converter.
pub fn is_raw(unit: &str) -> bool {
    RAW.contains(&unit.to_ascii_lowercase().as_str())
}

/// Narrows several columns down to those with a unit other than raw counts, then to those whose unit can be converted
/// to the wanted one, to those in that unit, and to calibrated ones; a rule that no column meets is skipped.
pub fn narrowed(head: &Head, places: Vec<usize>, wanted: &Wanted) -> Vec<usize> {
    let unit = |place: usize| unit(head, place, wanted);
    let is_named = |place: usize| unit(place).is_some_and(|unit| !is_raw(&unit));
    let fits = |place: usize| {
        unit(place).is_some_and(|unit| {
            wanted.unit.is_some_and(|to| Conversion::between(&unit, to).is_some())
        })
    };
    let is_same = |place: usize| {
        unit(place).is_some_and(|unit| {
            wanted.unit.is_some_and(|to| Conversion::between(&unit, to) == Some(Conversion::SAME))
        })
    };
    let is_calibrated = |place: usize| !head.name(place).to_ascii_uppercase().ends_with("_RAW");
    let rules: [&dyn Fn(usize) -> bool; 4] = [&is_named, &fits, &is_same, &is_calibrated];
    rules.iter().fold(places, |places, rule| {
        let left: Vec<usize> = places.iter().copied().filter(|place| rule(*place)).collect();
        if left.is_empty() { places } else { left }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_in_brackets_or_at_the_end_of_a_name() {
        for (name, unit) in [
            ("ecg [uV]", Some("uV")),
            ("Temp (°C)", Some("°C")),
            ("Accel (m/(s^2))", Some("m/(s^2)")),
            ("x", None),
            ("a ] b [", None),
        ] {
            assert_eq!(in_brackets(name), unit, "{name}");
        }
        assert_eq!(of_ending("eda_scl_usiemens", "uS").as_deref(), Some("usiemens"));
        assert_eq!(of_ending("eda_us", "uS").as_deref(), Some("uS"));
        assert_eq!(of_ending("temp_f", "degC").as_deref(), Some("F"));
        assert_eq!(of_ending("rr_ms", "ms").as_deref(), Some("ms"));
        assert_eq!(of_ending("skin_left", "uS"), None);
        assert_eq!(of_ending("ms", "ms"), None);
    }

    #[test]
    fn the_unit_of_a_voltage_may_end_its_name() {
        let of = |name| of_voltage(name);
        assert_eq!(of("ecg_mV").as_deref(), Some("mV"));
        assert_eq!(of("emg_left_uv").as_deref(), Some("uV"));
        assert_eq!((of("lead_V"), of("mV"), of("ecg_filtered")), (None, None, None));
    }

    #[test]
    fn a_name_is_known_without_its_unit() {
        for (name, plain) in [
            ("x [g]", "x"),
            ("Accel_X (m/s^2)", "Accel_X"),
            ("emg (left)", "emg (left)"),
            ("[g]", "[g]"),
            ("x", "x"),
        ] {
            assert_eq!(without_unit(name), plain, "{name}");
        }
    }

    #[test]
    fn letters_in_windows_encoding_are_repaired() {
        assert_eq!(["\u{fffd}S", "\u{fffd}C", "mV"].map(mended), ["uS", "degC", "mV"]);
    }
}
