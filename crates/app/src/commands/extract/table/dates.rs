//! Dates and times of day, as written in tables.

const SEC_NS: i64 = 1_000_000_000;
pub const DAY_NS: i64 = 86_400 * SEC_NS;

/// The part that a date starts with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Year,
    Day,
    Month,
}

/// Reads a cell that holds a date and a time of day [ns since 1970]: ISO 8601, or a local form of it with points,
/// slashes or dashes, seconds with decimals after a point, a comma or a colon, AM or PM, and a zone. Without a zone,
/// UTC is assumed. Returns `None` for anything else.
pub fn date_ns(cell: &str, order: Order) -> Option<i64> {
    let (date, rest) = split_date(cell)?;
    let (clock, east_ns) = split_zone(rest)?;
    let at_ns = days(date, order)?.checked_mul(DAY_NS)?.checked_add(time_of_day_ns(clock)?)?;
    at_ns.checked_sub(east_ns)
}

/// Whether a cell holds a date, in any order of its parts, and a time of day.
pub fn is_date(cell: &str) -> bool {
    [Order::Year, Order::Day, Order::Month].iter().any(|order| date_ns(cell, *order).is_some())
}

/// Whether a cell states its time zone.
pub fn has_zone(cell: &str) -> bool {
    let zone =
        split_date(cell).and_then(|(_, rest)| Some(split_zone(rest)?.0.len() < rest.trim().len()));
    zone.unwrap_or(false)
}

/// Reads a cell that holds only a time of day [ns since midnight].
pub fn time_of_day_ns(cell: &str) -> Option<i64> {
    let cell = cell.trim();
    let lower = cell.to_ascii_lowercase();
    let half = [("am", 0), ("a.m.", 0), ("pm", 12), ("p.m.", 12)];
    let half = half.iter().find(|(word, _)| lower.ends_with(word));
    let clock = half.map_or(cell, |(word, _)| cell[..cell.len() - word.len()].trim_end());
    let mut parts = clock.splitn(3, ':');
    let (hours, minutes) = (number(parts.next()?, 23)?, number(parts.next()?, 59)?);
    let hours = match half {
        Some((_, later)) => (1..=12).contains(&hours).then_some(hours % 12 + later)?,
        None => hours,
    };
    let (secs, decimals) = match parts.next() {
        None => ("0", ""),
        // Some programs write milliseconds after a third colon.
        Some(secs) => secs.split_once(['.', ',', ':']).unwrap_or((secs, "")),
    };
    let whole_ns = ((hours * 60 + minutes) * 60 + number(secs, 60)?) * SEC_NS;
    Some(whole_ns + decimals_ns(decimals)?)
}

/// Reads a cell that holds minutes and seconds since the start [ns], as stopwatches show them: `61:05.250`.
pub fn minutes_ns(cell: &str) -> Option<i64> {
    let (minutes, secs) = cell.trim().split_once(':')?;
    let (secs, decimals) = secs.split_once(['.', ',']).unwrap_or((secs, ""));
    let whole_ns = (number(minutes, 9999)? * 60 + number(secs, 59)?) * SEC_NS;
    Some(whole_ns + decimals_ns(decimals)?)
}

/// The fraction of a second after the decimal point [ns].
fn decimals_ns(decimals: &str) -> Option<i64> {
    let (mut nanos, mut step_ns) = (0, SEC_NS);
    for digit in decimals.bytes() {
        step_ns /= 10;
        nanos += i64::from(digit.is_ascii_digit().then(|| digit - b'0')?) * step_ns;
    }
    Some(nanos)
}

/// Finds the order of the parts of the dates in these cells; `None` unless all of them are dates. The second value is
/// whether the order of day and month remains ambiguous.
pub fn order(cells: &[&str]) -> Option<(Order, bool)> {
    let orders = [Order::Year, Order::Day, Order::Month];
    let fits = |order: &Order| cells.iter().all(|cell| date_ns(cell, *order).is_some());
    let fitting: Vec<Order> = orders.into_iter().filter(fits).collect();
    cells.first()?;
    match fitting[..] {
        [] => None,
        [Order::Day, Order::Month] => {
            let is_american = cells.iter().any(|cell| cell.to_ascii_lowercase().contains('m'));
            let has_points = cells.iter().all(|cell| cell.matches('.').count() > 1);
            Some((if is_american { Order::Month } else { Order::Day }, !has_points))
        }
        [first, ..] => Some((first, false)),
    }
}

/// Splits a cell into the three parts of its date and the text after it.
fn split_date(cell: &str) -> Option<([&str; 3], &str)> {
    let cell = cell.trim();
    let (date, rest) = cell.split_once(['T', 't', ' ', '_'])?;
    let date = date.trim_end_matches(',');
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if date.len() == 8 && is_digits(date) {
        return Some(([&date[..4], &date[4..6], &date[6..]], rest));
    }
    let mark = ['-', '/', '.'].into_iter().find(|mark| date.contains(*mark))?;
    let mut parts = date.split(mark);
    let date = [parts.next()?, parts.next()?, parts.next()?];
    (parts.next().is_none() && date.into_iter().all(is_digits)).then_some((date, rest))
}

