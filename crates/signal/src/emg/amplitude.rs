//! Time-domain features of a frame.

/// The smallest steps that count [unit of the signal].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thresholds {
    /// The smallest difference of a zero crossing. 0: every change of sign counts.
    pub zero_crossing: f64,
    /// The smallest difference on one side of a slope sign change. 0: every turn counts.
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
        let next = frame.get(1..).unwrap_or_default();
        let after_next = frame.get(2..).unwrap_or_default();
        let crosses =
            |(a, b): (&f64, &f64)| (a * b < 0.0) & ((b - a).abs() >= thresholds.zero_crossing);
        let turns = |((a, b), c): ((&f64, &f64), &f64)| {
            let (rise, fall) = (b - a, b - c);
            (rise * fall > 0.0) & (rise.abs().max(fall.abs()) >= thresholds.slope_change)
        };
        let pairs = || frame.iter().zip(next);
        Sums {
            squares: sum(frame, frame, |a, b| a * b),
            absolutes: sum(frame, frame, |a, _| a.abs()),
            steps: sum(frame, next, |a, b| (b - a).abs()),
            crossings: pairs().map(|pair| u32::from(crosses(pair))).sum(),
            turns: pairs().zip(after_next).map(|triple| u32::from(turns(triple))).sum(),
        }
    }
}

/// The sum over pairs, in four independent partial sums for SIMD.
pub(super) fn sum(one: &[f64], other: &[f64], of: impl Fn(f64, f64) -> f64) -> f64 {
    let count = one.len().min(other.len());
    let (ones, one_rest) = one[..count].as_chunks::<4>();
    let (others, other_rest) = other[..count].as_chunks::<4>();
    let mut parts = [0.0; 4];
    for (one, other) in ones.iter().zip(others) {
        for (part, (&one, &other)) in parts.iter_mut().zip(one.iter().zip(other)) {
            *part += of(one, other);
        }
    }
    let rest = one_rest.iter().zip(other_rest).map(|(&one, &other)| of(one, other));
    parts.iter().sum::<f64>() + rest.sum::<f64>()
}
