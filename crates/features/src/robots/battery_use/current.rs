//! The sign of a discharge current.

use teampulse_signal::estimate::Estimate;
use teampulse_signal::robust::median;

use super::reading::{Quantity, Reading};
use crate::windows::View;

/// `power_supply_status` of `sensor_msgs/msg/BatteryState`.
const CHARGING: f64 = 1.0;
const DISCHARGING: f64 = 2.0;

/// A smaller current counts as having no direction [A].
const LEAST_CURRENT_A: f64 = 0.01;

/// The minimum number of readings with a direction, and the share of them that must agree.
const LEAST_READINGS: usize = 3;
const AGREEING_SHARE: f64 = 0.9;

/// The minimum distance of a trend from zero [standard uncertainties].
const CLEAR_TREND: f64 = 3.0;

/// The sign of a discharge current, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Direction {
    /// Unknown so far: a battery is assumed to discharge.
    #[default]
    Unknown,
    /// A negative current discharges, as `sensor_msgs/msg/BatteryState` defines.
    NegativeOut,
    /// A positive current discharges.
    PositiveOut,
}

impl Direction {
    /// The sign after this window: by the status if that is set, otherwise by whether the fraction falls (`trend`
    /// [1/s]). Kept until there is clear evidence to the contrary.
    pub(super) fn judged(self, view: &View<'_, Reading>, trend: Option<Estimate>) -> Direction {
        let by_status = agreed(view.numbers(outward_sign_by_status));
        by_status.or_else(|| by_trend(view, trend?)).unwrap_or(self)
    }

    /// The current out of the battery [A]; negative while charging.
    pub(super) fn outward_current_a(self, reading: &Reading) -> f64 {
        let current_a = reading.get(Quantity::Current);
        match self {
            Direction::Unknown => current_a.abs(),
            Direction::NegativeOut => -current_a,
            Direction::PositiveOut => current_a,
        }
    }
}

/// The sign of a discharge current by the status of one reading; NaN if it shows none.
fn outward_sign_by_status(reading: &Reading) -> f64 {
    let status = reading.get(Quantity::Status);
    let outward = match () {
        () if is(status, DISCHARGING) => 1.0,
        () if is(status, CHARGING) => -1.0,
        () => f64::NAN,
    };
    outward * sign(reading.get(Quantity::Current))
}

fn by_trend(view: &View<'_, Reading>, trend: Estimate) -> Option<Direction> {
    let is_clear = trend.significance() > CLEAR_TREND;
    let falling = -trend.value.signum();
    let signs = view.numbers(|reading| falling * sign(reading.get(Quantity::Current)));
    agreed(signs).filter(|_| is_clear)
}

/// The direction on which the signs agree; `None` without agreement.
fn agreed(mut signs: Vec<f64>) -> Option<Direction> {
    signs.retain(|sign| !sign.is_nan());
    let common = median(&signs)?;
    let agreeing = signs.iter().filter(|sign| is(**sign, common)).count();
    let enough =
        agreeing >= LEAST_READINGS && agreeing as f64 >= AGREEING_SHARE * signs.len() as f64;
    let direction = if common > 0.0 { Direction::PositiveOut } else { Direction::NegativeOut };
    enough.then_some(direction)
}

/// The sign of a current, ±1; NaN for one without a direction.
fn sign(current_a: f64) -> f64 {
    if current_a.abs() >= LEAST_CURRENT_A { current_a.signum() } else { f64::NAN }
}

fn is(number: f64, code: f64) -> bool {
    number.total_cmp(&code).is_eq()
}