/// Splits a time of day from its zone; the second value is the offset of the zone from UTC [ns].
fn split_zone(rest: &str) -> Option<(&str, i64)> {
    let rest = rest.trim();
    for zone in ["Z", "z", "UTC", "GMT"] {
        if let Some(clock) = rest.strip_suffix(zone) {
            return Some((clock, 0));
        }
    }
    let Some(at) = rest.rfind(['+', '-']) else { return Some((rest, 0)) };
    let (clock, zone) = rest.split_at(at);
    let digits: String = zone[1..].chars().filter(|each| *each != ':').collect();
    let minutes = match digits.len() {
        2 => number(&digits, 14)? * 60,
        4 => number(digits.get(..2)?, 14)? * 60 + number(digits.get(2..)?, 59)?,
        _ => return None,
    };
    let east_ns = minutes * 60 * SEC_NS;
    Some((clock, if zone.starts_with('-') { -east_ns } else { east_ns }))
}

/// Returns the number of days from 1970 to a date (Howard Hinnant, "chrono-compatible low-level date algorithms").
fn days(date: [&str; 3], order: Order) -> Option<i64> {
    let [year, month, day] = match order {
        Order::Year => date,
        Order::Day => [date[2], date[1], date[0]],
        Order::Month => [date[2], date[0], date[1]],
    };
    let year = match year.len() {
        4 => number(year, 9999)?,
        2 if order != Order::Year => 2000 + number(year, 99)?,
        _ => return None,
    };
    let (month, day) = (number(month, 12)?, number(day, 31)?);
    if month < 1 || day < 1 || year < 1900 {
        return None;
    }
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * month + 2) / 5 + day - 1;
    Some(era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

fn number(text: &str, most: i64) -> Option<i64> {
    let is_short = !text.is_empty() && text.len() <= 4;
    let is_digits = is_short && text.bytes().all(|byte| byte.is_ascii_digit());
    is_digits.then(|| text.parse().ok()).flatten().filter(|number| *number <= most)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 5 April 2021, 15:48:04.834 UTC.
    const AT_NS: i64 = 1_617_637_684_834_000_000;

    #[test]
    fn dates_are_read_as_people_and_devices_write_them() {
        for (cell, order) in [
            ("2021-04-05 15:48:04.834", Order::Year),
            ("2021-04-05T15:48:04.834Z", Order::Year),
            ("2021-04-05T17:48:04,834+02:00", Order::Year),
            ("2021-04-05T10:18:04.834000-0530", Order::Year),
            ("2021/04/05 15:48:04.834", Order::Year),
            ("20210405T15:48:04.834", Order::Year),
            ("05.04.2021 15:48:04,834", Order::Day),
            ("05.04.2021, 15:48:04,834", Order::Day),
            ("5.4.21 15:48:04.834", Order::Day),
            ("4/5/2021 3:48:04.834 PM", Order::Month),
            ("05-04-2021 15:48:04:834", Order::Day),
        ] {
            assert_eq!(date_ns(cell, order), Some(AT_NS), "{cell}");
        }
        assert_eq!(date_ns("1970-01-01 00:00", Order::Year), Some(0));
        assert_eq!(date_ns("2024-02-29T00:00:00Z", Order::Year), Some(1_709_164_800 * SEC_NS));
    }

    #[test]
    fn other_texts_are_not_dates() {
        for cell in
            ["", "12.5", "1617637684", "noon", "2021-13-01 00:00", "2021-04-05", "T", "µT1:2"]
        {
            assert_eq!(date_ns(cell, Order::Year), None, "{cell}");
        }
        for cell in ["25:00:00", "1:2:3:4:5", "12", "13:00 pm", "1:60"] {
            assert_eq!(time_of_day_ns(cell), None, "{cell}");
        }
        assert_eq!(time_of_day_ns("12:00:00 AM"), Some(0));
        assert_eq!(time_of_day_ns("23:59:59.5"), Some(DAY_NS - SEC_NS / 2));
    }

    #[test]
    fn stopwatches_show_minutes_and_seconds() {
        assert_eq!(minutes_ns("00:01.250"), Some(SEC_NS + SEC_NS / 4));
        assert_eq!(minutes_ns("61:05,5"), Some(3665 * SEC_NS + SEC_NS / 2));
        assert_eq!(minutes_ns("1:00"), Some(60 * SEC_NS));
        for cell in ["1:60", "1", "1:2:3", "a:1", "1:2.x", ":1", "99999:00"] {
            assert_eq!(minutes_ns(cell), None, "{cell}");
        }
    }

    #[test]
    fn the_order_of_dates_is_what_fits_them_all() {
        assert_eq!(order(&["2021-04-05 1:00"]), Some((Order::Year, false)));
        assert_eq!(order(&["12/04/2021 1:00", "13/04/2021 1:00"]), Some((Order::Day, false)));
        assert_eq!(order(&["04/13/2021 1:00"]), Some((Order::Month, false)));
        assert_eq!(order(&["04/05/2021 1:00 PM"]), Some((Order::Month, true)));
        assert_eq!(order(&["04/05/2021 1:00"]), Some((Order::Day, true)));
        assert_eq!(order(&["04.05.2021 1:00"]), Some((Order::Day, false)));
        assert_eq!(order(&["0.5"]), None);
        assert_eq!(order(&[]), None);
    }
}
