//! The resolution of a battery's gauge, and the quantities that it reports.

use teampulse_core::stream::Stream;
use teampulse_signal::slope::RegressionLine;
use teampulse_signal::trend::trend;

use super::reading::{Quantity, Reading};
use crate::windows::View;

/// A fraction above this is a percentage.
const GREATEST_FRACTION: f64 = 1.5;

/// The number of readings above [`GREATEST_FRACTION`] that are needed; a single one may be a fault.
const READINGS_TO_BELIEVE: u32 = 2;

/// A gauge of the fraction is assumed to have a resolution of one percent until it shows finer
/// steps.
const COARSEST_STEP: f64 = 0.01;

/// The gauges of a battery: its fraction, its charge and its energy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gauges {
    percent_seen: u32,
    fraction: Steps,
    charge: Steps,
    energy: Steps,
}

/// The lines along the remaining charge of a battery, over the time before the window's end [s].
#[derive(Clone, Copy, Debug)]
pub(super) struct GaugeTrends {
    /// The line along the fraction [1].
    pub(super) fraction: Option<RegressionLine>,
    /// The line along the charge [Ah].
    pub(super) charge: Option<RegressionLine>,
    /// The line along the energy [J].
    pub(super) energy: Option<RegressionLine>,
}

/// The smallest step that a gauge has shown so far.
#[derive(Clone, Copy, Debug)]
struct Steps {
    last: f64,
    smallest: f64,
}

impl Gauges {
    /// Gauges without any reading so far.
    pub(super) fn of(stream: &Stream) -> Gauges {
        let in_percent = stream.channels.iter().any(|channel| channel.unit == "%");
        let unseen = Steps { last: f64::NAN, smallest: f64::INFINITY };
        Gauges {
            percent_seen: if in_percent { READINGS_TO_BELIEVE } else { 0 },
            fraction: unseen,
            charge: unseen,
            energy: unseen,
        }
    }

    /// Learns from a reading whether the fraction is given as 0–100; returns true for the reading that shows it.
    pub(super) fn learn_percent(&mut self, fraction: f64) -> bool {
        if self.is_percent() || fraction.is_nan() || fraction <= GREATEST_FRACTION {
            return false;
        }
        self.percent_seen += 1;
        self.is_percent()
    }

    /// Follows the steps from reading to reading.
    pub(super) fn follow(&mut self, reading: &Reading) {
        self.fraction.follow(reading.get(Quantity::Fraction));
        self.charge.follow(reading.get(Quantity::Charge));
        self.energy.follow(reading.get(Quantity::Energy));
    }

    /// The remaining fraction of charge [0..1]; NaN where unknown.
    pub(super) fn fraction_left(&self, reading: &Reading) -> f64 {
        let given = reading.get(Quantity::Fraction);
        let fraction = match self.is_percent() {
            true => given / 100.0,
            false if given > GREATEST_FRACTION => f64::NAN,
            false => given,
        };
        let counted = reading.get(Quantity::Charge) / reading.get(Quantity::Capacity);
        if fraction.is_nan() { counted } else { fraction }
    }

    /// Whether a reading contains any quantity that shows the battery's use.
    pub(super) fn shows_use(&self, reading: &Reading) -> bool {
        let power = reading.get(Quantity::Voltage) * reading.get(Quantity::Current);
        let alone = [Quantity::Charge, Quantity::Energy, Quantity::Power].map(|q| reading.get(q));
        self.fraction_left(reading).is_finite()
            || power.is_finite()
            || alone.iter().any(|number| number.is_finite())
    }

    /// The lines along the remaining charge, over the time before the window's end [s].
    pub(super) fn trends(&self, view: &View<'_, Reading>) -> GaugeTrends {
        let scale = if self.is_percent() { 0.01 } else { 1.0 };
        let fraction_step = (self.fraction.smallest * scale).min(COARSEST_STEP);
        let of = |quantity| move |reading: &Reading| reading.get(quantity);
        GaugeTrends {
            fraction: line(view, |reading| self.fraction_left(reading), fraction_step),
            charge: line(view, of(Quantity::Charge), self.charge.smallest),
            energy: line(view, of(Quantity::Energy), self.energy.smallest),
        }
    }

    fn is_percent(&self) -> bool {
        self.percent_seen >= READINGS_TO_BELIEVE
    }
}

impl Steps {
    fn follow(&mut self, number: f64) {
        let step = (number - self.last).abs();
        if step > 0.0 {
            self.smallest = self.smallest.min(step);
        }
        if !number.is_nan() {
            self.last = number;
        }
    }
}

/// The line along one number of the readings; none until its gauge has moved.
fn line(
    view: &View<'_, Reading>,
    number: impl Fn(&Reading) -> f64,
    step: f64,
) -> Option<RegressionLine> {
    if step.is_infinite() {
        return None;
    }
    trend(&view.times_secs(), &view.numbers(number), step)
}
