//! The statistics of every stream with numbers, live, and their differences from the baseline.

mod tracked;
mod meaning;
mod outputs;
mod values;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::feature::{Extractor, Feature, Outputs, Scope};
use teampulse_core::phases::Phases;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{About, Origin, Shape, Stream, StreamId};
use teampulse_core::time::Time;

use self::tracked::TrackedStream;
use crate::context::FeatureContext;
use crate::team::proximity;

/// A phase is reported this long after its end even if nothing has arrived on the stream since [ns].
const PATIENCE_NS: i64 = 10_000_000_000;

/// Statistics of the numbers of a stream in windows and phases, and their differences from the
/// baseline.
///
/// - Measures: for each channel of every raw stream of a person or a robot that has numbers (plain ones, or fields read
///   from messages), and of the distances of `proximity`: mean, standard deviation, median, median absolute deviation,
///   minimum, maximum and slope; and the difference of each from its value in the baseline phase.
/// - Formula: numpy's `mean`, `std(ddof=1)`, `median`, `min` and `max`; SciPy's `median_abs_deviation`, not scaled; the
///   slope of the least-squares line; all exact, over every usable sample. A difference is the value minus that of the
///   newest finished phase named `baseline`; so the difference of `sd` is the standard deviation of the task minus that
///   of the baseline.
/// - Unit: that of the channel; for a slope, that per second.
/// - Window: `windows_secs`, 30 times within its length but at most once a second (every second for 30 s, every 10 s
///   for 300 s), from the stream's first sample on, reported when the first sample at or after the end has arrived;
///   `phases`, each when it is over; of a long phase, only the last 600 s. A sample that arrives late counts in all
///   later results, at its true time.
/// - Reference: Jo et al., "A ROS-based framework for monitoring human and robot conditions in a
///   human-multi-robot team"; merged as in Chan et al. (1983), doi:10.1080/00031305.1983.10483115.
/// - Limits: the quality is not assessed, so it is always 1; with less than half of a channel's data its values are
///   `short` (before the stream is as old as the window) or a `gap`; differences have no baseline until one is over; a
///   window of more than 8 million numbers is skipped, with a fault. The mean of many raw signals (ECG, PPG, EEG, EMG,
///   a belt) is meaningless, as the descriptions of those streams state.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Statistics {
    /// The lengths of the windows [s]; by default those of the study.
    pub windows_secs: Option<Vec<f64>>,
}

impl Component<dyn Feature, FeatureContext> for Statistics {
    const EXAMPLE: &'static str = "windows_secs = [30, 60, 300]";

    fn build(self, context: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        Ok(Box::new(Every { windows_secs: context.windows_or(self.windows_secs)? }))
    }
}

/// Every stream with numbers.
struct Every {
    windows_secs: Vec<f64>,
}

fn has_numbers(stream: &Stream) -> bool {
    let is_raw = stream.origin == Origin::Raw
        && matches!(stream.shape, Shape::Sample | Shape::Wave | Shape::Message(_));
    let is_distance = stream.origin == Origin::Derived && stream.family == proximity::FAMILY;
    matches!(stream.about, About::Person | About::Robot)
        && (is_raw || is_distance)
        && !stream.channels.is_empty()
}

impl Feature for Every {
    fn accepts(&self, stream: &Stream) -> bool {
        has_numbers(stream) || Phases::hears(stream)
    }

    /// All streams share one extractor: phases are reported in the order of their streams.
    fn scope(&self) -> Scope {
        Scope::Session
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        let windows_secs = self.windows_secs.clone();
        Box::new(AtWork { windows_secs, tracked: BTreeMap::new() })
    }
}

/// The statistics of all streams.
struct AtWork {
    windows_secs: Vec<f64>,
    tracked: BTreeMap<StreamId, TrackedStream>,
}

impl Extractor for AtWork {
    fn join(&mut self, id: StreamId, stream: &Stream, out: &mut Outputs) {
        if !Phases::hears(stream) {
            let begin = || TrackedStream::new(stream, &self.windows_secs);
            self.tracked.entry(id).or_insert_with(begin).join(stream, out);
        }
    }

    fn push(&mut self, sample: &Sample, out: &mut Outputs) {
        if let Some(tracked) = self.tracked.get_mut(&sample.stream) {
            tracked.push(sample, &out.phases(), out);
        }
    }

    /// The end of the session ends all phases.
    fn phases_changed(&mut self, by: &Sample, out: &mut Outputs) {
        if out.phases().is_over() {
            self.end_phases(by.measured, out);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        self.end_phases(Time::from_nanos(now.nanos().saturating_sub(PATIENCE_NS)), out);
    }
}

impl AtWork {
    fn end_phases(&mut self, now: Time, out: &mut Outputs) {
        let phases = out.phases();
        for tracked in self.tracked.values_mut() {
            tracked.end_phases(&phases, now, out);
        }
    }
}

#[cfg(test)]
mod tests;
