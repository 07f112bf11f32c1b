//! THE table of measures: what of a person is compared with the baseline, and where it is read.

use teampulse_core::stream::{About, Origin, Shape, Stream};

/// One measure of a person's state.
pub(super) struct Measure {
    /// What it is called.
    pub(super) name: &'static str,
    /// In what it differs.
    pub(super) unit: &'static str,
    /// The families of features that contain it, the best first.
    pub(super) families: &'static [&'static str],
    /// Which of their values it is.
    pub(super) value: &'static str,
    /// From their value to the measure.
    pub(super) read: fn(f64) -> f64,
}

/// Families that know beats, the surest first.
const OF_THE_HEART: &[&str] = &["heart", "intervals", "pulse"];

/// Every measure, in the order of the values of a state.
pub(super) const MEASURES: [Measure; 6] = [
    Measure::of("heart_rate", "1/min", OF_THE_HEART, "HRV_MeanHR"),
    // Of a spread, the logarithm is closer to normal: Task Force (1996).
    Measure { read: f64::ln, ..Measure::of("ln_rmssd", "ln(ms)", OF_THE_HEART, "HRV_RMSSD") },
    Measure::of("breathing_rate", "1/min", &["breath"], "RSP_Rate_Mean"),
    Measure::of("skin_level", "uS", &["skin"], "EDA_Tonic_Mean"),
    Measure::of("response_rate", "1/min", &["skin"], "SCR_Peaks_Rate"),
    Measure::of("input_rate", "1/min", &["input"], "input_rate"),
];

/// How many there are.
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

    /// How good a family is for it, 0 the best, and the place of its value in a stream of that family.
    pub(super) fn place_in(&self, stream: &Stream, family: &str) -> Option<(usize, usize)> {
        let rank = self.families.iter().position(|each| *each == family)?;
        let channel = stream.place_of(self.value)?;
        Some((rank, channel))
    }
}

/// The family and the spans of a stream of windows about a person (`heart`, `w30`), if it is one that
/// measures are read from.
pub(super) fn family_and_spans(stream: &Stream) -> Option<(&str, &str)> {
    let is_windows = stream.about == About::Person
        && stream.origin == Origin::Derived
        && stream.shape == Shape::Feature
        && !stream.id.is_empty();
    let mut tokens = stream.name.rsplit('/');
    let (spans, family) = (tokens.next()?, tokens.next()?);
    let is_read = MEASURES.iter().any(|measure| measure.families.contains(&family));
    (is_windows && is_read).then_some((family, spans))
}

/// The measures in a stream, by their names.
pub(in crate::people) fn measures_of(stream: &Stream) -> impl Iterator<Item = &'static str> {
    let family = family_and_spans(stream).map(|(family, _)| family);
    let is_told = move |measure: &&Measure| {
        family.is_some_and(|family| measure.place_in(stream, family).is_some())
    };
    MEASURES.iter().filter(is_told).map(|measure| measure.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use teampulse_core::stream::Subject;

    #[test]
    fn windows_are_told_by_their_names() {
        let windows = |name: &str| Stream {
            origin: Origin::Derived,
            ..Stream::raw(name, Subject { about: About::Person, id: "p1".into() }, Shape::Feature)
        };
        let heart = windows("/humans/persons/p1/strap/ecg/heart/w30");
        assert_eq!(family_and_spans(&heart), Some(("heart", "w30")));
        assert_eq!(family_and_spans(&windows("/humans/persons/p1/state/w30")), None);
        assert_eq!(family_and_spans(&Stream { origin: Origin::Raw, ..heart }), None);
    }

    #[test]
    fn the_logarithm_is_read_of_variability_alone() {
        let read: Vec<f64> = MEASURES.iter().map(|measure| (measure.read)(1.0)).collect();
        assert_eq!(read, [1.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    }
}
