//! Mergeable moments of values and their times.

use crate::gaps::is_usable;

/// Count, mean, spread, extremes and slope of timed values.
///
/// Merged as in Chan et al. (1983), doi:10.1080/00031305.1983.10483115, which is as accurate as two passes:
/// nothing is ever subtracted from a sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    pub(super) count: f64,
    pub(super) mean: f64,
    pub(super) least: f64,
    pub(super) greatest: f64,
    mean_secs: f64,
    /// Sums of products of deviations from the means: of values, of times, of both.
    values: f64,
    times: f64,
    both: f64,
}

/// Zero values.
impl Default for Moments {
    fn default() -> Moments {
        let (least, greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        let [count, mean, mean_secs, values, times, both] = [0.0; 6];
        Moments { count, mean, least, greatest, mean_secs, values, times, both }
    }
}

impl Moments {
    /// The moments of the [usable](is_usable) values, each with its time [s], computed in two passes.
    pub(super) fn of(points: impl Iterator<Item = (f64, f64)> + Clone) -> Moments {
        let usable = points.filter(|(_, value)| is_usable(*value));
        let Some((origin_secs, origin)) = usable.clone().next() else { return Moments::default() };
        let add = |sum: (f64, f64, f64), (secs, value): (f64, f64)| {
            (sum.0 + 1.0, sum.1 + (secs - origin_secs), sum.2 + (value - origin))
        };
        let (count, secs, values) = usable.clone().fold((0.0, 0.0, 0.0), add);
        let (mean_secs, mean) = (origin_secs + secs / count, origin + values / count);
        let mut moments = Moments { count, mean, mean_secs, ..Moments::default() };
        for (secs, value) in usable {
            let (after, above) = (secs - mean_secs, value - mean);
            moments.least = moments.least.min(value);
            moments.greatest = moments.greatest.max(value);
            moments.values += above * above;
            moments.times += after * after;
            moments.both += after * above;
        }
        moments
    }

    pub(super) fn merged(self, other: Moments) -> Moments {
        if self.count == 0.0 || other.count == 0.0 {
            return if other.count == 0.0 { self } else { other };
        }
        let count = self.count + other.count;
        let share = other.count / count;
        let (after, above) = (other.mean_secs - self.mean_secs, other.mean - self.mean);
        let weight = self.count * share;
        Moments {
            count,
            mean: self.mean + above * share,
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
            mean_secs: self.mean_secs + after * share,
            values: self.values + other.values + above * above * weight,
            times: self.times + other.times + after * after * weight,
            both: self.both + other.both + after * above * weight,
        }
    }

    /// Standard deviation of the values, over n − 1. `None` with fewer than two.
    pub(super) fn sd(&self) -> Option<f64> {
        (self.count > 1.0).then(|| (self.values / (self.count - 1.0)).sqrt())
    }

    /// Slope of the least-squares line; `None` when fewer than two values differ in time.
    pub(super) fn slope_per_sec(&self) -> Option<f64> {
        Some(self.both / self.times).filter(|slope| slope.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::descriptive::describe;

    #[test]
    fn nothing_has_no_course() {
        let nothing = Moments::of([(0.0, f64::NAN)].into_iter());
        let one = Moments::of([(3.0, 7.0)].into_iter()).merged(nothing);
        assert_eq!((nothing.count, one.count, one.mean), (0.0, 1.0, 7.0));
        assert_eq!((one.sd(), one.slope_per_sec()), (None, None));
    }

    proptest! {
        #[test]
        fn parts_come_to_what_the_whole_comes_to(
            values in prop::collection::vec(prop_oneof![9 => -1.0..1.0f64, 1 => Just(f64::NAN)], 2..200),
            cuts in prop::collection::vec(0usize..200, 0..6),
            offset in prop_oneof![Just(0.0), Just(1e9)],
        ) {
            let values: Vec<f64> = values.iter().map(|value| value + offset).collect();
            let secs: Vec<f64> = (0..values.len()).map(|k| 5000.0 + k as f64 / 8.0).collect();
            let mut cuts: Vec<usize> = cuts.iter().map(|cut| *cut.min(&values.len())).collect();
            cuts.extend([0, values.len()]);
            cuts.sort_unstable();
            let part = |pair: &[usize]| {
                let part = pair[0]..pair[1];
                Moments::of(secs[part.clone()].iter().copied().zip(values[part].iter().copied()))
            };
            let moments = cuts.windows(2).map(part).fold(Moments::default(), Moments::merged);
            let whole = describe(&secs, &values);
            prop_assert_eq!(moments.count as usize, whole.map_or(0, |whole| whole.n));
            let Some(whole) = whole else { return Ok(()) };
            prop_assert_eq!((moments.least, moments.greatest), (whole.least, whole.greatest));
            prop_assert!((moments.mean - whole.mean).abs() <= 1e-9 * whole.mean.abs().max(1.0));
            if let (Some(sd), Some(exact)) = (moments.sd(), whole.sd) {
                let tolerance = if offset > 0.0 { 1e-6 } else { 1e-9 };
                prop_assert!((sd - exact).abs() <= tolerance * exact.max(1e-3), "{} {}", sd, exact);
                let secs = moments.times.sqrt();
                let (rise, exact) = (moments.slope_per_sec(), whole.slope_per_sec);
                let off = rise.zip(exact).map_or(0.0, |(rise, exact)| (rise - exact).abs());
                // Each deviation is known to the last bit of the offset; the error of their sum grows with the
                // root of their number.
                let rounding = 1e-9 + offset * f64::EPSILON * moments.count.sqrt();
                prop_assert!(off * secs <= rounding, "{} {}", off, secs);
            }
        }
    }
}
