use std::collections::VecDeque;

/// How far back the level of open eyes is estimated from [ns].
const OVER_NANOS: i64 = 60_000_000_000;
/// The minimum time with data for an estimate [ns].
const LEAST_NANOS: i64 = 2_000_000_000;
/// The interval between estimates [ns].
const ANEW_NANOS: i64 = 500_000_000;
/// The quantile of openings that is the level of open eyes: it works for eyes that are closed up to half of
/// the time.
const RANK: f64 = 0.7;
/// The ratio of one value's standard deviation to the median absolute difference of two, for normal values.
const TO_DEVIATION: f64 = 1.048_4;

/// The opening of open eyes, and the noise of openings.
#[derive(Debug, Default)]
pub(super) struct Level {
    openings: VecDeque<(i64, f64)>,
    computed_ns: Option<i64>,
    open: f64,
    noise: f64,
}

impl Level {
    /// Takes in an opening and returns it relative to open eyes, with its noise; NaN until the level is
    /// known.
    pub fn push(&mut self, at_ns: i64, opening: f64) -> (f64, f64) {
        if !opening.is_finite() {
            return (f64::NAN, f64::NAN);
        }
        self.openings.push_back((at_ns, opening));
        let oldest_ns = at_ns.saturating_sub(OVER_NANOS);
        while self.openings.front().is_some_and(|(at_ns, _)| *at_ns < oldest_ns) {
            self.openings.pop_front();
        }
        let is_due = self
            .computed_ns
            .is_none_or(|computed_ns| at_ns.saturating_sub(computed_ns) >= ANEW_NANOS);
        if is_due {
            self.computed_ns = Some(at_ns);
            self.compute(at_ns);
        }
        (opening / self.open, self.noise / self.open)
    }

    fn compute(&mut self, at_ns: i64) {
        let first_ns = self.openings.front().map_or(at_ns, |(first_ns, _)| *first_ns);
        if at_ns.saturating_sub(first_ns) < LEAST_NANOS {
            (self.open, self.noise) = (f64::NAN, f64::NAN);
            return;
        }
        let mut sorted: Vec<f64> = self.openings.iter().map(|(_, opening)| *opening).collect();
        self.open = ranked(&mut sorted, RANK);
        let pairs = self.openings.iter().zip(self.openings.iter().skip(1));
        let mut steps: Vec<f64> = pairs.map(|((_, one), (_, next))| (next - one).abs()).collect();
        self.noise = ranked(&mut steps, 0.5) * TO_DEVIATION;
    }
}

/// The quantile for this share; NaN for an empty slice.
fn ranked(numbers: &mut [f64], share: f64) -> f64 {
    if numbers.is_empty() {
        return f64::NAN;
    }
    let place = ((numbers.len() - 1) as f64 * share).round() as usize;
    *numbers.select_nth_unstable_by(place, f64::total_cmp).1
}
