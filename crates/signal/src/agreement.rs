//! Agreement of detected events with an expert's annotations.

/// Agreement of detected events with true ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    /// The number of true events that were detected.
    pub hits: usize,
    /// The number of false detections.
    pub extra: usize,
    /// The number of true events that were missed.
    pub missed: usize,
    /// The median delay of detected events after their annotations, in the unit of the positions; NaN without
    /// a hit.
    pub median_offset: f64,
}

/// Pairs true events with detected ones at most `within` apart, each at most once.
///
/// Both are positions in one unit, samples or seconds; those that are not finite are left out. From left to
/// right, each true event is paired with the nearest detected one: the rule of the beat-by-beat comparison
/// of ANSI/AAMI EC57, at 150 ms for heartbeats.
///
/// ```
/// use teampulse_signal::agreement::matched;
/// let agreement = matched(&[100.0, 200.0, 300.0], &[101.0, 203.0, 250.0], 10.0);
/// assert_eq!((agreement.hits, agreement.extra, agreement.missed), (2, 1, 1));
/// assert_eq!(agreement.f1(), 2.0 / 3.0);
/// ```
pub fn matched(truth: &[f64], found: &[f64], within: f64) -> Agreement {
    let [truth, found] = [truth, found].map(ascending);
    let (mut true_index, mut index) = (0, 0);
    let mut offsets = Vec::new();
    while let (Some(event), Some(place)) = (truth.get(true_index), found.get(index)) {
        let offset = place - event;
        let next_is_nearer = found.get(index + 1).is_some_and(|n| (n - event).abs() < offset.abs());
        if offset.abs() > within {
            if offset < 0.0 { index += 1 } else { true_index += 1 }
        } else if next_is_nearer {
            index += 1;
        } else {
            offsets.push(offset);
            (true_index, index) = (true_index + 1, index + 1);
        }
    }
    let hits = offsets.len();
    let median_offset = crate::robust::median(&offsets).unwrap_or(f64::NAN);
    Agreement { hits, extra: found.len() - hits, missed: truth.len() - hits, median_offset }
}

impl Agreement {
    /// The share of true events that were detected [0..1]; NaN without true events.
    pub fn sensitivity(&self) -> f64 {
        self.hits as f64 / (self.hits + self.missed) as f64
    }

    /// The share of detected events that are true [0..1]; NaN without detected events.
    pub fn precision(&self) -> f64 {
        self.hits as f64 / (self.hits + self.extra) as f64
    }

    /// The harmonic mean of sensitivity and precision [0..1]; NaN without any events.
    pub fn f1(&self) -> f64 {
        2.0 * self.hits as f64 / (2 * self.hits + self.extra + self.missed) as f64
    }
}

fn ascending(places: &[f64]) -> Vec<f64> {
    let mut places: Vec<f64> = places.iter().copied().filter(|place| place.is_finite()).collect();
    places.sort_unstable_by(f64::total_cmp);
    places
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_event_is_found_once() {
        let agreement = matched(&[100.0], &[99.0, 100.0, 101.0], 10.0);
        assert_eq!((agreement.hits, agreement.extra, agreement.missed), (1, 2, 0));
        assert_eq!(agreement.median_offset, 0.0);
    }

    #[test]
    fn without_events_there_is_nothing_to_agree_on() {
        assert!(matched(&[], &[], 1.0).f1().is_nan());
        assert_eq!(matched(&[1.0], &[], 1.0).f1(), 0.0);
        assert_eq!(matched(&[f64::NAN], &[f64::INFINITY], 1.0).extra, 0);
    }

    proptest! {
        #[test]
        fn every_event_is_counted_once(
            truth in prop::collection::vec(0.0..1e3, 0..50),
            found in prop::collection::vec(0.0..1e3, 0..50),
            within in 0.0..50.0,
        ) {
            let agreement = matched(&truth, &found, within);
            prop_assert_eq!(agreement.hits + agreement.missed, truth.len());
            prop_assert_eq!(agreement.hits + agreement.extra, found.len());
        }
    }
}
