/// A point with a lower score than this counts as not detected.
const LEAST_SCORE: f64 = 0.3;

/// A point among the channels: `<name>_x`, `<name>_y` [px] and, where known, `<name>_score`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    x: usize,
    y: usize,
    score: Option<usize>,
}

impl Place {
    /// Finds the point with this name.
    pub fn of(name: &str, names: &[&str]) -> Option<Place> {
        let channel = |part: &str| {
            names.iter().position(|it| it.strip_prefix(name).is_some_and(|rest| rest == part))
        };
        Some(Place { x: channel("_x")?, y: channel("_y")?, score: channel("_score") })
    }

    /// The position of the point [px]; NaN where it is not detected.
    pub fn at(self, channels: &[f64]) -> [f64; 2] {
        let number = |place: usize| channels.get(place).copied().unwrap_or(f64::NAN);
        let is_there = self.score.is_none_or(|score| number(score) >= LEAST_SCORE);
        if is_there { [number(self.x), number(self.y)] } else { [f64::NAN; 2] }
    }
}

/// The midpoint between two points.
pub(crate) fn middle(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [f64::midpoint(one[0], other[0]), f64::midpoint(one[1], other[1])]
}

/// The distance between two points.
pub(crate) fn between(one: [f64; 2], other: [f64; 2]) -> f64 {
    (one[0] - other[0]).hypot(one[1] - other[1])
}
