//! How steep beats are compared with the signal between them: the swing of an electrode at each step is slower than a
//! QRS complex.

/// The time over which a slope is taken [s], and how far around a beat the beat's own slope is searched for.
const LAG_SECS: f64 = 0.008;
const OWN_SECS: f64 = 0.08;
/// The margins after the previous beat and before the beat, between which other slopes are searched for [s].
const AFTER_SECS: f64 = 0.16;
const BEFORE_SECS: f64 = 0.14;

/// The slopes of a beat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steepness {
    /// The beat's steepest slope [heights of the beat per second].
    pub(super) own: f64,
    /// The steepest slope since the beat before, as a multiple of the beat's own; `None` for the first beat, and where
    /// the interval is too short for any.
    pub(super) between: Option<f64>,
}

impl Steepness {
    /// The slopes of the beat at sample `beat` with this peak-to-peak range, after the beat at `before`; `None` if
    /// these samples don't contain the beat.
    pub(super) fn of(
        clean: &[f64],
        rate_hz: f64,
        before: Option<f64>,
        (beat, height): (f64, f64),
    ) -> Option<Steepness> {
        let lag = ((LAG_SECS * rate_hz).round() as usize).max(1);
        let steepest = |begin: f64, end: f64| {
            let end = (end.max(0.0) as usize).min(clean.len());
            let samples = clean.get(begin.max(0.0) as usize..end)?;
            let changes = samples.iter().zip(samples.get(lag..)?).map(|(a, b)| (b - a).abs());
            changes.reduce(f64::max)
        };
        let around = OWN_SECS * rate_hz;
        let own = steepest(beat - around, beat + around).filter(|own| *own > 0.0)?;
        let between = before.and_then(|before| {
            steepest(before + AFTER_SECS * rate_hz, beat - BEFORE_SECS * rate_hz)
        });
        let height_a_second = height * lag as f64 / rate_hz;
        Some(Steepness { own: own / height_a_second, between: between.map(|slope| slope / own) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 250.0;

    /// Waves of these widths [s], two seconds apart.
    fn waves(widths_secs: [f64; 2]) -> Vec<f64> {
        let wave = |secs: f64, at: usize| {
            let width = widths_secs[at % 2];
            (-((secs - at as f64) / width).powi(2) / 2.0).exp()
        };
        (0..1500).map(|k| (1..6).map(|at| wave(f64::from(k) / RATE_HZ, at)).sum()).collect()
    }

    #[test]
    fn a_step_is_less_steep_than_the_beat_beside_it() {
        let signal = waves([0.04, 0.01]);
        let at = |secs: f64, before: Option<f64>| {
            let before = before.map(|secs| secs * RATE_HZ);
            Steepness::of(&signal, RATE_HZ, before, (secs * RATE_HZ, 1.0)).unwrap()
        };
        let (step, beat) = (at(4.0, Some(2.0)), at(3.0, Some(1.0)));
        assert!(step.own < 20.0 && beat.own > 50.0);
        assert!(step.between.unwrap() > 3.0 && beat.between.unwrap() < 0.4);
        assert_eq!(at(3.0, None).between, None);
    }

    #[test]
    fn a_beat_outside_of_the_samples_or_in_a_constant_signal_has_no_slope() {
        assert_eq!(Steepness::of(&waves([0.01; 2]), RATE_HZ, None, (1e6, 1.0)), None);
        assert_eq!(Steepness::of(&[1.0; 500], RATE_HZ, None, (250.0, 1.0)), None);
    }
}
