//! Breaths that a belt counts twice: if the belt is stretched in both directions, its signal is folded.

use super::Breath;
use crate::robust::median;

/// How far from a turning point slopes are taken, and over which part, as shares of a breath.
const AWAY: f64 = 0.06;
const OVER: f64 = 0.06;
/// The number of steps of a breath at which its steepest slope is searched for.
const STEPS: usize = 40;

/// How much sharper troughs are than peaks [−1..1]: the sharpness of the median trough minus that of the median peak.
/// Sharpness is the slope on both sides of a turning point as a share of the steepest slope of the breath.
///
/// Chests turn slowly: for a sine both sharpnesses are 0.3, and a trough is no sharper after a pause, which is flat on
/// one side. A folded signal, such as the distance from a middle, is steepest where it is folded.
pub(super) fn sharpness(means: &[f64], breaths: &[&Breath]) -> f64 {
    let at = |place: f64| {
        let before = place.max(0.0).floor();
        let low = means.get(before as usize)?;
        let high = means.get(before as usize + 1).unwrap_or(low);
        Some(low + (high - low) * (place - before))
    };
    let slope = |from: f64, over: f64| Some(at(from + over)? - at(from)?);
    let sides = |turn: f64, breath: &Breath| {
        let (away, over) = (AWAY * breath.duration(), OVER * breath.duration());
        let steepest = (0..STEPS).filter_map(|step| {
            let share = step as f64 / STEPS as f64;
            slope(breath.begin + share * (breath.duration() - over), over).map(f64::abs)
        });
        let before = slope(turn - away - over / 2.0, over)?.abs();
        let after = slope(turn + away - over / 2.0, over)?.abs();
        Some(before.min(after) / steepest.reduce(f64::max)?)
    };
    let of = |turn: fn(&Breath) -> f64| {
        let all = breaths.iter().filter_map(|breath| sides(turn(breath), breath));
        median(&all.collect::<Vec<_>>())
    };
    let (trough, peak) = (of(|breath| breath.begin), of(|breath| breath.peak));
    trough.zip(peak).map_or(0.0, |(trough, peak)| trough - peak)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// The sharpness of breaths of 4 s with this form of one cycle, at 25 Hz.
    fn of(form: impl Fn(f64) -> f64) -> f64 {
        let means: Vec<f64> = (0..1500).map(|k| form(f64::from(k % 100) / 100.0)).collect();
        let begins = (1..13).map(|number| 100.0 * f64::from(number));
        let breath =
            |begin| Breath { begin, peak: begin + 50.0, end: begin + 100.0, amplitude: 1.0 };
        let breaths: Vec<Breath> = begins.map(breath).collect();
        sharpness(&means, &breaths.iter().collect::<Vec<_>>())
    }

    #[test]
    fn a_folded_signal_is_sharp_below() {
        assert!(of(|share| (TAU * share / 2.0).sin().abs()) > 0.5);
        assert!(of(|share| -(TAU * share).cos()).abs() < 0.1);
        assert!(of(|share| 1.0 - (2.0 * share - 1.0).abs()).abs() < 0.1, "triangles");
        assert!(of(|_| 0.0).abs() < 1e-9);
        assert!(sharpness(&[], &[]).abs() < 1e-9);
    }
}
