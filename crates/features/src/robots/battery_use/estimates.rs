//! Power, loss and time left, from the readings of a window.

use std::fmt;

use teampulse_core::data::Reason;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::robust::{median, median_estimate};
use teampulse_signal::slope::RegressionLine;

use super::current::Direction;
use super::gauge::{GaugeTrends, Gauges};
use super::reading::{Quantity, Reading};
use crate::value::{Value, defined};
use crate::windows::View;

const SECS_PER_HOUR: f64 = 3600.0;

/// Converts a fraction per second to percent per minute.
const PERCENT_PER_MIN: f64 = 100.0 * 60.0;

/// The minimum loss that predicts when the battery is empty [standard uncertainties].
const CLEAR_LOSS: f64 = 2.0;

/// The minimum share of a window's readings that represents the window.
const LEAST_SHARE: f64 = 0.5;

/// The use of a battery within a window.
pub(super) struct Use {
    /// Power out of the battery [W].
    pub(super) power_w: Value,
    /// How the power was computed, if it was.
    pub(super) power_method: Option<PowerMethod>,
    /// Loss of charge [%/min].
    pub(super) percent_per_min: Value,
    /// Time until the battery is empty [s].
    pub(super) empty_in_secs: Value,
    /// The remaining share of the charge [0..1].
    pub(super) fraction_left: Value,
}

/// How the power was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PowerMethod {
    Power,
    VoltageTimesCurrent,
    Energy,
    Fraction,
    Charge,
}

impl Use {
    /// The values in the order of the stream's channels.
    pub(super) fn values(&self) -> [Value; 4] {
        [self.power_w, self.percent_per_min, self.empty_in_secs, self.fraction_left]
    }
}

impl fmt::Display for PowerMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            PowerMethod::Power => "power as given",
            PowerMethod::VoltageTimesCurrent => "power from voltage × current",
            PowerMethod::Energy => "power from the loss of energy",
            PowerMethod::Fraction => "power from the loss of percent × capacity × voltage",
            PowerMethod::Charge => "power from the loss of charge × voltage",
        })
    }
}

/// The use of a battery within a window.
pub(super) fn estimate(
    view: &View<'_, Reading>,
    gauges: &Gauges,
    trends: &GaugeTrends,
    direction: Direction,
) -> Use {
    if let Some(reason) = view.lack {
        let lack = Err(reason);
        return Use {
            power_w: lack,
            power_method: None,
            percent_per_min: lack,
            empty_in_secs: lack,
            fraction_left: lack,
        };
    }
    let (power_w, power_method) = power(view, trends, direction);
    let stock = trends.fraction.or(trends.energy).or(trends.charge);
    let loss = |line: RegressionLine| defined(Some(line.slope.scaled(-PERCENT_PER_MIN)));
    Use {
        power_w,
        power_method,
        percent_per_min: trends.fraction.map_or(Err(Reason::Missing), loss),
        empty_in_secs: stock.map_or(Err(reason_without_power(view)), time_left),
        fraction_left: fraction_left(view, gauges),
    }
}

/// The power out of the battery by the first method that its quantities allow.
fn power(
    view: &View<'_, Reading>,
    trends: &GaugeTrends,
    direction: Direction,
) -> (Value, Option<PowerMethod>) {
    let voltage_v = typical(view, |reading| reading.get(Quantity::Voltage));
    let capacity_ah = typical(view, |reading| reading.get(Quantity::Capacity));
    let product =
        |reading: &Reading| direction.outward_current_a(reading) * reading.get(Quantity::Voltage);
    // Drivers that measure no current leave it at zero; a robot that runs draws some.
    let is_measured = view.share(|reading| reading.get(Quantity::Current).abs() > 0.0) > 0.0;
    let joule_per_ah = voltage_v.map(|voltage_v| voltage_v * SECS_PER_HOUR);
    let joule_per_fraction = joule_per_ah.zip(capacity_ah).map(|(joule, ah)| joule * ah);
    let methods: [(PowerMethod, &dyn Fn() -> Option<Estimate>); 5] = [
        (PowerMethod::Power, &|| middle(view, |reading| reading.get(Quantity::Power))),
        (PowerMethod::VoltageTimesCurrent, &|| middle(view, product).filter(|_| is_measured)),
        (PowerMethod::Energy, &|| Some(loss(trends.energy?, 1.0))),
        (PowerMethod::Fraction, &|| Some(loss(trends.fraction?, joule_per_fraction?))),
        (PowerMethod::Charge, &|| Some(loss(trends.charge?, joule_per_ah?))),
    ];
    let found = methods.into_iter().find_map(|(method, power)| Some((method, power()?)));
    match found {
        Some((method, power_w)) => (defined(Some(power_w)), Some(method)),
        None => (Err(reason_without_power(view)), None),
    }
}

/// Why there is no power: an energy or a charge has never changed, or is missing.
fn reason_without_power(view: &View<'_, Reading>) -> Reason {
    let given = |quantity| view.share(|reading: &Reading| reading.get(quantity).is_finite()) > 0.0;
    if given(Quantity::Energy) || given(Quantity::Charge) {
        return Reason::Undefined;
    }
    Reason::Missing
}

/// The time until the line reaches zero [s]; undefined while the loss is not clear.
fn time_left(line: RegressionLine) -> Value {
    let loss = line.slope.scaled(-1.0);
    if loss.value <= 0.0 || loss.significance() < CLEAR_LOSS {
        return Err(Reason::Undefined);
    }
    let secs = line.at(0.0).max(0.0) / loss.value;
    defined(Some(Estimate { value: secs, sigma: secs * loss.sigma / loss.value }))
}

fn loss(line: RegressionLine, factor: f64) -> Estimate {
    line.slope.scaled(-factor)
}

fn fraction_left(view: &View<'_, Reading>, gauges: &Gauges) -> Value {
    let plausible = |reading: &Reading| {
        let fraction = gauges.fraction_left(reading);
        if (0.0..=1.0).contains(&fraction) { fraction } else { f64::NAN }
    };
    middle(view, plausible).map_or(Err(Reason::Missing), |left| defined(Some(left)))
}

/// The median with its uncertainty, if enough of the window's readings contain the number.
fn middle(view: &View<'_, Reading>, number: impl Fn(&Reading) -> f64) -> Option<Estimate> {
    let share = view.share(|reading| number(reading).is_finite());
    median_estimate(&view.numbers(number)).filter(|_| share >= LEAST_SHARE)
}

fn typical(view: &View<'_, Reading>, number: impl Fn(&Reading) -> f64) -> Option<f64> {
    median(&view.numbers(number))
}
