/// A pulse wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Time of the systolic peak [samples from the first one], fractional.
    pub sample: f64,
    /// Time of the onset (the foot) [samples from the first one]: the intersection of the steepest tangent of
    /// the rise with the level of the preceding minimum.
    ///
    /// Chiu et al. (1991), PMID 2017978, their fourth method: more robust to noise than the minimum.
    pub onset: f64,
    /// Time at which the rise reaches half of its amplitude [samples from the first one].
    pub middle: f64,
    /// Height of the peak above the preceding minimum (PWA) [unit of the signal].
    pub amplitude: f64,
    /// From the onset to the peak [ms].
    pub rise_ms: f64,
    /// Width at half of its amplitude [ms]; NaN until it has fallen below.
    pub width_ms: f64,
}

impl Pulse {
    /// Its time in pulse rate variability [samples from the first one]: midway between the peak and the middle of the
    /// rise. Noise shifts the two independently.
    ///
    /// Peralta et al. (2019), doi:10.1088/1361-6579/ab009b, found the middle of the rise among the points whose
    /// intervals are closest to those of an ECG.
    pub fn time(&self) -> f64 {
        self.sample.midpoint(self.middle)
    }

    /// The pulse in a signal that starts `samples` earlier.
    pub(super) fn later_by(self, samples: f64) -> Pulse {
        let [sample, onset, middle] =
            [self.sample, self.onset, self.middle].map(|place| place + samples);
        Pulse { sample, onset, middle, ..self }
    }

    /// The pulse in a signal with `group` times the rate.
    pub(super) fn in_groups_of(self, group: usize) -> Pulse {
        let raw = |place: f64| place * group as f64 + (group - 1) as f64 / 2.0;
        let [sample, onset, middle] =
            [self.sample, self.onset, self.middle].map(|place| raw(place).max(0.0));
        Pulse { sample, onset, middle, ..self }
    }
}
