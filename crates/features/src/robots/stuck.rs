//! Sensors whose numbers do not change for too long.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;

use crate::context::{FeatureContext, duration_setting};
use crate::value::moment;

/// The family of the feature's streams.
pub(crate) const FAMILY: &str = "stuck";

/// The speed below which a robot stands still [m/s].
const STANDING_M_PER_SEC: f64 = 0.01;

/// A run is too long if it is this many times as long as the second longest one before it.
const USUAL_RUNS: i64 = 3;

/// The minimum number of equal samples that counts as a fault.
const LEAST_SAMPLES: u32 = 3;

/// Faults when the numbers of a robot's sensor do not change for too long, and markers when they change again.
///
/// - Measures: runs of samples that arrive on time but whose numbers do not change at all, for
///   batteries, links, temperatures and odometry. Odometry is stuck only if its speed is not zero while its position
///   stays the same.
/// - Formula: a run is a fault once it lasts `stuck_secs` and three times as long as the second longest run so far, so
///   a coarse gauge is reported twice and then recognised.
/// - Unit: s (the length of the run: the value of the fault, and the duration of the marker).
/// - Window: none; judged at each sample.
/// - Reference: the check on minimum variability of automatic weather stations, Zahumenský (2004),
///   "Guidelines on quality control procedures for data from automatic weather stations", WMO.
/// - Limits: a sensor that is stuck but noisy, or silent, is not detected here.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Stuck {
    /// How long numbers may stay the same [s].
    pub stuck_secs: f64,
}

impl Default for Stuck {
    fn default() -> Stuck {
        Stuck { stuck_secs: 30.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for Stuck {
    const EXAMPLE: &'static str = "stuck_secs = 30";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("stuck_secs", self.stuck_secs)?;
        Ok(Box::new(self))
    }
}

impl Feature for Stuck {
    fn accepts(&self, stream: &Stream) -> bool {
        let signals = [Signal::Battery, Signal::Link, Signal::Temperature, Signal::Odometry];
        stream.about == About::Robot
            && stream.origin == Origin::Raw
            && signals.contains(&stream.signal)
            && !stream.channels.is_empty()
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Persistence {
            least_ns: (self.stuck_secs * 1e9) as i64,
            readout: None,
            watched: Watched::default(),
            output: None,
            name: String::new(),
            run: None,
            longest_ns: [0; 2],
        })
    }
}

struct Persistence {
    least_ns: i64,
    readout: Option<Readout>,
    watched: Watched,
    output: Option<OutputId>,
    name: String,
    run: Option<Run>,
    /// The longest and the second longest run that have ended [ns].
    longest_ns: [i64; 2],
}

/// The numbers that are watched, and those that show whether they should change.
#[derive(Default)]
struct Watched {
    channels: Vec<usize>,
    speeds: Vec<usize>,
}

/// Consecutive samples with the same numbers.
struct Run {
    numbers: Vec<f64>,
    since: Time,
    count: u32,
    is_reported: bool,
}

impl Extractor for Persistence {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.readout = Readout::of(stream);
        self.watched = Watched::of(stream);
        self.name.clone_from(&stream.name);
        self.output = Some(out.declare(output(stream, self.least_ns)));
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        let Some(numbers) = self.readout.as_mut().and_then(|each| each.read(&sample.data)) else {
            return;
        };
        let should_change = self.watched.should_change(numbers);
        let numbers = self.watched.numbers(numbers);
        if numbers.iter().all(|number| !number.is_finite()) {
            return;
        }
        match &mut self.run {
            Some(run) if should_change && run.is_same(&numbers) => run.count += 1,
            _ => self.begin_run(numbers, sample.measured, out),
        }
        self.judge(sample.measured, out);
    }

    /// A late sample that differs from the run restarts the run at its own time.
    fn push_late(&mut self, sample: &Sample, _: &mut Outputs) {
        let numbers = self.readout.as_mut().and_then(|readout| readout.read(&sample.data));
        let (Some(numbers), Some(run)) = (numbers, &mut self.run) else { return };
        let differs = !run.is_same(&self.watched.numbers(numbers));
        if differs && !run.is_reported && sample.measured > run.since {
            run.since = sample.measured;
        }
    }
}

impl Persistence {
    fn begin_run(&mut self, numbers: Vec<f64>, measured: Time, out: &mut Outputs) {
        let next = Run { numbers, since: measured, count: 1, is_reported: false };
        let Some(ended) = self.run.replace(next) else { return };
        let length_ns = measured.nanos_since(ended.since);
        if ended.is_reported {
            let label = format!("{}: numbers change again", self.name);
            let moves = moment(EventKind::Marker, label);
            self.say(measured, Event { duration_secs: length_ns as f64 / 1e9, ..moves }, out);
        }
        self.longest_ns[1] = self.longest_ns[1].max(length_ns.min(self.longest_ns[0]));
        self.longest_ns[0] = self.longest_ns[0].max(length_ns);
    }

    fn judge(&mut self, now: Time, out: &mut Outputs) {
        let limit_ns = self.least_ns.max(self.longest_ns[1].saturating_mul(USUAL_RUNS));
        let Some(run) = &mut self.run else { return };
        let length_ns = now.nanos_since(run.since);
        if run.is_reported || run.count < LEAST_SAMPLES || length_ns < limit_ns {
            return;
        }
        run.is_reported = true;
        let secs = length_ns as f64 / 1e9;
        let label = format!("{}: numbers have not changed for {secs:.0} s", self.name);
        let fault = moment(EventKind::Fault, label);
        self.say(now, Event { value: secs, duration_secs: f64::NAN, ..fault }, out);
    }

