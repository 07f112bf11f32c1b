use std::cell::OnceCell;

use super::natural::is_natural;
use super::rolling::around_each;
use crate::robust::quantile_of_sorted;

/// The number of beats from which thresholds are estimated.
const THRESHOLD_BEATS: usize = 91;
/// The number of beats from which the usual interval is estimated.
const MEDIAN_BEATS: usize = 11;
/// The threshold in quartile deviations: about 3.3 standard deviations, 99.95 % of normal values.
const ALPHA: f64 = 5.2;
/// Slope of the decision border of ectopic beats.
const C1: f64 = 0.13;
/// Offset of the decision border of ectopic beats.
const C2: f64 = 0.17;
/// The largest deviation of an interval from the usual one, in thresholds.
const MOST_OFF: f64 = 3.0;

/// The kind of an artefact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A beat that is too early or too late, with the opposite deviation before or after it.
    Ectopic,
    /// A missed beat before this one.
    Missed,
    /// A false detection.
    Extra,
    /// A beat whose interval is too long or too short.
    LongShort,
}

/// An artefact among beats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Artefact {
    /// The index of the beat, from 0.
    pub beat: usize,
    /// The kind of artefact.
    pub kind: Kind,
}

/// The artefacts among beats.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Artefacts {
    /// The artefacts, in the order of beats.
    pub found: Vec<Artefact>,
    /// The number of beats examined.
    pub beats: usize,
}

impl Artefacts {
    /// Finds the artefacts among beats at `times_secs` [s, ascending].
    ///
    /// Lipponen & Tarvainen (2019), doi:10.1080/03091902.2019.1640306: differences between successive
    /// intervals above 5.2 quartile deviations of the 91 surrounding ones, differences from the median of
    /// 11 above 5.2 quartile deviations of those, and the borders between kinds; as in NeuroKit2 0.2.13's
    /// `signal_fixpeaks(method="kubios", iterative=False)`. Limits: needs four beats, and works best with
    /// some hundred; the last two beats are not judged; if more than a quarter of the beats are wrong, they
    /// are taken for normal.
    pub fn among(times_secs: &[f64]) -> Artefacts {
        Artefacts::of(differences_with_mean_first(times_secs))
    }

    /// Like [`among`](Self::among), from intervals [s], one per beat.
    fn of(rr: Vec<f64>) -> Artefacts {
        let beats = rr.len();
        let found = if beats < 4 { Vec::new() } else { Series::of(rr).classified() };
        Artefacts { found, beats }
    }

    /// Finds the artefacts among intervals [s], one per beat, that are not natural variability.
    ///
    /// If one of several adjacent artefacts counts, all do: they are signs of the same error.
    pub(super) fn unnatural(rr: Vec<f64>) -> Artefacts {
        let beats = rr.len();
        if beats < 4 {
            return Artefacts { found: Vec::new(), beats };
        }
        let series = Series::of(rr);
        let found = series.classified();
        let together = found.chunk_by(|one, next| next.beat - one.beat <= 1);
        let unnatural = together.filter(|all| !all.iter().all(|each| is_natural(&series, *each)));
        Artefacts { found: unnatural.flatten().copied().collect(), beats }
    }

    /// The number of artefacts of a kind.
    pub fn count(&self, kind: Kind) -> usize {
        self.found.iter().filter(|each| each.kind == kind).count()
    }

    /// The number of artefacts.
    pub fn total(&self) -> usize {
        self.found.len()
    }

    /// The share of artefacts among all beats [%]; 0 without beats.
    pub fn percent(&self) -> f64 {
        100.0 * self.found.len() as f64 / self.beats.max(1) as f64
    }
}

/// The series of the decision rules in the paper's Figure 1, one value per beat.
pub(super) struct Series {
    /// Intervals [s].
    rr: Vec<f64>,
    /// Differences between successive intervals, over their threshold.
    change: Vec<f64>,
    /// The intervals relative to the usual one, computed only if a change stands out, which is rare.
    level: OnceCell<Level>,
}

/// Intervals relative to the surrounding ones.
struct Level {
    /// Median of the surrounding intervals [s].
    usual: Vec<f64>,
    /// Threshold of differences from that median [s].
    threshold: Vec<f64>,
    /// Differences from that median, over the threshold.
    off: Vec<f64>,
}

impl Level {
    fn of(rr: &[f64]) -> Level {
        let usual = usual(rr);
        let off = rr.iter().zip(&usual).map(|(rr, usual)| rr - usual);
        // A short interval deviates less than a long one from the same kind of error.
        let mut off: Vec<f64> =
            off.map(|each| if each < 0.0 { 2.0 * each } else { each }).collect();
        let threshold = threshold(&off);
        off.iter_mut().zip(&threshold).for_each(|(value, by)| *value = over(*value, *by));
        Level { usual, threshold, off }
    }
}

