//! The values of a span, domain by domain.

use super::cut::Cut;
use super::rows::{FREQUENCY, NONLINEAR, Need, Row, TIME, UNCORRECTED};
use crate::analysis::{Reason, Value};
use crate::hrv::frequency::{FrequencyDomain, spectrum};
use crate::hrv::measure::Measure;
use crate::hrv::segments;
use crate::hrv::{
    Recipe, asymmetry, detrended_fluctuation, entropies, fragmentation, geometric, poincare,
    time_domain,
};
use crate::intervals::Kind;
use crate::spectrum::Transforms;

/// The smallest share of a band's required time between the first interval and the last.
const LEAST_SHARE: f64 = 0.95;
/// The longest gap that a spline may bridge [s].
const LONGEST_BRIDGE_SECS: f64 = 6.0;

const AUTOREGRESSIVE: Recipe = Recipe::Autoregressive { rate_hz: 4.0, order: 16 };

/// The suffix of expensive recipes, which [`Live`](crate::analysis::Live) holds.
const HELD: &str = "; recomputed every 10 s in causal sliding windows";

/// The part of the recipes about uncorrected beats.
const AS_DETECTED: &str = "intervals as detected, none corrected or left out";

/// The values that average over all intervals.
const MEANS: [&str; 4] = ["HRV_MeanNN", "HRV_MedianNN", "HRV_MeanHR", "HRV_Uncorrected_MeanNN"];

/// A group of values that are computed together.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Domain {
    /// The time domain, SDANN and SDNNI, and the counts of corrections.
    Time,
    /// Powers of bands.
    Frequency,
    /// Geometry, the Poincaré plot, asymmetry, fragmentation, entropies and fluctuation.
    Nonlinear,
}

impl Domain {
    /// All domains, in the order of the values.
    pub const ALL: [Domain; 3] = [Domain::Time, Domain::Frequency, Domain::Nonlinear];

    /// The number of the domain's values.
    pub(super) fn count(self) -> usize {
        self.rows().len()
    }

    fn rows(self) -> &'static [Row] {
        match self {
            Domain::Time => &TIME,
            Domain::Frequency => &FREQUENCY,
            Domain::Nonlinear => &NONLINEAR,
        }
    }
}

/// The values in order; `beats` states the treatment of artefacts.
pub(super) fn values(beats: &str) -> Vec<Value> {
    let rows = Domain::ALL
        .into_iter()
        .flat_map(|domain| domain.rows().iter().map(move |row| (domain, row)));
    let value = |(domain, &(name, unit, recipe, need)): (Domain, &Row)| {
        let how = match (domain, need) {
            (Domain::Frequency, _) if name.ends_with("_AR") => format!("; {AUTOREGRESSIVE}"),
            (Domain::Frequency, Need::Secs(_)) => format!("; {}", Recipe::LombScargle),
            (Domain::Frequency, _) => format!("; {}", Recipe::default()),
            (Domain::Nonlinear, _) => HELD.to_owned(),
            _ => String::new(),
        };
        let beats = if name.starts_with(UNCORRECTED) { AS_DETECTED } else { beats };
        let method = format!("{recipe}{how}; {beats}");
        Value { name: name.into(), unit: unit.into(), method: method.into() }
    };
    rows.map(value).collect()
}

/// Whether noise in the times of single beats hardly changes a value.
pub(super) fn bears_noise(name: &str) -> bool {
    let is_count = |row: &Row| row.0 == name && matches!(row.3, Need::Nothing);
    MEANS.contains(&name) || Domain::ALL.iter().any(|domain| domain.rows().iter().any(is_count))
}

/// The values of a domain in order; `kept` caches FFT plans.
pub(super) fn measure(domain: Domain, cut: &Cut, kept: &Transforms) -> Vec<Result<f64, Reason>> {
    let (rows, shown) = (domain.rows(), Shown::of(cut));
    let computed = match domain {
        Domain::Time => time(cut),
        // Most spans are too short for any band.
        Domain::Frequency if rows.iter().all(|row| shown.lacks(row.3, f64::NAN).is_some()) => {
            vec![f64::NAN; rows.len()]
        }
        Domain::Frequency => frequency(cut, kept),
        Domain::Nonlinear => nonlinear(cut),
    };
    let shown_of = |(row, value): (&Row, f64)| match shown.lacks(row.3, value) {
        Some(reason) => Err(reason),
        None => Reason::unless_finite(value),
    };
    rows.iter().zip(computed).map(shown_of).collect()
}

/// The values reported shortly before (`last`), where the span has the data for them; `None` if a value was missing for
/// a reason that no longer holds.
pub(super) fn held(
    domain: Domain,
    cut: &Cut,
    last: &[Result<f64, Reason>],
) -> Option<Vec<Result<f64, Reason>>> {
    let shown = Shown::of(cut);
    let shown_of = |(row, last): (&Row, &Result<f64, Reason>)| match (
        shown.lacks(row.3, last.unwrap_or(f64::NAN)),
        *last,
    ) {
        (Some(reason), _) => Some(Err(reason)),
        (None, Ok(_) | Err(Reason::Undefined)) => Some(*last),
        (None, Err(_)) => None,
    };
    domain.rows().iter().zip(last).map(shown_of).collect()
}

/// The intervals available in a span.
struct Shown {
    count: usize,
    window_secs: f64,
    secs: f64,
    longest_secs: f64,
}