    fn say(&self, at: Time, event: Event, out: &mut Outputs) {
        if let Some(output) = self.output {
            out.emit(output, at, Data::Event(Arc::new(event)));
        }
    }
}

impl Watched {
    fn of(stream: &Stream) -> Watched {
        let of_unit = |unit: &str| -> Vec<usize> {
            let channels = stream.channels.iter().enumerate();
            channels.filter(|(_, each)| each.unit == unit).map(|(index, _)| index).collect()
        };
        if stream.signal == Signal::Odometry {
            return Watched { channels: of_unit("m"), speeds: of_unit("m/s") };
        }
        Watched { channels: (0..stream.channels.len()).collect(), speeds: Vec::new() }
    }

    fn numbers(&self, all: &[f64]) -> Vec<f64> {
        self.channels.iter().filter_map(|&index| all.get(index)).copied().collect()
    }

    /// Whether the numbers should change: always, if there is no speed.
    fn should_change(&self, all: &[f64]) -> bool {
        let speeds = self.speeds.iter().filter_map(|&index| all.get(index));
        self.speeds.is_empty() || speeds.into_iter().any(|speed| speed.abs() > STANDING_M_PER_SEC)
    }
}

impl Run {
    fn is_same(&self, numbers: &[f64]) -> bool {
        let same = |(one, other): (&f64, &f64)| one.to_bits() == other.to_bits();
        self.numbers.len() == numbers.len() && self.numbers.iter().zip(numbers).all(same)
    }
}

fn output(input: &Stream, least_ns: i64) -> Stream {
    Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        method: format!("numbers that stay the same for {} s", least_ns as f64 / 1e9),
        doc: format!("When the numbers of {} stop changing, and change again.", input.name),
        ..Stream::derived(input, FAMILY, Shape::Event)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::{Drive, built, plain};

    fn thermometer() -> Drive {
        let stream = plain("/r1/temp", Signal::Temperature, &[("temperature", "degC")]);
        Drive::new(built::<Stuck>("stuck_secs = 30").as_ref(), &stream)
    }

    fn odometer() -> Drive {
        let channels = [("x", "m"), ("y", "m"), ("v", "m/s"), ("w", "rad/s")];
        let stream = plain("/r1/odom", Signal::Odometry, &channels);
        Drive::new(built::<Stuck>("").as_ref(), &stream)
    }

    #[test]
    fn a_constant_sensor_is_reported_once_and_again_when_it_moves() {
        let mut drive = thermometer();
        (0..100).for_each(|secs| drive.at(f64::from(secs), &[21.5]));
        drive.late(50.5, &[21.6]);
        drive.at(100.0, &[21.6]);
        let faults = drive.events("/r1/temp/stuck");
        assert_eq!(faults.len(), 2);
        assert_eq!(
            (faults[0].0, faults[0].1.kind, faults[0].1.value),
            (30.0, EventKind::Fault, 30.0)
        );
        assert_eq!(faults[0].1.label, "/r1/temp: numbers have not changed for 30 s");
        assert_eq!((faults[1].0, faults[1].1.duration_secs), (100.0, 100.0));
    }

    #[test]
    fn a_sensor_that_changes_is_not_stuck() {
        let mut drive = thermometer();
        (0..300).for_each(|secs| drive.at(f64::from(secs), &[f64::from(secs / 20)]));
        assert!(drive.events("/r1/temp/stuck").is_empty());
    }

    #[test]
    fn a_coarse_gauge_is_reported_twice_and_then_known() {
        let mut drive = thermometer();
        (0..1200).for_each(|secs| drive.at(f64::from(secs), &[f64::from(secs / 60)]));
        assert_eq!(drive.events("/r1/temp/stuck").len(), 4);
    }

    #[test]
    fn silence_is_not_a_run() {
        let mut drive = thermometer();
        drive.at(0.0, &[1.0]);
        drive.at(100.0, &[1.0]);
        drive.until(200.0);
        assert!(drive.events("/r1/temp/stuck").is_empty());
    }

    #[test]
    fn standing_still_is_not_stuck() {
        let mut drive = odometer();
        (0..100).for_each(|secs| drive.at(f64::from(secs), &[1.0, 2.0, 0.0, 0.0]));
        assert!(drive.events("/r1/odom/stuck").is_empty());
    }

    #[test]
    fn a_position_that_stays_at_speed_is_stuck() {
        let mut drive = odometer();
        (0..100).for_each(|secs| drive.at(f64::from(secs), &[1.0, 2.0, 0.4, 0.0]));
        drive.at(100.0, &[1.0, 2.0, 0.0, 0.0]);
        assert_eq!(drive.events("/r1/odom/stuck").len(), 2);
    }

    #[test]
    fn a_late_sample_that_differs_breaks_the_run_where_it_belongs() {
        let mut drive = thermometer();
        (0..20).for_each(|secs| drive.at(f64::from(secs), &[21.5]));
        drive.late(10.5, &[21.6]);
        (20..60).for_each(|secs| drive.at(f64::from(secs), &[21.5]));
        assert_eq!(drive.events("/r1/temp/stuck")[0].0, 41.0);
    }
}
