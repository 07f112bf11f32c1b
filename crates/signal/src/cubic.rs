//! Cubic spline interpolation.

use crate::error::{SignalError, checked, checked_rate_hz};
use crate::gaps::is_usable;

/// A curve of cubic pieces through points, with continuous slope and curvature.
///
/// Equals `scipy.interpolate.CubicSpline`. De Boor (1978), A Practical Guide to Splines, chapter IV. It
/// overshoots at steps and outliers: remove artefacts from the series first.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicSpline {
    x: Vec<f64>,
    y: Vec<f64>,
    /// The slope at each point.
    slopes: Vec<f64>,
}

/// The boundary condition of a spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// The first two pieces form one cubic, and so do the last two: SciPy's default.
    NotAKnot,
    /// Zero curvature at the ends.
    Natural,
}

impl CubicSpline {
    /// Fits the curve through `y` at the ascending `x`.
    ///
    /// Points that are not usable are left out. Two points give a line, three with [`Ends::NotAKnot`] a
    /// parabola. Returns an error with fewer than two points, when `x` does not ascend, or when the lengths
    /// differ.
    pub fn new(x: &[f64], y: &[f64], ends: Ends) -> Result<CubicSpline, SignalError> {
        let (left, right) = (x.len(), y.len());
        if left != right {
            return Err(SignalError::Lengths { left, right });
        }
        let usable = x.iter().copied().zip(y.iter().copied());
        let (x, y): (Vec<f64>, Vec<f64>) =
            usable.filter(|(x, y)| is_usable(*x) && is_usable(*y)).unzip();
        if x.len() < 2 {
            return Err(SignalError::TooShort { count: x.len(), least: 2 });
        }
        if let Some(before) = x.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(SignalError::Order { index: before + 1 });
        }
        let pieces = Pieces::new(&x, &y);
        let slopes = slopes(&pieces, ends);
        let steepness = slopes.iter().map(|slope| slope.abs()).fold(0.0, f64::max);
        let is_finite = slopes.iter().all(|slope| slope.is_finite());
        if is_finite && pieces.widths.iter().all(|width| is_usable(width * steepness)) {
            Ok(CubicSpline { x, y, slopes })
        } else {
            Err(SignalError::Overflow)
        }
    }

    /// The curve's value at `x`; `None` outside the points.
    pub fn at(&self, x: f64) -> Option<f64> {
        let (first, last) = (self.x[0], self.x[self.x.len() - 1]);
        if !(first..=last).contains(&x) {
            return None;
        }
        let piece = self.x.partition_point(|&knot| knot <= x).clamp(1, self.x.len() - 1) - 1;
        Some(self.on_piece(piece, x))
    }

    /// Samples the curve at `begin` + k / `rate`, for k = 0, 1, …, up to the last point.
    ///
    /// Makes an evenly sampled series from an uneven one, for example beat intervals at 4 Hz. Returns an
    /// error for an invalid rate, when `begin` lies outside the points, or for more than 100 million
    /// samples.
    ///
    /// ```
    /// use teampulse_signal::cubic::{CubicSpline, Ends};
    /// let spline = CubicSpline::new(&[0.0, 0.8, 1.7, 2.5], &[0.0, 1.6, 3.4, 5.0], Ends::NotAKnot)?;
    /// let even = spline.resampled(0.0, 4.0)?;
    /// assert_eq!(even.len(), 11);
    /// assert!((even[10] - 5.0).abs() < 1e-12);
    /// # Ok::<(), teampulse_signal::error::SignalError>(())
    /// ```
    pub fn resampled(&self, begin: f64, rate: f64) -> Result<Vec<f64>, SignalError> {
        let rate = checked_rate_hz(rate)?;
        let (first, last) = (self.x[0], self.x[self.x.len() - 1]);
        checked("begin", begin, (first, last))?;
        // A grid point that misses the last point only by rounding still belongs to it.
        let steps = ((last - begin) * rate * (1.0 + 1e-12)).floor();
        checked("number of samples", steps + 1.0, (1.0, 1e8))?;
        let mut piece = 0;
        let height = |k: usize| {
            let x = (begin + k as f64 / rate).min(last);
            while piece + 2 < self.x.len() && self.x[piece + 1] <= x {
                piece += 1;
            }
            self.on_piece(piece, x)
        };
        Ok((0..=steps as usize).map(height).collect())
    }

    fn on_piece(&self, piece: usize, x: f64) -> f64 {
        let (from, to) = (piece, piece + 1);
        let width = self.x[to] - self.x[from];
        let share = (x - self.x[from]) / width;
        let rise = self.y[to] - self.y[from];
        let (begin, end) = (self.slopes[from] * width, self.slopes[to] * width);
        let cubic = begin + end - 2.0 * rise;
        ((cubic * share + rise - begin - cubic) * share + begin) * share + self.y[from]
    }
}

/// The width and mean slope of each piece.
struct Pieces {
    widths: Vec<f64>,
    rises: Vec<f64>,
}

impl Pieces {
    fn new(x: &[f64], y: &[f64]) -> Pieces {
        let widths: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let heights = y.windows(2).map(|pair| pair[1] - pair[0]);
        Pieces {
            rises: heights.zip(&widths).map(|(height, width)| height / width).collect(),
            widths,
        }
    }

    fn reversed(&self) -> Pieces {
        let reversed = |values: &[f64]| values.iter().rev().copied().collect();
        Pieces { widths: reversed(&self.widths), rises: reversed(&self.rises) }
    }

