//! Pulse arrival time: the delay from a heartbeat in an ECG to its pulse wave at the site of a PPG.
//!
//! It falls with rising blood pressure and stiffer arteries: a measure of sympathetic arousal within one
//! person and one placement of the sensor. It includes the pre-ejection period (Mukkamala et al. 2015,
//! doi:10.1109/TBME.2015.2441951), so it is not the transit time.
//!
//! Both signals must be on one clock: an offset between two devices, such as 30 ms between two Bluetooth
//! straps, is part of the result. A constant offset does not affect differences within one recording.
//!
//! ```
//! use teampulse_signal::arrival::{ArrivalLimits, arrivals, summary};
//!
//! // A beat every 0.8 s, and the foot of its pulse a quarter of a second later.
//! let beats_secs: Vec<f64> = (0..30).map(|k| 0.8 * f64::from(k)).collect();
//! let feet_secs: Vec<f64> = beats_secs.iter().map(|beat| beat + 0.25).collect();
//!
//! let arrivals = arrivals(&beats_secs, &feet_secs, ArrivalLimits::default())?;
//! assert_eq!(arrivals.len(), 30);
//! let summary = summary(&beats_secs, &arrivals, 0.0..24.0).expect("each beat has its pulse");
//! assert!((summary.median_ms - 250.0).abs() < 1e-6 && summary.share == 1.0);
//! # Ok::<(), teampulse_signal::error::SignalError>(())
//! ```

use std::ops::Range;

use crate::analysis::Reason;
use crate::error::{SignalError, checked};
use crate::robust::{SIGMA_FROM_MAD, mad, median};

/// The longest arrival time supported [s].
const LONGEST_SECS: f64 = 2.0;
/// The fewest arrivals for a summary.
const LEAST_COUNT: usize = 5;
/// The smallest share of beats with a pulse for a summary.
const LEAST_SHARE: f64 = 0.5;
/// A wider spread means that the pulses do not belong to the beats [ms]: at rest it is 5 to 20 ms, and
/// random arrivals between the default limits have 150 ms.
const MOST_SPREAD_MS: f64 = 50.0;

/// The range of possible arrival times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrivalLimits {
    /// The shortest arrival time [s].
    pub from_secs: f64,
    /// The longest arrival time [s].
    pub to_secs: f64,
}

impl Default for ArrivalLimits {
    /// From 0.1 s at the ear to 0.5 s at the toe.
    fn default() -> ArrivalLimits {
        ArrivalLimits { from_secs: 0.1, to_secs: 0.5 }
    }
}

/// A heartbeat and the arrival of its pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The time of the R peak [s].
    pub beat_secs: f64,
    /// The time from the R peak to the foot of the pulse [ms].
    pub arrival_ms: f64,
}

/// The arrival times of a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// The median arrival time [ms].
    pub median_ms: f64,
    /// The spread of the arrival times, 1.4826 · MAD [ms].
    pub spread_ms: f64,
    /// The share of the beats whose pulse was found [0..1].
    pub share: f64,
}

/// Finds for each beat the first foot of a pulse within the limits, if there is one.
///
/// `beats_secs` are the R peaks of an ECG, `feet_secs` the feet of pulses
/// ([`Pulse::onset`](crate::ppg::Pulse), the intersection of tangents, which is less disturbed by reflected
/// waves than the peak), both [s] on one clock. They are sorted by time; those that are not finite are
/// left out. A foot belongs to the last beat that can have caused it, so a missed pulse is not replaced by that
/// of the next beat.
///
/// Returns an error unless 0 ≤ from < to ≤ 2 s.
pub fn arrivals(
    beats_secs: &[f64],
    feet_secs: &[f64],
    limits: ArrivalLimits,
) -> Result<Vec<Arrival>, SignalError> {
    let to_secs = checked("the longest arrival time [s]", limits.to_secs, (0.0, LONGEST_SECS))?;
    let from_secs = checked("the shortest arrival time [s]", limits.from_secs, (0.0, to_secs))?;
    let (beats, feet) = (ascending(beats_secs), ascending(feet_secs));
    let arrival = |(index, &beat_secs): (usize, &f64)| {
        let first = feet.partition_point(|foot| *foot < beat_secs + from_secs);
        let foot = *feet.get(first)?;
        let is_of_next = beats.get(index + 1).is_some_and(|next| foot >= next + from_secs);
        let arrival_ms = (foot - beat_secs) * 1e3;
        (foot <= beat_secs + to_secs && !is_of_next).then_some(Arrival { beat_secs, arrival_ms })
    };
    Ok(beats.iter().enumerate().filter_map(arrival).collect())
}

