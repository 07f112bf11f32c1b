//! Workload and arousal estimated from the body.

use std::collections::BTreeSet;

use teampulse_core::data::{FeatureValues, Reason};
use teampulse_core::stream::Stream;
use teampulse_signal::estimate::Estimate;
use teampulse_signal::statistics::Comparison;

use crate::value::Value;

/// The uncertainty of an index: with a normal error of this standard deviation, three classes on
/// [0..1] are classified correctly in 72 % of cases, the best published result within people: (1/6)/Φ⁻¹((3
/// · 0.72 + 1)/4).
pub(super) const LEAST_SIGMA: f64 = 0.21;

/// The z at which a measure counts half.
const HALF_Z: f64 = 3.0;
/// The uncertainty of a single measure, for those that are missing.
const SPREAD_OF_ONE: f64 = 0.5;

/// A measure and its direction: 1 where it rises with the index, −1 where it falls.
type Sign = (&'static str, f64);

/// Mehler et al. (2012): heart rate rises; Task Force (1996) and Luque-Casado et al. (2016): RMSSD
/// falls; Grassmann et al. (2016): breathing becomes faster.
const OF_WORKLOAD: &[Sign] = &[("heart_rate", 1.0), ("ln_rmssd", -1.0), ("breathing_rate", 1.0)];
/// Boucsein et al. (2012): level and responses of the skin rise.
const OF_AROUSAL: &[Sign] = &[("skin_level", 1.0), ("response_rate", 1.0)];

/// The estimates from physiological measures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Physiology {
    pub(super) workload: Value,
    pub(super) arousal: Value,
    /// The share of the measures that are known [0..1].
    pub(super) coverage: f64,
    /// The quality of their data [0..1].
    pub(super) quality: f64,
}

/// The estimates without a state: the measures have no baseline yet.
pub(super) fn without_state(measured: &BTreeSet<&str>) -> Physiology {
    let lack = |signs: &[Sign]| {
        let is_measured = signs.iter().any(|(measure, _)| measured.contains(measure));
        Err(if is_measured { Reason::NoBaseline } else { Reason::Missing })
    };
    let (workload, arousal) = (lack(OF_WORKLOAD), lack(OF_AROUSAL));
    Physiology { workload, arousal, coverage: 0.0, quality: 1.0 }
}

/// The indices of the measures' values in a state.
pub(super) struct Reading {
    workload: Vec<Place>,
    arousal: Vec<Place>,
}

/// The indices of the robust z and the z of one measure, and its direction.
struct Place {
    channels: [usize; 2],
    sign: f64,
}

impl Reading {
    /// The layout of this stream of states.
    pub(super) fn of(state: &Stream) -> Reading {
        let place = |&(measure, sign): &Sign| {
            let channel = |each: Comparison| state.place_of(&each.of(measure));
            Some(Place { channels: [channel(Comparison::RobustZ)?, channel(Comparison::Z)?], sign })
        };
        let places = |signs: &[Sign]| signs.iter().filter_map(place).collect();
        Reading { workload: places(OF_WORKLOAD), arousal: places(OF_AROUSAL) }
    }

    /// The estimates from a state; the windows themselves scatter by this many standard deviations.
    pub(super) fn read(&self, state: &FeatureValues, scatter: f64) -> Physiology {
        let index = |places: &[Place]| index(places.iter().map(|place| place.z(state)), scatter);
        Physiology {
            workload: index(&self.workload),
            arousal: index(&self.arousal),
            coverage: f64::from(state.coverage).clamp(0.0, 1.0),
            quality: f64::from(state.quality).clamp(0.0, 1.0),
        }
    }
}

impl Place {
    /// The robust z, or the z where that is undefined, in the direction of the index.
    fn z(&self, state: &FeatureValues) -> Value {
        let z = self.channels.map(|channel| {
            let reason = state.reasons.get(channel).copied().unwrap_or(Reason::Missing);
            let sigma = state.sigmas.get(channel).copied().unwrap_or(f64::NAN);
            match (reason, state.values.get(channel)) {
                (Reason::Ok, Some(&value)) => Ok(Estimate { value, sigma }.scaled(self.sign)),
                (reason, _) => Err(reason),
            }
        });
        if z[0] == Err(Reason::Undefined) { z[1] } else { z[0] }
    }
}

/// The index of measures [0..1]: the mean of z/(|z| + 3), at least 0.
///
/// The variance of the index is the minimum one, plus that of the mean of the measures, from their differences and from
/// the uncertainties of their baselines and windows.
fn index(z: impl Iterator<Item = Value>, scatter: f64) -> Value {
    let (mut scores, mut variances, mut lack) = (Vec::new(), 0.0, Reason::Missing);
    for z in z {
        match z {
            Ok(z) => {
                let of_half = z.value.abs() + HALF_Z;
                let slope = HALF_Z / (of_half * of_half);
                let sigma = if z.sigma.is_nan() { 0.0 } else { z.sigma };
                scores.push(z.value / of_half);
                variances += slope * slope * (scatter * scatter + sigma * sigma);
            }
            Err(reason) if lack == Reason::Missing => lack = reason,
            Err(_) => {}
        }
    }
    let count = scores.len() as f64;
    if scores.is_empty() {
        return Err(lack);
    }
    let mean = scores.iter().sum::<f64>() / count;
    let squares: f64 = scores.iter().map(|score| (score - mean).powi(2)).sum();
    let spread = if scores.len() == 1 { SPREAD_OF_ONE.powi(2) } else { squares / (count - 1.0) };
    let variance = LEAST_SIGMA * LEAST_SIGMA + (spread + variances / count) / count;
    Ok(Estimate { value: mean.max(0.0), sigma: variance.sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(z: &[f64]) -> Estimate {
        let certain = |&value: &f64| Ok(Estimate { value, sigma: 0.5 });
        index(z.iter().map(certain), 1.0).unwrap()
    }

    #[test]
    fn the_index_rises_with_each_measure_and_stays_below_one() {
        let indices: Vec<f64> =
            [0.0, 1.0, 3.0, 10.0, 1e6].iter().map(|&z| of(&[z, z, z]).value).collect();
        assert!(indices.is_sorted_by(|a, b| a < b) && indices[0] == 0.0 && indices[4] < 1.0);
        assert_eq!(indices[2], 0.5);
    }

    #[test]
    fn all_measures_count_the_same() {
        assert_eq!(of(&[1.0, 2.0, 5.0]).value, of(&[5.0, 1.0, 2.0]).value);
    }

    #[test]
    fn its_sigma_is_never_below_the_published_one() {
        for z in [0.0, 3.0, 1e9] {
            assert!(of(&[z; 3]).sigma >= LEAST_SIGMA);
        }
    }

    #[test]
    fn contradicting_measures_enlarge_sigma() {
        assert!(of(&[6.0, -6.0, 6.0]).sigma > 1.5 * of(&[3.0, 3.0, 3.0]).sigma);
        assert!(of(&[3.0]).sigma > of(&[3.0, 3.0, 3.0]).sigma);
    }

    #[test]
    fn below_the_baseline_is_as_in_the_baseline() {
        assert_eq!(of(&[-5.0, -5.0]).value, 0.0);
    }

    #[test]
    fn without_a_measure_there_is_a_reason() {
        let lacks = [Err(Reason::Missing), Err(Reason::Gap), Err(Reason::Short)];
        assert_eq!(index(lacks.into_iter(), 1.0), Err(Reason::Gap));
        assert_eq!(index(std::iter::empty(), 1.0), Err(Reason::Missing));
    }
}
