//! The power drawn from a battery, its loss of charge, and when it will be empty.

mod reading;
mod gauge;
mod current;
mod estimates;
mod notes;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Origin, Shape, Signal, Stream, StreamId, Window};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;

use self::current::Direction;
use self::estimates::estimate;
use self::gauge::{GaugeTrends, Gauges};
use self::notes::{Note, Notes};
use self::reading::{Layout, Quantity, Reading};
use crate::context::FeatureContext;
use crate::value::window_of;
use crate::windows::{View, Windows};

/// How fast a battery is used, and when it will be empty: the battery utilisation of a robot.
///
/// - Measures: the power taken from the battery and the loss of charge, negative while charging; the remaining time and
///   the remaining share of the charge.
/// - Formula: power is the first available of: the power itself; the median of voltage × current; −d(energy)/dt;
///   −d(fraction)/dt × capacity × voltage; −d(charge)/dt × voltage. Loss is −d(fraction)/dt. The remaining time is the
///   remaining charge divided by its loss, if that is more than twice its uncertainty; the remaining share is the
///   median. Slopes are Theil–Sen lines, through the times of change if a gauge is coarse.
/// - Unit: W, %/min, s, 1, each with its standard uncertainty.
/// - Window: `windows_secs`, once a second; at most 600 readings each.
/// - Reference: Jo et al., "A ROS-based framework for monitoring human and robot conditions in a
///   human-multi-robot team"; `sensor_msgs/msg/BatteryState`; Sen (1968),
///   doi:10.1080/01621459.1968.10480934.
/// - Limits: drivers that report percent as 0–100, or discharge as a positive current, are recognised and reported once
///   in `notes`; a current that is exactly zero throughout counts as not measured. A battery's own estimate of its
///   charge is not checked. The remaining time assumes that the use continues as in the window. Uncertainties assume
///   independent errors.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BatteryUse {
    /// The lengths of the windows [s]; by default the study's.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for BatteryUse {
    const EXAMPLE: &'static str = "windows_secs = [30, 60]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        Ok(Box::new(Batteries { windows_secs: context.windows_or(self.windows_secs)? }))
    }
}

struct Batteries {
    windows_secs: Vec<f64>,
}

impl Feature for Batteries {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.signal == Signal::Battery
            && stream.origin == Origin::Raw
            && Layout::of(stream).shows_use()
    }

    fn start(&self, stream: &Stream) -> Box<dyn Extractor> {
        Box::new(Battery {
            lengths_secs: self.windows_secs.clone(),
            windows: Windows::new(&self.windows_secs),
            readout: None,
            layout: Layout::of(stream),
            gauges: Gauges::of(stream),
            direction: Direction::default(),
            notes: Notes::default(),
            outputs: Vec::new(),
        })
    }
}

struct Battery {
    lengths_secs: Vec<f64>,
    windows: Windows<Reading>,
    readout: Option<Readout>,
    layout: Layout,
    gauges: Gauges,
    direction: Direction,
    notes: Notes,
    outputs: Vec<OutputId>,
}

impl Extractor for Battery {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.readout = Readout::of(stream);
        self.layout = Layout::of(stream);
        self.notes.declare(stream, out);
        let declare = |secs: &f64| out.declare(output(stream, *secs));
        self.outputs = self.lengths_secs.iter().map(declare).collect();
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some(reading) = self.read(sample) else { return };
        self.gauges.follow(&reading);
        self.take(sample.measured, reading, out);
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some(reading) = self.read(sample) else { return };
        self.take(sample.measured, reading, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let Some(end) = self.windows.due(now) else { return };
        let lined = |view| (self.gauges.trends(&view), view);
        let windows: Vec<(GaugeTrends, View<'_, Reading>)> =
            self.windows.views(end).map(lined).collect();
        // The longest window has the most evidence.
        if let Some((trends, view)) = windows.last() {
            self.direction = self.direction.judged(view, trends.fraction.map(|line| line.slope));
        }
        if self.direction == Direction::PositiveOut {
            self.notes.say(Note::PositiveDischarge, end, out);
        }
        for ((trends, view), output) in windows.iter().zip(&self.outputs) {
            let found = estimate(view, &self.gauges, trends, self.direction);
            let quality = view.share(|reading| self.gauges.shows_use(reading));
            out.emit(*output, end, window_of(view.secs, view.coverage, quality, &found.values()));
            if let Some(method) = found.power_method {
                self.notes.say(Note::Power(method), end, out);
            }
        }
    }
}

impl Battery {
    fn read(&mut self, sample: &Sample) -> Option<Reading> {
        let numbers = self.readout.as_mut()?.read(&sample.data)?;
        Some(self.layout.reading(numbers))
    }

    fn take(&mut self, measured: Time, reading: Reading, out: &mut Outputs) {
        if self.gauges.learn_percent(reading.get(Quantity::Fraction)) {
            self.notes.say(Note::PercentAsHundred, measured, out);
        }
        self.windows.insert(measured, reading);
    }
}

fn output(input: &Stream, secs: f64) -> Stream {
    let channels = [
        ("power_w", "W"),
        ("percent_per_min", "%/min"),
        ("empty_in_secs", "s"),
        ("fraction_left", "1"),
    ];
    Stream {
        signal: Signal::Battery,
        device: input.device.clone(),
        rate_hz: 1.0,
        method: format!("median power and Theil-Sen slopes over {secs} s, Sen (1968)"),
        doc: format!("The use of {} in the last {secs} s.", input.name),
        ..Stream::derived(input, "use", Shape::Feature)
            .over(Window::of_secs(secs))
            .with_channels(&channels)
    }
}

#[cfg(test)]
mod tests;
