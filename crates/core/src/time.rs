//! Time: nanoseconds since the Unix epoch.

use std::fmt;
use std::ops::{Add, Sub};
use std::time::Duration;

const NANOS_PER_SEC: i64 = 1_000_000_000;

/// A moment of the session [ns since the Unix epoch].
///
/// Range: the years 1678 to 2262. Arithmetic saturates at both ends, so that an absurd stamp from a
/// device can't overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(i64);

impl Time {
    /// The Unix epoch; also "before anything", as no session began in 1970.
    pub const EPOCH: Time = Time(0);

    /// The moment `nanos` [ns] after the Unix epoch.
    pub const fn from_nanos(nanos: i64) -> Time {
        Time(nanos)
    }

    /// The moment of a ROS stamp: whole seconds [s] and nanoseconds [ns].
    pub const fn from_stamp(secs: i32, nanos: u32) -> Time {
        Time(secs as i64 * NANOS_PER_SEC + nanos as i64)
    }

    /// Nanoseconds since the Unix epoch [ns].
    pub const fn nanos(self) -> i64 {
        self.0
    }

    /// The ROS stamp of this moment: whole seconds [s] and nanoseconds [ns]; seconds saturate at
    /// the ends of `i32` (the year 2038), as ROS 2 stamps do.
    pub fn stamp(self) -> (i32, u32) {
        let secs = self.0.div_euclid(NANOS_PER_SEC);
        let secs = secs.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        (secs, self.0.rem_euclid(NANOS_PER_SEC) as u32)
    }

    /// Seconds since the Unix epoch [s]; exact to about 0.2 µs in this century.
    pub fn secs(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// The time since `earlier` [ns]; negative when this is before it.
    pub fn nanos_since(self, earlier: Time) -> i64 {
        self.0.saturating_sub(earlier.0)
    }

    /// The time since `earlier` [s]; negative when this is before it.
    pub fn secs_since(self, earlier: Time) -> f64 {
        self.nanos_since(earlier) as f64 / 1e9
    }
}

impl Add<Duration> for Time {
    type Output = Time;

    fn add(self, later: Duration) -> Time {
        Time(self.0.saturating_add(i64::try_from(later.as_nanos()).unwrap_or(i64::MAX)))
    }
}

impl Sub<Duration> for Time {
    type Output = Time;

    fn sub(self, earlier: Duration) -> Time {
        Time(self.0.saturating_sub(i64::try_from(earlier.as_nanos()).unwrap_or(i64::MAX)))
    }
}

/// RFC 3339 in UTC, to the millisecond: `2026-11-21T07:43:00.250Z`.
impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let secs = self.0.div_euclid(NANOS_PER_SEC);
        let (year, month, day) = civil_from_days(secs.div_euclid(86_400));
        let of_day = secs.rem_euclid(86_400);
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}.{:03}Z",
            of_day / 3600,
            of_day / 60 % 60,
            of_day % 60,
            self.0.rem_euclid(NANOS_PER_SEC) / 1_000_000
        )
    }
}

/// Converts a number of days since 1970-01-01 to year, month and day in the proleptic Gregorian calendar.
///
/// Counts from 1 March of the year 0, so that the leap day is the last day of a year.
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_reads_as_rfc_3339() {
        assert_eq!(Time::EPOCH.to_string(), "1970-01-01T00:00:00.000Z");
        assert_eq!(
            Time::from_stamp(951_827_696, 5_000_000).to_string(),
            "2000-02-29T12:34:56.005Z"
        );
        assert_eq!(Time::from_stamp(-1, 999_000_000).to_string(), "1969-12-31T23:59:59.999Z");
    }

    #[test]
    fn a_stamp_survives_the_round_trip() {
        for nanos in [0, 1, -1, 1_700_000_000_123_456_789, -2_000_000_001] {
            let (secs, nanos_of_sec) = Time::from_nanos(nanos).stamp();
            assert_eq!(Time::from_stamp(secs, nanos_of_sec).nanos(), nanos);
        }
    }
}
