//! What a frame of a signal in the muscle's band comes to, without a transform.

/// What a step must at least be to count [unit of the signal].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds {
    /// From one side of zero to the other, for a zero crossing. 0: every change of sign counts.
    pub zero_crossing: f64,
    /// On one side of a turn of the slope, for a slope sign change. 0: every turn counts.
    pub slope_change: f64,
}

/// Sums over a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) squares: f64,
    pub(super) absolutes: f64,
    pub(super) steps: f64,
    pub(super) crossings: u32,
    pub(super) turns: u32,
}

impl Sums {
    pub(super) fn of(frame: &[f64], thresholds: Thresholds) -> Sums {
        let mut sums = Sums::default();
        for &sample in frame {
            sums.squares += sample * sample;
            sums.absolutes += sample.abs();
        }
        for pair in frame.windows(2) {
            let step = (pair[1] - pair[0]).abs();
            sums.steps += step;
            let crosses = pair[0] * pair[1] < 0.0 && step >= thresholds.zero_crossing;
            sums.crossings += u32::from(crosses);
        }
        for triple in frame.windows(3) {
            let (rise, fall) = (triple[1] - triple[0], triple[1] - triple[2]);
            let turns = rise * fall > 0.0 && rise.abs().max(fall.abs()) >= thresholds.slope_change;
            sums.turns += u32::from(turns);
        }
        sums
    }
}
