//! The intervals that features correct.

use std::collections::BTreeSet;

use teampulse_core::time::Time;
use teampulse_signal::intervals::{Beats, Correction, PLAUSIBLE_MS};

/// Whether the interval before each beat is corrected by features; false if there is none. A beat without an interval
/// starts a new stretch.
pub(super) fn corrected(beats: &[(Time, f64)]) -> Vec<bool> {
    let goes_on = |_: &(Time, f64), next: &(Time, f64)| !next.1.is_nan();
    beats.chunk_by(goes_on).flat_map(in_stretch).collect()
}

fn in_stretch(beats: &[(Time, f64)]) -> Vec<bool> {
    let Some((first, _)) = beats.first() else { return Vec::new() };
    // If the first beat has an interval, the beat that starts it is not among them.
    let before_secs = beats[0].1 / 1e3;
    let before_secs = Some(-before_secs).filter(|secs| secs.is_finite());
    let secs = beats.iter().map(|(at, _)| at.secs_since(*first));
    let secs: Vec<f64> = before_secs.into_iter().chain(secs).collect();
    let corrected = Correction::default().correct(&Beats::detected(&secs));
    let (kept_secs, intervals_ms) = (corrected.beats.times_secs(), corrected.beats.intervals_ms());
    let pairs = kept_secs.windows(2).zip(&intervals_ms);
    let sound = pairs.filter(|(_, interval_ms)| PLAUSIBLE_MS.contains(*interval_ms));
    let sound: BTreeSet<[u64; 2]> =
        sound.map(|(pair, _)| [pair[0].to_bits(), pair[1].to_bits()]).collect();
    let is_sound = |pair: &[f64]| sound.contains(&[pair[0].to_bits(), pair[1].to_bits()]);
    let of_pairs: Vec<bool> = secs.windows(2).map(|pair| !is_sound(pair)).collect();
    let has_first = secs.len() > beats.len();
    std::iter::repeat_n(false, usize::from(!has_first)).chain(of_pairs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slightly irregular beats; the one with this number is late by this much [s].
    fn beats(late: Option<(u32, f64)>, without: Option<u32>) -> Vec<(Time, f64)> {
        let at = |k: u32| {
            let usual_secs = 0.8 * f64::from(k) + 0.02 * f64::from(k * k % 7);
            usual_secs + late.filter(|(beat, _)| *beat == k).map_or(0.0, |(_, secs)| secs)
        };
        let times: Vec<f64> = (0..100).filter(|k| Some(*k) != without).map(at).collect();
        let interval = |k: usize| if k == 0 { f64::NAN } else { 1e3 * (times[k] - times[k - 1]) };
        let time = |secs: f64| Time::from_nanos((secs * 1e9).round() as i64);
        times.iter().enumerate().map(|(k, secs)| (time(*secs), interval(k))).collect()
    }

    fn places(beats: &[(Time, f64)]) -> Vec<usize> {
        let corrected = corrected(beats);
        assert_eq!(corrected.len(), beats.len());
        corrected.into_iter().enumerate().filter(|(_, is)| *is).map(|(place, _)| place).collect()
    }

    #[test]
    fn what_is_as_usual_is_not_corrected() {
        assert_eq!(places(&beats(None, None)), [0; 0]);
    }

    #[test]
    fn both_intervals_of_an_ectopic_beat_and_the_one_of_a_missed_beat_are_corrected() {
        assert_eq!(places(&beats(Some((50, 0.3)), None)), [50, 51]);
        assert_eq!(places(&beats(None, Some(50))), [50]);
    }

    #[test]
    fn nothing_is_judged_across_a_gap() {
        let (mut torn, later) = (beats(None, None), 60.0);
        let shifted = beats(None, None).into_iter().map(|(at, rr_ms)| {
            (Time::from_nanos(at.nanos() + (later + 80.0) as i64 * 1_000_000_000), rr_ms)
        });
        torn.extend(shifted);
        assert_eq!(places(&torn), [0; 0]);
    }
}
