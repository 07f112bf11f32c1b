//! Peaks that are too close to a higher one.

/// Keeps peaks at least `distance` samples apart, preferring higher ones.
pub(super) fn keep_apart(signal: &[f64], indices: &mut Vec<usize>, distance: usize) {
    if distance <= 1 {
        return;
    }
    let mut by_height: Vec<usize> = (0..indices.len()).collect();
    by_height.sort_by(|&one, &other| signal[indices[one]].total_cmp(&signal[indices[other]]));
    let mut stays = vec![true; indices.len()];
    for &peak in by_height.iter().rev() {
        if !stays[peak] {
            continue;
        }
        let is_close = |other: &usize| indices[*other].abs_diff(indices[peak]) < distance;
        (0..peak).rev().take_while(is_close).for_each(|other| stays[other] = false);
        (peak + 1..indices.len()).take_while(is_close).for_each(|other| stays[other] = false);
    }
    let mut stays = stays.into_iter();
    indices.retain(|_| stays.next().unwrap_or(true));
}
