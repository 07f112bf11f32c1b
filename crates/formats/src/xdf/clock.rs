//! A straight line through points, for clocks and for evenly sampled stamps.

/// A line through points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    center: f64,
    at_center: f64,
    slope: f64,
}

impl Fit {
    /// The least-squares line through points; it is level through a single point. `None` if there are no points.
    pub(super) fn of(points: &[(f64, f64)]) -> Option<Fit> {
        if points.is_empty() {
            return None;
        }
        let count = points.len() as f64;
        let center = points.iter().map(|point| point.0).sum::<f64>() / count;
        let at_center = points.iter().map(|point| point.1).sum::<f64>() / count;
        let squares: f64 = points.iter().map(|point| (point.0 - center).powi(2)).sum();
        let products: f64 =
            points.iter().map(|point| (point.0 - center) * (point.1 - at_center)).sum();
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        Some(Fit { center, at_center, slope })
    }

    /// The least-squares line without points that are off by more than five median deviations, such as delayed probes.
    pub(super) fn without_outliers(points: &[(f64, f64)]) -> Option<Fit> {
        let first = Fit::of(points)?;
        let off = |point: &(f64, f64)| (point.1 - first.at(point.0)).abs();
        let mut deviations: Vec<f64> = points.iter().map(off).collect();
        deviations.sort_by(f64::total_cmp);
        let limit = (5.0 * deviations[deviations.len() / 2]).max(1e-6);
        let kept: Vec<_> = points.iter().copied().filter(|point| off(point) <= limit).collect();
        Fit::of(&kept)
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        self.at_center + self.slope * (x - self.center)
    }

    pub(super) fn slope(&self) -> f64 {
        self.slope
    }
}