impl Shown {
    fn of(cut: &Cut) -> Shown {
        let (ends_secs, _) = cut.present();
        Shown {
            count: ends_secs.len(),
            window_secs: cut.window_secs,
            secs: ends_secs.last().zip(ends_secs.first()).map_or(0.0, |(last, first)| last - first),
            longest_secs: ends_secs.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max),
        }
    }

    fn lacks(&self, need: Need, value: f64) -> Option<Reason> {
        let short = |secs: u32| {
            let secs = f64::from(secs);
            self.window_secs < secs || self.secs < LEAST_SHARE * secs
        };
        let is_short = match need {
            Need::Nothing => false,
            Need::Intervals(least) => self.count < least,
            Need::Secs(secs) | Need::Bridged(secs) => short(secs),
            Need::Segments => value.is_nan(),
        };
        let has_hole = matches!(need, Need::Bridged(_)) && self.longest_secs > LONGEST_BRIDGE_SECS;
        if is_short { Some(Reason::Short) } else { has_hole.then_some(Reason::Gap) }
    }
}

/// The features' values, or the same number of NaN.
fn padded(measures: Option<Vec<Measure>>, count: usize) -> Vec<f64> {
    measures.map_or(vec![f64::NAN; count], |all| all.iter().map(|each| each.value).collect())
}

fn time(cut: &Cut) -> Vec<f64> {
    let counts = [
        cut.intervals_ms.iter().filter(|each| each.is_finite()).count() as f64,
        cut.count(Kind::Ectopic),
        cut.count(Kind::Missed),
        cut.count(Kind::Extra),
        cut.count(Kind::LongShort),
        cut.corrected_percent(),
    ];
    let uncorrected = time_domain(&cut.uncorrected_ms)
        .map_or([f64::NAN; 3], |each| [each.mean_nn_ms, each.sdnn_ms, each.rmssd_ms]);
    let segments = segments::measures(&cut.ends_secs, &cut.intervals_ms);
    let features = time_domain(&cut.intervals_ms).map(|each| each.measures());
    let others = segments.len() + counts.len() + uncorrected.len();
    let features = padded(features, TIME.len() - others);
    [features, padded(Some(segments), 0), counts.to_vec(), uncorrected.to_vec()].concat()
}

fn frequency(cut: &Cut, kept: &Transforms) -> Vec<f64> {
    let (ends_secs, intervals_ms) = cut.present();
    let is_bridged = ends_secs.windows(2).all(|pair| pair[1] - pair[0] <= LONGEST_BRIDGE_SECS);
    let of = |recipe: Recipe| {
        let (spectrum, _) = spectrum(&ends_secs, &intervals_ms, &recipe, kept).ok()?;
        Some(FrequencyDomain::of(&spectrum, cut.window_secs))
    };
    // A spline over a long hole would be expensive and useless.
    let splined = |recipe: Recipe| if is_bridged { of(recipe) } else { None };
    let other = |features: Option<FrequencyDomain>| {
        features.map_or([f64::NAN; 3], |each| [each.lf_ms2, each.hf_ms2, each.lf_hf()])
    };
    let others = [other(splined(AUTOREGRESSIVE)), other(of(Recipe::LombScargle))].concat();
    let welch = splined(Recipe::default()).map(|each| each.measures());
    let welch = padded(welch, FREQUENCY.len() - others.len());
    welch.into_iter().chain(others).collect()
}

fn nonlinear(cut: &Cut) -> Vec<f64> {
    let nn = &cut.intervals_ms;
    [
        padded(geometric(nn).map(|each| each.measures()), 2),
        padded(poincare(nn).map(|each| each.measures()), 7),
        padded(asymmetry(nn).map(|each| each.measures()), 10),
        padded(fragmentation(nn).map(|each| each.measures()), 4),
        padded(entropies(nn).map(|each| each.measures()), 4),
        padded(detrended_fluctuation(nn).map(|each| each.measures()), 2),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_value_is_called_and_measured_as_its_feature() {
        let nn: Vec<f64> = (0..400u32).map(|k| 800.0 + f64::from(k * k % 37)).collect();
        let ends_secs: Vec<f64> = (1..=400u32).map(|k| 0.8 * f64::from(k)).collect();
        let (spectrum, _) =
            spectrum(&ends_secs, &nn, &Recipe::default(), &Transforms::default()).unwrap();
        let named = [
            (&TIME[..], time_domain(&nn).unwrap().measures()),
            (&TIME[20..], segments::measures(&ends_secs, &nn)),
            (&FREQUENCY, FrequencyDomain::of(&spectrum, 320.0).measures()),
            (&NONLINEAR, geometric(&nn).unwrap().measures()),
            (&NONLINEAR[2..], poincare(&nn).unwrap().measures()),
            (&NONLINEAR[9..], asymmetry(&nn).unwrap().measures()),
            (&NONLINEAR[19..], fragmentation(&nn).unwrap().measures()),
            (&NONLINEAR[23..], entropies(&nn).unwrap().measures()),
            (&NONLINEAR[27..], detrended_fluctuation(&nn).unwrap().measures()),
        ];
        for (rows, measures) in named {
            for (row, measure) in rows.iter().zip(&measures) {
                assert_eq!((row.0, row.1), (measure.name, measure.unit));
            }
        }
    }
}
