/// A pulse wave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// The time of the systolic peak [samples from the first one], fractional.
    pub sample: f64,
    /// The time of the onset (the foot) [samples from the first one]: the intersection of the steepest tangent of the
    /// rise with the level of the preceding minimum.
    ///
    /// Chiu et al. (1991), PMID 2017978, fourth method: more robust to noise than the minimum.
    pub onset: f64,
    /// The time at which the rise reaches half of the amplitude [samples from the first one].
    pub middle: f64,
    /// The height of the peak above the preceding minimum (PWA) [unit of the signal].
    pub amplitude: f64,
    /// The time from the onset to the peak [ms].
    pub rise_ms: f64,
    /// The width at half of the amplitude [ms]; NaN until the pulse has fallen below it.
    pub width_ms: f64,
}

impl Pulse {
    /// The time of the pulse in pulse rate variability [samples from the first one]: midway between the peak and the
    /// middle of the rise. Noise shifts the two independently.
    ///
    /// Peralta et al. (2019), doi:10.1088/1361-6579/ab009b, found the middle of the rise among the points whose
    /// intervals are closest to those of an ECG.
    pub fn time(&self) -> f64 {
        self.sample.midpoint(self.middle)
    }

    /// The same pulse in a signal that starts `samples` earlier.
    pub(super) fn later_by(self, samples: f64) -> Pulse {
        let [sample, onset, middle] =
            [self.sample, self.onset, self.middle].map(|place| place + samples);
        Pulse { sample, onset, middle, ..self }
    }

    /// The same pulse in a signal with `group` times the rate.
    pub(super) fn in_groups_of(self, group: usize) -> Pulse {
        let raw = |place: f64| place * group as f64 + (group - 1) as f64 / 2.0;
        let [sample, onset, middle] =
            [self.sample, self.onset, self.middle].map(|place| raw(place).max(0.0));
        Pulse { sample, onset, middle, ..self }
    }
}