/// The quotient of a value and its threshold. With a threshold of zero it is NaN, which compares as false.
fn over(value: f64, threshold: f64) -> f64 {
    if threshold > 0.0 { value / threshold } else { f64::NAN }
}

impl Series {
    fn of(rr: Vec<f64>) -> Series {
        let mut change = differences_with_mean_first(&rr);
        let thresholds = threshold(&change);
        change.iter_mut().zip(thresholds).for_each(|(value, by)| *value = over(*value, by));
        Series { rr, change, level: OnceCell::new() }
    }

    fn level(&self) -> &Level {
        self.level.get_or_init(|| Level::of(&self.rr))
    }

    fn classified(&self) -> Vec<Artefact> {
        let mut found = Vec::new();
        let mut beat = 0;
        while beat + 2 < self.rr.len() {
            let change = self.change[beat];
            if change.abs() <= 1.0 {
                beat += 1;
            } else if self.is_ectopic(beat) {
                found.push(Artefact { beat, kind: Kind::Ectopic });
                beat += 1;
            } else if !(change.abs() > 1.0 || self.level().off[beat].abs() > MOST_OFF) {
                beat += 1;
            } else {
                // The long or short interval may be the next.
                let next_too = self.change[beat + 1].abs() < self.change[beat + 2].abs();
                let last = if next_too { beat + 1 } else { beat };
                let kinds = (beat..=last).map(|beat| (beat, self.long_or_short(beat)));
                found.extend(kinds.filter_map(|(beat, kind)| Some(Artefact { beat, kind: kind? })));
                beat = last + 1;
            }
        }
        found
    }

    /// The relative deviation of an interval from the usual one; for beats beyond the end, that of the last interval.
    pub(super) fn off_usual(&self, beat: usize) -> f64 {
        let beat = beat.min(self.rr.len() - 1);
        self.rr[beat] / self.level().usual[beat] - 1.0
    }

    /// The change over its threshold `by` beats away, mirrored at both ends.
    pub(super) fn change_at(&self, beat: usize, by: isize) -> f64 {
        let last = self.change.len() as isize - 1;
        let mirrored = (beat as isize + by).abs();
        let mirrored = if mirrored > last { 2 * last - mirrored } else { mirrored };
        self.change[mirrored as usize]
    }

    /// Whether a beat is ectopic: equations 1 and 2.
    fn is_ectopic(&self, beat: usize) -> bool {
        let (change, before, after) =
            (self.change[beat], self.change_at(beat, -1), self.change_at(beat, 1));
        (change > 1.0 && greater(before, after) < -C1 * change - C2)
            || (change < -1.0 && lesser(before, after) > -C1 * change + C2)
    }

    /// Whether an interval is long or short, and of which kind: equations 3 to 7.
    fn long_or_short(&self, beat: usize) -> Option<Kind> {
        let (change, next, second) =
            (self.change[beat], self.change_at(beat, 1), self.change_at(beat, 2));
        let long = change > 1.0 && lesser(next, second) < -1.0;
        let short = change < -1.0 && greater(next, second) > 1.0;
        if !(long || short || self.level().off[beat].abs() > MOST_OFF) {
            return None;
        }
        let level = self.level();
        let (usual, threshold) = (level.usual[beat], level.threshold[beat]);
        let half_is_usual = (self.rr[beat] / 2.0 - usual).abs() < threshold;
        let both_are_usual = (self.rr[beat] + self.rr[beat + 1] - usual).abs() < threshold;
        let missed_or_other = if long && half_is_usual { Kind::Missed } else { Kind::LongShort };
        Some(if short && both_are_usual { Kind::Extra } else { missed_or_other })
    }
}

/// The greater of two numbers; NaN if either is, which `f64::max` would hide.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// The lesser of two numbers; NaN if either is, which `f64::min` would hide.
fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) }
}

/// The median of the intervals around each one [s].
pub(super) fn usual(rr: &[f64]) -> Vec<f64> {
    around_each(rr, MEDIAN_BEATS, |sorted| quantile_of_sorted(sorted, 0.5))
}

/// The differences between values, as many as there are values: the first is the mean of the others.
pub(super) fn differences_with_mean_first(values: &[f64]) -> Vec<f64> {
    let mut all: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if !values.is_empty() {
        all.insert(0, all.iter().sum::<f64>() / all.len() as f64);
    }
    all
}

fn threshold(values: &[f64]) -> Vec<f64> {
    let sizes: Vec<f64> = values.iter().map(|each| each.abs()).collect();
    let deviation = |sorted: &[f64]| {
        (quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25)) / 2.0
    };
    around_each(&sizes, THRESHOLD_BEATS, |sorted| ALPHA * deviation(sorted))
}
