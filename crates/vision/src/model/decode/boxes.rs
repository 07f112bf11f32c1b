//! Code shared by the detectors: overlaps, and the values of the most confident detection.

use super::Detection;

/// The largest number of detections that are compared with each other.
const MOST: usize = 1000;

/// Returns the names and units of the values of the most confident detection, and of its points.
pub(super) fn channels(points: &[&str]) -> Vec<(String, &'static str)> {
    let sides = [("left", "px"), ("top", "px"), ("width", "px"), ("height", "px")];
    let rest = [("score", "1"), ("count", "1")];
    let parts = sides.into_iter().chain(rest).map(|(name, unit)| (name.to_owned(), unit));
    let points = points.iter().flat_map(|name| [format!("{name}_x"), format!("{name}_y")]);
    parts.chain(points.map(|name| (name, "px"))).collect()
}

/// Returns the values of the most confident detection, the number of detections, and its points. Without a detection,
/// only the count has a value, which is 0.
pub(super) fn values(found: &[Detection]) -> Vec<f64> {
    let count = found.len() as f64;
    let Some(best) = found.first() else {
        return [[f64::NAN; 5].as_slice(), &[count]].concat();
    };
    let sides = [best.left, best.top, best.width, best.height, best.score].map(f64::from);
    let points = best.points.iter().flatten().map(|place| f64::from(*place));
    sides.into_iter().chain([count]).chain(points).collect()
}

/// Suppresses non-maximum detections: drops each one that overlaps a more confident one by more than `most_overlap`
/// (intersection over union). The most confident comes first.
pub(super) fn apart(mut found: Vec<Detection>, most_overlap: f32) -> Vec<Detection> {
    found.retain(|each| each.score.is_finite() && area(each).is_finite());
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.truncate(MOST);
    let mut kept: Vec<Detection> = Vec::new();
    for each in found {
        if kept.iter().all(|other| overlap(other, &each) <= most_overlap) {
            kept.push(each);
        }
    }
    kept
}

fn area(part: &Detection) -> f32 {
    part.width * part.height
}

fn overlap(a: &Detection, b: &Detection) -> f32 {
    let side = |a: f32, long: f32, b: f32, other: f32| (a + long).min(b + other) - a.max(b);
    let width = side(a.left, a.width, b.left, b.width).max(0.0);
    let height = side(a.top, a.height, b.top, b.height).max(0.0);
    let both = width * height;
    both / (area(a) + area(b) - both).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(left: f32, score: f32) -> Detection {
        Detection { left, top: 0.0, width: 10.0, height: 10.0, score, points: Vec::new() }
    }

    #[test]
    fn of_parts_that_overlap_the_most_certain_is_kept() {
        let found = vec![part(0.0, 0.5), part(1.0, 0.9), part(30.0, 0.6), part(2.0, f32::NAN)];
        let lefts: Vec<f32> = apart(found, 0.3).iter().map(|each| each.left).collect();
        assert_eq!(lefts, [1.0, 30.0]);
        // Five of ten columns overlap: 50 of 150 pixels.
        assert!((overlap(&part(0.0, 1.0), &part(5.0, 1.0)) - 1.0 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn without_a_part_the_count_is_zero_and_all_else_unknown() {
        let values = values(&[]);
        assert!(values[..5].iter().all(|value| value.is_nan()) && values[5] == 0.0);
    }
}
