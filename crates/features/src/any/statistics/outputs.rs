//! The streams of statistics: their names and descriptions.

use teampulse_core::stream::{Channel, Shape, Stream, Window};
use teampulse_signal::analysis::Value;

use super::meaning::caution;
use super::values::{STATISTICS, Unit};
use crate::over::OVER_PHASES;

/// The recipe, from which a reader can reproduce the values.
const RECIPE: &str = "mean; sd: standard deviation over n − 1; median; mad: median absolute deviation from the \
    median, not scaled; minimum; maximum; slope: rise of the least-squares line; all of every usable sample; \
    …_difference: the value minus that of the newest finished phase named baseline";

/// The number of reports within the length of a window; at most one per second.
const TOLD_IN_LENGTH: f64 = 30.0;

/// The interval between the reports of a window of `secs` [s], in whole seconds.
pub(super) fn hop_secs_of(secs: f64) -> f64 {
    (secs / TOLD_IN_LENGTH).round().max(1.0)
}

/// The statistics over windows of `secs` [s].
pub(super) fn over_window(input: &Stream, secs: f64) -> Stream {
    let each_secs = hop_secs_of(secs);
    let method = format!("causal, windows of {secs} s, each {each_secs} s; {RECIPE}");
    let doc = format!("Statistics of {} in the last {secs} s.", input.name);
    Stream { rate_hz: each_secs.recip(), ..output(input, Window::of_secs(secs), method, doc) }
}

/// The statistics over phases.
pub(super) fn over_phases(input: &Stream) -> Stream {
    let method = format!("{OVER_PHASES}; {RECIPE}");
    let doc = format!("Statistics of {} in each phase, reported at its end.", input.name);
    output(input, Window::Phases, method, doc)
}

fn output(input: &Stream, window: Window, method: String, mut doc: String) -> Stream {
    if let Some(caution) = caution(input) {
        doc = format!("{doc} {caution}");
    }
    let values = values(input);
    Stream {
        signal: input.signal,
        device: input.device.clone(),
        channels: values.iter().map(|value| Channel::new(&*value.name, &*value.unit)).collect(),
        method,
        doc,
        ..Stream::derived(input, "statistics", Shape::Feature).over(window)
    }
}

/// The values in their order: the statistics of each channel, then their differences.
fn values(input: &Stream) -> Vec<Value> {
    let is_alone = input.channels.len() == 1;
    let mut values = Vec::new();
    for Channel { name, unit, .. } in &input.channels {
        let channel = if is_alone { "" } else { name };
        let own = if unit.is_empty() { "1" } else { unit };
        for suffix in ["", "_difference"] {
            values.extend(STATISTICS.iter().map(|(name, unit)| {
                let unit = match unit {
                    Unit::Own => own.to_owned(),
                    Unit::PerSecond => format!("{own}/s"),
                };
                Value::of_channel(&format!("{name}{suffix}"), channel, unit, "")
            }));
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use teampulse_core::stream::{Signal, Subject};

    use super::*;

    fn input(channels: &[(&str, &str)]) -> Stream {
        let stream = Stream::raw("/r1/imu", Subject::robot("r1"), Shape::Sample);
        stream.with_channels(channels)
    }

    #[test]
    fn a_channel_among_others_stands_behind_each_name() {
        let stream = over_window(&input(&[("x", "m"), ("v", "m/s")]), 30.0);
        assert_eq!(stream.name, "/r1/imu/statistics/w30");
        assert_eq!(stream.channels.len(), 28);
        let named = |place: usize| (&*stream.channels[place].name, &*stream.channels[place].unit);
        assert_eq!([named(0), named(6)], [("mean/x", "m"), ("slope/x", "m/s")]);
        assert_eq!([named(8), named(20)], [("sd_difference/x", "m"), ("slope/v", "m/s/s")]);
    }

    #[test]
    fn a_window_is_reported_thirty_times_in_its_length_and_once_a_second_at_most() {
        let hops = [1.0, 30.0, 44.0, 60.0, 300.0, 3600.0].map(hop_secs_of);
        assert_eq!(hops, [1.0, 1.0, 1.0, 2.0, 10.0, 120.0]);
        let stream = over_window(&input(&[("x", "m")]), 300.0);
        assert_eq!(stream.rate_hz, 0.1);
        assert!(stream.method.contains("windows of 300 s, each 10 s;"), "{}", stream.method);
    }

    #[test]
    fn a_channel_alone_needs_no_name() {
        let stream = over_phases(&input(&[("temperature", "degC")]));
        assert_eq!(stream.name, "/r1/imu/statistics/phases");
        let named = [0, 1, 7].map(|place| stream.channels[place].name.as_str());
        assert_eq!(named, ["mean", "sd", "mean_difference"]);
    }

    #[test]
    fn a_stream_whose_mean_means_nothing_says_so() {
        let ecg = Stream { signal: Signal::Ecg, ..input(&[("ecg", "mV")]) };
        for stream in [over_window(&ecg, 30.0), over_phases(&ecg)] {
            assert!(stream.doc.contains("not the heart"), "{}", stream.doc);
        }
        assert!(!over_phases(&input(&[("x", "m")])).doc.contains("means nothing"));
    }
}
