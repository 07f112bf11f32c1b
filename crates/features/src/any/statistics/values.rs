//! The values of a window or a phase, in the order of the output's channels.

use teampulse_core::data::Reason;
use teampulse_signal::analysis::LEAST_COVERAGE;
use teampulse_signal::descriptive::{Described, Summary, View};
use teampulse_signal::estimate::Estimate;

use crate::value::{Value, defined};

/// The name and the unit of each value of a channel.
pub(super) const STATISTICS: [(&str, Unit); 7] = [
    ("mean", Unit::Own),
    ("sd", Unit::Own),
    ("median", Unit::Own),
    ("mad", Unit::Own),
    ("minimum", Unit::Own),
    ("maximum", Unit::Own),
    ("slope", Unit::PerSecond),
];

/// The unit of a value.
#[derive(Clone, Copy)]
pub(super) enum Unit {
    /// The unit of the channel.
    Own,
    /// The unit of the channel per second.
    PerSecond,
}

/// The share of the view with data, in the channel with most data [0..1].
pub(super) fn coverage(view: &View) -> f64 {
    view.channels.iter().map(|channel| channel.coverage).fold(0.0, f64::max)
}

/// The [`STATISTICS`] of all channels.
pub(super) fn statistics(view: &View) -> Vec<Value> {
    view.channels.iter().flat_map(|channel| of_channel(channel, view.is_young)).collect()
}

/// The [`STATISTICS`] of each channel, followed by their differences from those of the baseline.
pub(super) fn with_differences(view: &View, baseline: Option<&[Value]>) -> Vec<Value> {
    let width = STATISTICS.len();
    let mut values = Vec::with_capacity(2 * width * view.channels.len());
    for (index, channel) in view.channels.iter().enumerate() {
        let statistics = of_channel(channel, view.is_young);
        values.extend(statistics);
        let baseline = baseline.and_then(|baseline| baseline.get(index * width..)?.get(..width));
        let differences = statistics.iter().enumerate().map(|(place, value)| {
            let of_baseline = baseline.and_then(|baseline| baseline[place].ok());
            difference(*value, of_baseline)
        });
        values.extend(differences);
    }
    values
}

fn of_channel(channel: &Described, is_young: bool) -> [Value; 7] {
    let Some(summary) = channel.summary.filter(|_| channel.coverage >= LEAST_COVERAGE) else {
        return [Err(if is_young { Reason::Short } else { Reason::Gap }); 7];
    };
    let Summary { mean, sd, median, mad, least, greatest, slope_per_sec, .. } = summary;
    // Too few samples have neither a spread nor a slope.
    let of_two = |number: Option<f64>| number.map_or(Err(Reason::Short), sound);
    let [mean, median, mad, least, greatest] = [mean, median, mad, least, greatest].map(sound);
    [mean, of_two(sd), median, mad, least, greatest, of_two(slope_per_sec)]
}

fn difference(value: Value, baseline: Option<Estimate>) -> Value {
    sound(value?.value - baseline.ok_or(Reason::NoBaseline)?.value)
}

fn sound(number: f64) -> Value {
    defined(Some(Estimate::unstated(number)))
}

#[cfg(test)]
mod tests {
    use teampulse_signal::analysis::Span;
    use teampulse_signal::descriptive::describe;

    use super::*;

    fn view(numbers: &[f64], coverage: f64, is_young: bool) -> View {
        let secs: Vec<f64> = (0..numbers.len()).map(|k| k as f64).collect();
        let summary = describe(&secs, numbers);
        let span = Span { begin_ns: 0, end_ns: 1 };
        View { span, is_young, channels: vec![Described { coverage, summary }] }
    }

    #[test]
    fn each_statistic_stands_before_its_difference() {
        let baseline = statistics(&view(&[1.0, 2.0, 3.0], 1.0, false));
        let values = with_differences(&view(&[2.0, 4.0, 6.0], 1.0, false), Some(&baseline));
        let numbers: Vec<f64> = values.iter().map(|value| value.unwrap().value).collect();
        assert_eq!(numbers[..7], [4.0, 2.0, 4.0, 2.0, 2.0, 6.0, 2.0]);
        assert_eq!(numbers[7..], [2.0, 1.0, 2.0, 1.0, 1.0, 3.0, 1.0]);
    }

    #[test]
    fn a_missing_value_has_a_reason() {
        let full = view(&[1.0, 2.0], 1.0, false);
        let reasons = |view: &View, baseline: Option<&[Value]>| {
            let values = with_differences(view, baseline);
            [values[0].err(), values[7].err()]
        };
        let [short, gap] = [Some(Reason::Short), Some(Reason::Gap)];
        let no_baseline = Some(Reason::NoBaseline);
        assert_eq!(reasons(&full, None), [None, no_baseline]);
        assert_eq!(reasons(&view(&[1.0], 0.4, true), None), [short, short]);
        assert_eq!(reasons(&view(&[1.0], 0.4, false), None), [gap, gap]);
        let torn = statistics(&view(&[1.0], 0.4, false));
        assert_eq!(reasons(&full, Some(&torn)), [None, no_baseline]);
    }

    #[test]
    fn one_number_has_a_mean_but_neither_spread_nor_slope() {
        let values = statistics(&view(&[3.0], 1.0, false));
        assert_eq!(values[0].map(|mean| mean.value), Ok(3.0));
        assert_eq!((values[1].err(), values[6].err()), (Some(Reason::Short), Some(Reason::Short)));
    }
}
