//! Onsets of responses.

/// The longest rise of a sharpened response [s]; most take one.
pub(super) const LONGEST_RISE_SECS: f64 = 3.0;
/// The longest bend at the onset [s].
const BEND_SECS: f64 = 0.25;
/// A rise has begun once it reaches this share of its mean slope.
const STARTED: f64 = 0.25;

/// The trough before a peak (the centre of a flat one); `None` when the signal begins within the rise.
///
/// This is the onset as NeuroKit2 defines it.
pub(super) fn nearest_trough(signal: &[f64], peak: usize) -> Option<usize> {
    let mut end = peak;
    let mut begin = peak;
    while begin > 0 && signal[begin - 1] <= signal[begin] {
        begin -= 1;
        if signal[begin] < signal[end] {
            end = begin;
        }
    }
    (begin > 0).then(|| usize::midpoint(begin, end))
}

/// The bend at which the rise to a peak begins: the sample farthest below the line from the minimum to the
/// peak. `None` when the rise is smaller than the threshold, or begins before the signal.
///
/// The minimum is searched back to where the signal was a threshold higher, so that ripples do not split the rise; the
/// bend excludes slow drift and noise before the response. `signal` must contain no more than the longest rise before
/// the peak.
pub(super) fn onset(signal: &[f64], peak: usize, rate_hz: f64, threshold_us: f64) -> Option<usize> {
    let height = *signal.get(peak)?;
    let mut lowest = peak;
    for place in (0..peak).rev() {
        if signal[place] > signal[lowest] + threshold_us || signal[place] > height {
            break;
        }
        if signal[place] < signal[lowest] {
            lowest = place;
        }
    }
    let steepness = (height - signal[lowest]) / (peak - lowest).max(1) as f64;
    let below = |place: usize| steepness * (place - lowest) as f64 - signal[place];
    let bend = (lowest..peak).reduce(|a, b| if below(b) > below(a) { b } else { a })?;
    let is_risen = |place: &usize| signal[*place] - signal[*place - 1] > STARTED * steepness;
    let most = (BEND_SECS * rate_hz).ceil() as usize;
    let onset = bend - (lowest + 1..=bend).rev().take(most).take_while(is_risen).count();
    // `>=` is false for NaN.
    (height - signal[onset] >= threshold_us && onset > 0).then_some(onset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_trough_is_the_middle_of_a_flat_one() {
        assert_eq!(nearest_trough(&[3.0, 1.0, 1.0, 1.0, 2.0, 2.0, 5.0, 0.0], 6), Some(2));
        assert_eq!(nearest_trough(&[1.0, 1.0, 2.0, 0.0], 2), None);
    }

    #[test]
    fn a_ripple_in_the_rise_does_not_part_it() {
        let rise = [2.0, 0.0, 1.2, 2.0, 1.95, 2.6, 3.0, 0.0];
        assert_eq!(nearest_trough(&rise, 6), Some(4));
        assert_eq!(onset(&rise, 6, 4.0, 0.5), Some(1));
        assert_eq!(onset(&rise, 6, 4.0, 5.0), None);
    }

    #[test]
    fn a_flat_level_with_noise_ends_where_the_rise_begins() {
        let signal = [1.0, 0.0, 0.02, 0.01, 0.02, 0.005, 0.5, 1.0, 0.9];
        assert_eq!(onset(&signal, 7, 4.0, 0.05), Some(5));
    }

    #[test]
    fn what_creeps_upwards_before_is_no_part_of_the_rise() {
        let signal = [0.0, 0.01, 0.02, 0.03, 0.04, 0.3, 0.6, 0.5];
        assert_eq!(onset(&signal, 6, 4.0, 0.05), Some(4));
    }
}
