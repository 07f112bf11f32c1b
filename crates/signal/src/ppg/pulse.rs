/// A pulse wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Time of the systolic peak [samples from the first one], between samples.
    pub sample: f64,
    /// Time of the onset (the foot) [samples from the first one]: where the tangent of the steepest
    /// rise meets the level of the lowest point before it.
    ///
    /// Chiu et al. (1991), PMID 2017978, their fourth method: less moved by noise than the lowest point.
    pub onset: f64,
    /// Height of the peak above the lowest point before it (PWA) [unit of the signal].
    pub amplitude: f64,
    /// From the onset to the peak [ms].
    pub rise_ms: f64,
    /// How long the pulse is above half of its amplitude [ms]; NaN until it has fallen below.
    pub width_ms: f64,
}

impl Pulse {
    /// The same pulse in a signal that begins earlier by so many samples.
    pub(super) fn later_by(self, samples: f64) -> Pulse {
        Pulse { sample: self.sample + samples, onset: self.onset + samples, ..self }
    }

    /// The same pulse in a signal of which `group` samples make one of this one.
    pub(super) fn in_groups_of(self, group: usize) -> Pulse {
        let raw = |place: f64| place * group as f64 + (group - 1) as f64 / 2.0;
        Pulse { sample: raw(self.sample).max(0.0), onset: raw(self.onset).max(0.0), ..self }
    }
}