/// Summarises the arrival times of the beats within a window [s].
///
/// The reason is `Short` with fewer than five beats in the window, `Gap` when fewer than half of them have a
/// pulse, and `Quality` when the arrivals scatter by more than 50 ms: then pulses and beats do not belong
/// together, as with two people's signals, a wrong clock, or motion taken for pulses.
pub fn summary(
    beats_secs: &[f64],
    arrivals: &[Arrival],
    window_secs: Range<f64>,
) -> Result<Summary, Reason> {
    let beats = beats_secs.iter().filter(|beat| window_secs.contains(beat)).count();
    let inside = arrivals.iter().filter(|arrival| window_secs.contains(&arrival.beat_secs));
    let arrivals_ms: Vec<f64> = inside.map(|arrival| arrival.arrival_ms).collect();
    if beats < LEAST_COUNT {
        return Err(Reason::Short);
    }
    let share = (arrivals_ms.len() as f64 / beats as f64).min(1.0);
    if share < LEAST_SHARE || arrivals_ms.len() < LEAST_COUNT {
        return Err(Reason::Gap);
    }
    let median_ms = median(&arrivals_ms).ok_or(Reason::Undefined)?;
    let spread_ms = SIGMA_FROM_MAD * mad(&arrivals_ms).ok_or(Reason::Undefined)?;
    if spread_ms > MOST_SPREAD_MS {
        return Err(Reason::Quality);
    }
    Ok(Summary { median_ms, spread_ms, share })
}

fn ascending(times_secs: &[f64]) -> Vec<f64> {
    let mut times: Vec<f64> = times_secs.iter().copied().filter(|secs| secs.is_finite()).collect();
    times.sort_unstable_by(f64::total_cmp);
    times
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Beats about 0.8 s apart.
    fn beats(count: u32) -> Vec<f64> {
        (0..count).map(|k| 0.8 * f64::from(k) + 0.05 * (0.9 * f64::from(k)).sin()).collect()
    }

    fn of(beats_secs: &[f64], feet_secs: &[f64]) -> Vec<Arrival> {
        arrivals(beats_secs, feet_secs, ArrivalLimits::default()).unwrap()
    }

    #[test]
    fn a_pulse_that_arrives_earlier_has_a_shorter_time() {
        let beats_secs = beats(120);
        let arrival = |k: usize| if k < 60 { 0.26 } else { 0.23 };
        let feet: Vec<f64> = beats_secs.iter().enumerate().map(|(k, at)| at + arrival(k)).collect();
        let found = of(&beats_secs, &feet);
        let [before, after] = [0.0..47.0, 49.0..96.0]
            .map(|window| summary(&beats_secs, &found, window).unwrap().median_ms);
        assert!((before - 260.0).abs() < 1e-6 && (after - 230.0).abs() < 1e-6);
    }

    #[test]
    fn a_missed_pulse_is_not_replaced_by_another_beat_s() {
        let beats_secs = beats(20);
        let mut feet: Vec<f64> = beats_secs.iter().map(|at| at + 0.3).collect();
        feet.remove(7);
        let found = of(&beats_secs, &feet);
        assert_eq!(found.len(), 19);
        assert!(found.iter().all(|arrival| (arrival.arrival_ms - 300.0).abs() < 1e-6));
        // Nor at 200 beats a minute, where the next pulse comes within the limits.
        let fast: Vec<f64> = (0..20).map(|k| 0.3 * f64::from(k)).collect();
        let feet: Vec<f64> =
            (0..20).filter(|k| k % 5 != 3).map(|k| 0.3 * f64::from(k) + 0.15).collect();
        assert_eq!(of(&fast, &feet).len(), 16);
    }

    #[test]
    fn pulses_of_somebody_else_have_no_arrival_time() {
        let beats_secs = beats(75);
        let feet: Vec<f64> = (0..100).map(|k| 0.61 * f64::from(k)).collect();
        let found = of(&beats_secs, &feet);
        assert!(summary(&beats_secs, &found, 0.0..60.0).is_err());
    }

    #[test]
    fn few_beats_are_short_and_few_pulses_a_gap() {
        let beats_secs = beats(40);
        let feet: Vec<f64> = beats_secs.iter().take(8).map(|at| at + 0.2).collect();
        let found = of(&beats_secs, &feet);
        let reason = |window| summary(&beats_secs, &found, window).err();
        assert_eq!(reason(0.0..2.0), Some(Reason::Short));
        assert_eq!(reason(0.0..6.0), None);
        assert_eq!(reason(0.0..32.0), Some(Reason::Gap));
        assert_eq!(reason(f64::NAN..1.0), Some(Reason::Short));
    }

    #[test]
    fn limits_out_of_range_are_refused() {
        for (from_secs, to_secs) in [(0.5, 0.1), (-0.1, 0.5), (0.1, 3.0), (f64::NAN, 0.5)] {
            assert!(arrivals(&[], &[], ArrivalLimits { from_secs, to_secs }).is_err());
        }
    }

    proptest! {
        #[test]
        fn no_times_give_nonsense(
            beats_secs in prop::collection::vec(prop_oneof![prop::num::f64::ANY, 0.0..60.0], 0..100),
            feet_secs in prop::collection::vec(prop_oneof![prop::num::f64::ANY, 0.0..60.0], 0..100),
        ) {
            let found = of(&beats_secs, &feet_secs);
            let within = |arrival: &Arrival| (99.999..=500.001).contains(&arrival.arrival_ms);
            prop_assert!(found.iter().all(within));
            if let Ok(summary) = summary(&beats_secs, &found, 0.0..60.0) {
                prop_assert!(summary.median_ms.is_finite() && (0.0..=1.0).contains(&summary.share));
            }
        }
    }
}
