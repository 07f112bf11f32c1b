//! Dates in the headers of files.

use crate::recording::nanos;

/// The date that a file states, for times that do not count from 1970.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatedDate {
    /// The date of time zero [ns since 1970]; in local time if no zone is stated.
    pub zero_ns: i64,
    /// Whether the time zone is stated.
    pub has_zone: bool,
}

const SECS_PER_DAY: i64 = 86_400;

impl StatedDate {
    /// Parses the date and the time of day in an EDF header: `05.01.26` and `10.15.00`. `None` for anything else, and
    /// for 1 January 1985, which stands for an unknown date.
    pub(crate) fn of_edf(date: &str, time: &str) -> Option<StatedDate> {
        let [day, month, year] = numbers(date)?;
        let [hour, minute, second] = numbers(time)?;
        let year = if year < 85 { 2000 + year } else { 1900 + year };
        if (year, month, day) == (1985, 1, 1) || year > 2084 {
            return None;
        }
        let secs = days(year, month, day)? * SECS_PER_DAY + of_day(hour, minute, second)?;
        Some(StatedDate { zero_ns: nanos(secs as f64)?, has_zone: false })
    }

    /// Parses an ISO 8601 date, as in the header of an XDF file: `2026-01-05T10:15:00+0100`.
    pub(crate) fn of_iso(text: &str) -> Option<StatedDate> {
        let (date, rest) = text.trim().split_once(['T', ' '])?;
        let [year, month, day] = numbers(date)?;
        let (time, zone) = match rest.find(['+', '-', 'Z']) {
            Some(at) => (&rest[..at], Some(east_secs(&rest[at..])?)),
            None => (rest, None),
        };
        let (time, fraction) = time.split_once('.').unwrap_or((time, "0"));
        let [hour, minute, second] = numbers(time)?;
        let fraction: f64 = format!("0.{fraction}").parse().ok()?;
        let secs = days(year, month, day)? * SECS_PER_DAY + of_day(hour, minute, second)?;
        let zero_ns = nanos((secs - zone.unwrap_or(0)) as f64)?.checked_add(nanos(fraction)?)?;
        Some(StatedDate { zero_ns, has_zone: zone.is_some() })
    }
}

/// Three numbers, separated by punctuation.
fn numbers(text: &str) -> Option<[i64; 3]> {
    let number = |text: &str| text.parse::<u16>().ok().map(i64::from);
    let numbers: Option<Vec<i64>> = text.split(['.', ':', '-', '/']).map(number).collect();
    numbers?.try_into().ok()
}

/// How far east of UTC a zone is [s]: `Z`, `+01:00` or `+0100`.
fn east_secs(zone: &str) -> Option<i64> {
    let digits: String = zone.chars().filter(char::is_ascii_digit).collect();
    if zone == "Z" {
        return Some(0);
    }
    let number: i64 = digits.parse().ok().filter(|_| digits.len() == 4)?;
    let secs = of_day(number / 100, number % 100, 0)?;
    Some(if zone.starts_with('-') { -secs } else { secs })
}

fn of_day(hour: i64, minute: i64, second: i64) -> Option<i64> {
    let is_time = hour < 24 && minute < 60 && second <= 60;
    is_time.then_some((hour * 60 + minute) * 60 + second)
}

/// The number of days since 1970; `None` if the calendar has no such day. Hinnant,
/// `chrono-Compatible Low-Level Date Algorithms`.
fn days(year: i64, month: i64, day: i64) -> Option<i64> {
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let length = match month {
        2 => 28 + i64::from(is_leap),
        4 | 6 | 9 | 11 => 30,
        1..=12 => 31,
        _ => return None,
    };
    if !(1..=length).contains(&day) || !(1900..=2200).contains(&year) {
        return None;
    }
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let of_year = (153 * month + 2) / 5 + day - 1;
    Some(365 * year + year / 4 - year / 100 + year / 400 + of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;
    /// 2026-01-05T10:15:00Z.
    const AT: i64 = 1_767_608_100 * SEC;

    #[test]
    fn an_edf_has_a_date_without_a_zone() {
        let of = |date, time| StatedDate::of_edf(date, time).map(|date| date.zero_ns);
        assert_eq!(of("05.01.26", "10.15.00"), Some(AT));
        assert_eq!(of("29.02.96", "00.00.01"), Some(825_552_001 * SEC));
        for (date, time) in [
            ("01.01.85", "00.00.00"),
            ("99.99.99", "10.15.00"),
            ("29.02.26", "10.15.00"),
            ("05.01.26", "24.00.00"),
            ("", ""),
            ("X.X.X", "10.15.00"),
        ] {
            assert_eq!(of(date, time), None, "{date} {time}");
        }
    }

    #[test]
    fn a_date_of_iso_8601_may_have_a_zone() {
        for (text, zero_ns, has_zone) in [
            ("2026-01-05T10:15:00+0000", AT, true),
            ("2026-01-05T10:15:00.5Z", AT + SEC / 2, true),
            ("2026-01-05T11:15:00+01:00", AT, true),
            ("2026-01-05T05:15:00-0500", AT, true),
            ("2026-01-05 10:15:00", AT, false),
        ] {
            assert_eq!(StatedDate::of_iso(text), Some(StatedDate { zero_ns, has_zone }), "{text}");
        }
        for text in ["", "now", "2026-13-05T10:15:00", "2026-01-05", "2026-01-05T10:15:00+é"] {
            assert_eq!(StatedDate::of_iso(text), None, "{text}");
        }
    }
}