    /// The equation of the slope at the start: diagonal, off-diagonal, right-hand side.
    fn first_row(&self, ends: Ends) -> Row {
        let (width, rise) = (self.widths[0], self.rises[0]);
        if ends == Ends::Natural {
            return Row { before: 0.0, here: 2.0, after: 1.0, right: 3.0 * rise };
        }
        let (next_width, next_rise) = (self.widths[1], self.rises[1]);
        let both = width + next_width;
        let right = (width + 2.0 * both) * next_width * rise + width * width * next_rise;
        Row { before: 0.0, here: next_width, after: both, right: right / both }
    }

    /// The equations of equal curvature on both sides of each inner point.
    fn inner_rows(&self) -> impl Iterator<Item = Row> {
        self.widths.windows(2).zip(self.rises.windows(2)).map(|(width, rise)| Row {
            before: width[1],
            here: 2.0 * (width[0] + width[1]),
            after: width[0],
            right: 3.0 * (width[1] * rise[0] + width[0] * rise[1]),
        })
    }
}

/// before · sₖ₋₁ + here · sₖ + after · sₖ₊₁ = right.
struct Row {
    before: f64,
    here: f64,
    after: f64,
    right: f64,
}

fn slopes(pieces: &Pieces, ends: Ends) -> Vec<f64> {
    match (pieces.rises.as_slice(), ends) {
        ([rise], _) => vec![*rise; 2],
        ([first, second], Ends::NotAKnot) => parabola(&pieces.widths, *first, *second).to_vec(),
        _ => {
            let last = pieces.reversed().first_row(ends);
            let last = Row { before: last.after, after: 0.0, ..last };
            let first = [pieces.first_row(ends)];
            solved(first.into_iter().chain(pieces.inner_rows()).chain([last]))
        }
    }
}

/// The slopes of the parabola through three points.
fn parabola(widths: &[f64], first: f64, second: f64) -> [f64; 3] {
    let bend = (second - first) / (widths[0] + widths[1]);
    [first - bend * widths[0], first + bend * widths[0], second + bend * widths[1]]
}

/// Solves the tridiagonal system by Thomas's algorithm.
fn solved(rows: impl Iterator<Item = Row>) -> Vec<f64> {
    let mut eliminated: Vec<(f64, f64)> = Vec::new();
    let (mut after, mut right) = (0.0, 0.0);
    for row in rows {
        let pivot = row.here - row.before * after;
        (after, right) = (row.after / pivot, (row.right - row.before * right) / pivot);
        eliminated.push((after, right));
    }
    let mut slope = 0.0;
    for (after, right) in eliminated.iter_mut().rev() {
        slope = *right - *after * slope;
        *right = slope;
    }
    eliminated.into_iter().map(|(_, slope)| slope).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_cubic_is_found_again() {
        let x = [0.0, 0.5, 2.0, 2.25, 4.0, 7.0];
        let cubic = |x: f64| ((0.5 * x - 2.0) * x + 1.0) * x - 3.0;
        let spline = CubicSpline::new(&x, &x.map(cubic), Ends::NotAKnot).unwrap();
        for at in [0.0, 0.1, 1.9, 3.0, 6.5, 7.0] {
            assert!((spline.at(at).unwrap() - cubic(at)).abs() < 1e-12);
        }
        assert_eq!(spline.at(7.1), None);
        assert_eq!(spline.at(f64::NAN), None);
    }

    #[test]
    fn what_is_no_series_is_refused() {
        let new = |x: &[f64], y: &[f64]| CubicSpline::new(x, y, Ends::NotAKnot).unwrap_err();
        assert_eq!(new(&[0.0], &[1.0]), SignalError::TooShort { count: 1, least: 2 });
        assert_eq!(new(&[0.0, 0.0], &[1.0, 2.0]), SignalError::Order { index: 1 });
        assert_eq!(new(&[0.0, 1.0], &[1.0]), SignalError::Lengths { left: 2, right: 1 });
    }

    proptest! {
        #[test]
        fn any_points_give_a_curve_or_an_error(
            mut x in prop::collection::vec(prop::num::f64::ANY, 0..20),
            y in prop::collection::vec(prop::num::f64::ANY, 20),
        ) {
            x.sort_by(f64::total_cmp);
            for ends in [Ends::NotAKnot, Ends::Natural] {
                if let Ok(spline) = CubicSpline::new(&x, &y[..x.len()], ends) {
                    let (first, last) = (spline.x[0], spline.x[spline.x.len() - 1]);
                    prop_assert!(spline.at(first.midpoint(last)).unwrap().is_finite());
                    let even = spline.resampled(first, 1000.0 / (last - first));
                    prop_assert!(even.is_err() || even.unwrap().iter().all(|each| each.is_finite()));
                }
            }
        }

        #[test]
        fn it_goes_through_its_points_and_a_grid_reads_it(
            steps in prop::collection::vec((0.1..3.0f64, -5.0..5.0f64), 2..40),
        ) {
            let x: Vec<f64> = steps.iter().scan(0.0, |x, step| { *x += step.0; Some(*x) }).collect();
            let y: Vec<f64> = steps.iter().map(|step| step.1).collect();
            for ends in [Ends::NotAKnot, Ends::Natural] {
                let spline = CubicSpline::new(&x, &y, ends).unwrap();
                for (x, y) in x.iter().zip(&y) {
                    prop_assert!((spline.at(*x).unwrap() - y).abs() < 1e-8);
                }
                for (k, height) in spline.resampled(x[0], 4.0).unwrap().into_iter().enumerate() {
                    let at = (x[0] + k as f64 / 4.0).min(x[x.len() - 1]);
                    prop_assert!((spline.at(at).unwrap() - height).abs() < 1e-8);
                }
            }
        }
    }
}
