/// Calls `of` with the sorted `width` values around each value, or fewer at the ends.
pub(super) fn around_each(values: &[f64], width: usize, of: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let half = width / 2;
    let mut sorted: Vec<f64> = Vec::with_capacity(width + 1);
    sorted.extend(values.iter().take(half));
    sorted.sort_unstable_by(f64::total_cmp);
    let around = |centre: usize| {
        let left = centre.checked_sub(half + 1).map(|place| values[place]);
        match (left, values.get(centre + half)) {
            (Some(left), Some(&come)) => replace(&mut sorted, left, come),
            (None, Some(&come)) => sorted.insert(place(&sorted, come), come),
            (Some(left), None) => drop(sorted.remove(place(&sorted, left))),
            (None, None) => {}
        }
        of(&sorted)
    };
    (0..values.len()).map(around).collect()
}

/// The index of a value among sorted ones.
fn place(sorted: &[f64], value: f64) -> usize {
    sorted.partition_point(|each| each.total_cmp(&value).is_lt())
}

/// Replaces one sorted value by another, moving only those in between.
fn replace(sorted: &mut [f64], left: f64, come: f64) {
    let (from, to) = (place(sorted, left), place(sorted, come));
    if from < to {
        sorted.copy_within(from + 1..to, from);
        sorted[to - 1] = come;
    } else {
        sorted.copy_within(to..from, to + 1);
        sorted[to] = come;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn around_each_are_its_neighbours_in_order(
            values in prop::collection::vec((0..9i8).prop_map(f64::from), 0..40),
            width in (0..12usize).prop_map(|half| 2 * half + 1),
        ) {
            let weighed = |sorted: &[f64]| {
                sorted.iter().zip(1u32..).map(|(value, k)| value * f64::from(k)).sum::<f64>()
            };
            let neighbours = |centre: usize| {
                let end = (centre + width / 2 + 1).min(values.len());
                let mut around = values[centre.saturating_sub(width / 2)..end].to_vec();
                around.sort_by(f64::total_cmp);
                weighed(&around)
            };
            let expected: Vec<f64> = (0..values.len()).map(neighbours).collect();
            prop_assert_eq!(around_each(&values, width, weighed), expected);
        }
    }
}
