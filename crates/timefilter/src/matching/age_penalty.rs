//! The penalty for lateness, computed as ROS does, to the nanosecond.

const NANOS_PER_SEC: i64 = 1_000_000_000;

/// A penalty that makes an earlier set preferable to a slightly shorter later one.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgePenalty {
    factor: f64,
}

impl AgePenalty {
    /// Creates a penalty that weights lateness by 1 + `penalty`; negative and NaN count as 0.
    pub(super) fn new(penalty: f64) -> AgePenalty {
        AgePenalty { factor: 1.0 + penalty.max(0.0) }
    }

    /// Whether the weighted lateness is at least the gain.
    #[inline]
    pub(super) fn outweighs(self, late_nanos: i64, gain_nanos: i64) -> bool {
        if late_nanos == 0 {
            return gain_nanos <= 0;
        }
        let product = late_nanos as f64 * self.factor;
        let difference = product - gain_nanos as f64;
        // ROS's rounding error is far below this; only closer values need the exact computation.
        if difference.abs() > 1.0 + product.abs() * 1e-14 {
            return difference > 0.0;
        }
        self.weigh(late_nanos) >= gain_nanos
    }

    /// The weighted lateness [ns].
    ///
    /// Like the product of a `ros::Duration` and a double: seconds and nanoseconds become one double, and the product
    /// is split into whole seconds and rounded nanoseconds again. The result is off by up to a few nanoseconds, which
    /// affects the sets that are found.
    #[cold]
    fn weigh(self, late_nanos: i64) -> i64 {
        let secs = late_nanos.div_euclid(NANOS_PER_SEC);
        let nanos = late_nanos.rem_euclid(NANOS_PER_SEC);
        let product = (secs as f64 + 1e-9 * nanos as f64) * self.factor;
        let whole = floor(product);
        let rest = round((product - whole as f64) * 1e9);
        whole.saturating_mul(NANOS_PER_SEC).saturating_add(rest)
    }
}

/// `f64::floor`, without a call to the C library on processors that lack the instruction.
fn floor(x: f64) -> i64 {
    let cut = x as i64;
    cut.saturating_sub(i64::from(cut as f64 > x))
}

/// `f64::round` for non-negative values, without a call to the C library.
fn round(x: f64) -> i64 {
    let cut = x as i64;
    cut.saturating_add(i64::from(x - cut as f64 >= 0.5))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn any_lateness_counts_something() {
        for penalty in [0.0, 0.1, 1e300, f64::INFINITY, f64::NAN, -5.0] {
            for late_nanos in [i64::MIN, -1, 0, 1, i64::MAX] {
                AgePenalty::new(penalty).outweighs(late_nanos, i64::MAX);
                AgePenalty::new(penalty).outweighs(late_nanos, late_nanos);
            }
        }
    }

    proptest! {
        #[test]
        fn it_is_near_the_product(late_nanos in -1_i64 << 50..1 << 50, penalty in 0.0..2.0) {
            let exact = late_nanos as f64 * (1.0 + penalty);
            let weighed = AgePenalty::new(penalty).weigh(late_nanos);
            prop_assert!((weighed as f64 - exact).abs() <= 1.0 + exact.abs() * 1e-15);
        }

        #[test]
        fn the_short_cut_decides_as_the_rounding_does(
            late_nanos in -1_i64 << 60..1 << 60,
            magnitude in 0..60_u32,
            penalty in 0.0..2.0,
            off_nanos in -5_i64..=5,
        ) {
            let penalty = AgePenalty::new(penalty);
            let late_nanos = late_nanos >> magnitude;
            let gain_nanos = penalty.weigh(late_nanos) + off_nanos;
            prop_assert_eq!(penalty.outweighs(late_nanos, gain_nanos), off_nanos <= 0);
        }

        #[test]
        fn floor_and_round_are_those_of_the_standard_library(x in -1e18..1e18) {
            prop_assert_eq!(floor(x), x.floor() as i64);
            prop_assert_eq!(round(x.abs()), x.abs().round() as i64);
        }
    }
}
