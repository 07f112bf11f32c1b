//! A robust straight line through pairs, and its uncertainty.

/// Pairs further from the line than this many spreads, and than the distance below [s], are left out.
const OUTLIER_SPREADS: f64 = 4.0;
const OUTLIER_SECS: f64 = 0.004;
/// The ratio of the standard deviation to the median absolute deviation of a normal distribution.
const SIGMA_FROM_MAD: f64 = 1.4826;
/// Pairs within this time have correlated errors [s].
const BLOCK_SECS: f64 = 60.0;
/// The minimum number of blocks from which the error of the line is estimated.
const LEAST_BLOCKS: usize = 4;
/// The 97.5 % quantile of Student's t for 1, 2, 3, … degrees of freedom.
const STUDENT_T: [f64; 10] = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23];
/// The same quantile for more degrees of freedom.
const STUDENT_T_MORE: f64 = 2.1;

/// A line through pairs; times in seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct RobustLine {
    pub(super) center: f64,
    pub(super) at_center: f64,
    pub(super) slope: f64,
    pub(super) has_slope: bool,
    /// Half-widths of the 95 % intervals of the value at the center, and of the slope.
    pub(super) center_95: f64,
    pub(super) slope_95: f64,
    pub(super) spread: f64,
    /// The width of the band around the line that contains the pairs that are kept.
    pub(super) window: f64,
    pub(super) count: usize,
}

impl RobustLine {
    /// The line through points, with slope zero where they span less than `slope_from`. `None` without points.
    pub(super) fn through(points: &[(f64, f64)], slope_from: f64) -> Option<RobustLine> {
        let span = points.last()?.0 - points.first()?.0;
        let has_slope = span >= slope_from && points.len() > 2;
        let mut kept = points.to_vec();
        let mut line = RobustLine::level(&kept);
        for _ in 0..8 {
            line = if has_slope { line.tilted(&kept) } else { RobustLine::level(&kept) };
            line.spread = line.spread_of(&kept);
            let limit = (OUTLIER_SPREADS * line.spread).max(OUTLIER_SECS);
            let before = kept.len();
            kept = points.iter().copied().filter(|point| line.off(point).abs() <= limit).collect();
            if kept.len() == before || kept.is_empty() {
                break;
            }
        }
        if kept.is_empty() {
            return None;
        }
        line.count = kept.len();
        let off = || kept.iter().map(|point| line.off(point));
        line.window = off().fold(f64::MIN, f64::max) - off().fold(f64::MAX, f64::min);
        Some(line.judged(&kept))
    }

    pub(super) fn at(&self, secs: f64) -> f64 {
        self.at_center + self.slope * (secs - self.center)
    }

    fn off(&self, point: &(f64, f64)) -> f64 {
        point.1 - self.at(point.0)
    }

    fn level(points: &[(f64, f64)]) -> RobustLine {
        let center = mean(points.iter().map(|point| point.0));
        let at_center = median(points.iter().map(|point| point.1));
        let (center_95, slope_95, spread) = (0.0, 0.0, 0.0);
        RobustLine {
            center,
            at_center,
            slope: 0.0,
            has_slope: false,
            center_95,
            slope_95,
            spread,
            window: 0.0,
            count: points.len(),
        }
    }

    /// The least-squares line.
    fn tilted(self, points: &[(f64, f64)]) -> RobustLine {
        let center = mean(points.iter().map(|point| point.0));
        let at_center = mean(points.iter().map(|point| point.1));
        let squares: f64 = points.iter().map(|point| (point.0 - center).powi(2)).sum();
        let products: f64 =
            points.iter().map(|point| (point.0 - center) * (point.1 - at_center)).sum();
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        RobustLine { center, at_center, slope, has_slope: true, ..self }
    }

    fn spread_of(&self, points: &[(f64, f64)]) -> f64 {
        SIGMA_FROM_MAD * median(points.iter().map(|point| self.off(point).abs()))
    }

    /// Adds the line's uncertainty, estimated from the means of blocks.
    fn judged(mut self, points: &[(f64, f64)]) -> RobustLine {
        let block_of = |point: &(f64, f64)| (point.0 / BLOCK_SECS).floor() as i64;
        let blocks: Vec<(f64, f64)> = points
            .chunk_by(|a, b| block_of(a) == block_of(b))
            .map(|block| {
                (
                    mean(block.iter().map(|point| point.0)),
                    mean(block.iter().map(|point| self.off(point))),
                )
            })
            .collect();
        let used = if self.has_slope { 2 } else { 1 };
        let (parts, count) = if blocks.len() >= LEAST_BLOCKS {
            (blocks.clone(), blocks.len())
        } else {
            (points.iter().map(|point| (point.0, self.off(point))).collect(), points.len())
        };
        if count <= used {
            return self;
        }
        let t = STUDENT_T.get(count - used - 1).copied().unwrap_or(STUDENT_T_MORE);
        let sigma =
            (parts.iter().map(|part| part.1.powi(2)).sum::<f64>() / (count - used) as f64).sqrt();
        self.center_95 = t * sigma / (count as f64).sqrt();
        let squares: f64 = parts.iter().map(|part| (part.0 - self.center).powi(2)).sum();
        self.slope_95 = if squares > 0.0 { t * sigma / squares.sqrt() } else { 0.0 };
        self
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// The median; 0 for an empty slice.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2).copied().unwrap_or(0.0);
    let lower = values.len().checked_sub(1).and_then(|last| values.get(last / 2)).copied();
    f64::midpoint(upper, lower.unwrap_or(0.0))
}
