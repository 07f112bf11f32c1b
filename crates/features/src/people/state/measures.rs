//! The table of measures: the values of a person that are compared with the baseline, and their streams.

use teampulse_core::stream::{About, Origin, Shape, Stream, Window};

/// One measure of a person's state.
pub(super) struct Measure {
    /// The name of the measure.
    pub(super) name: &'static str,
    /// The unit of its differences.
    pub(super) unit: &'static str,
    /// The families of features that contain the measure, the best first.
    pub(super) families: &'static [&'static str],
    /// The name of the measure's value in these families.
    pub(super) value: &'static str,
    /// The conversion of that value to the measure.
    pub(super) read: fn(f64) -> f64,
}

/// Families with beats, the most reliable first.
const OF_THE_HEART: &[&str] = &["heart", "intervals", "pulse"];

/// Every measure, in the order of the values of a state.
pub(super) const MEASURES: [Measure; 6] = [
    Measure::of("heart_rate", "1/min", OF_THE_HEART, "HRV_MeanHR"),
    // The logarithm of a spread is closer to normal: Task Force (1996).
    Measure { read: f64::ln, ..Measure::of("ln_rmssd", "ln(ms)", OF_THE_HEART, "HRV_RMSSD") },
    Measure::of("breathing_rate", "1/min", &["breath"], "RSP_Rate_Mean"),
    Measure::of("skin_level", "uS", &["skin"], "EDA_Tonic_Mean"),
    Measure::of("response_rate", "1/min", &["skin"], "SCR_Peaks_Rate"),
    Measure::of("input_rate", "1/min", &["input"], "input_rate"),
];

/// The number of measures.
pub(super) const COUNT: usize = MEASURES.len();

impl Measure {
    const fn of(
        name: &'static str,
        unit: &'static str,
        families: &'static [&'static str],
        value: &'static str,
    ) -> Measure {
        Measure { name, unit, families, value, read: |value| value }
    }

    /// The rank of a stream's family for the measure, 0 for the best, and the index of the measure's value in the
    /// stream.
    pub(super) fn place_in(&self, stream: &Stream) -> Option<(usize, usize)> {
        let rank = self.families.iter().position(|each| *each == stream.family)?;
        let channel = stream.place_of(self.value)?;
        Some((rank, channel))
    }
}

/// The window of a person's stream from which measures are read.
pub(super) fn read_window(stream: &Stream) -> Option<Window> {
    let is_of_person = stream.about == About::Person
        && stream.origin == Origin::Derived
        && stream.shape == Shape::Feature
        && !stream.id.is_empty();
    let is_read = || MEASURES.iter().any(|each| each.families.contains(&&*stream.family));
    stream.window.filter(|_| is_of_person && is_read())
}

/// The measures in a stream, by their names.
pub(in crate::people) fn measures_of(stream: &Stream) -> impl Iterator<Item = &'static str> {
    let is_read = read_window(stream).is_some();
    let is_measured = move |measure: &&Measure| is_read && measure.place_in(stream).is_some();
    MEASURES.iter().filter(is_measured).map(|measure| measure.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use teampulse_core::stream::Subject;

    #[test]
    fn windows_are_known_by_their_family() {
        let person = || Subject { about: About::Person, id: "p1".into() };
        let windows = |family: &str| {
            let stream = Stream::concluded("/p1/any", person(), family, Shape::Feature);
            stream.over(Window::of_secs(30.0))
        };
        let heart = windows("heart");
        assert_eq!(read_window(&heart), Some(Window::of_secs(30.0)));
        assert_eq!(read_window(&windows("state")), None);
        assert_eq!(read_window(&Stream { origin: Origin::Raw, ..heart }), None);
    }

    #[test]
    fn the_logarithm_is_read_of_variability_alone() {
        let read: Vec<f64> = MEASURES.iter().map(|measure| (measure.read)(1.0)).collect();
        assert_eq!(read, [1.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    }
}
