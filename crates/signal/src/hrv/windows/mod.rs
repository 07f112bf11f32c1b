//! Heartbeats that can be queried for any span.

mod holes;
mod corrected;
mod cut;
mod recipes;
mod rows;

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

use corrected::CorrectedBeats;
use cut::Cut;
use holes::Holes;
pub use recipes::Domain;

use crate::analysis::{LEAST_COVERAGE, Measured, Reason, Span, Value, Windows};
use crate::intervals::{Edit, MOST_PERCENT};
use crate::spectrum::Transforms;

/// The time before a causal span [s] whose beats are corrected with it: the thresholds need 45 beats on both
/// sides.
pub const BEFORE_SECS: f64 = 60.0;

/// A store of heartbeats whose variability can be computed for any span: common to the analyses of ECG,
/// pulse waves and intervals.
///
/// The values are those of [`time_domain`](super::time_domain), [`segments`](super::segments),
/// [`frequency_domain`](super::frequency_domain), [`poincare`](super::poincare) and the others of
/// [`hrv`](super). They are computed from the intervals with both beats in the span, corrected as by
/// Lipponen and Tarvainen but sparing natural variability ([`Correction`](crate::intervals::Correction)),
/// without those outside 300 to 2000 ms. Mean, SDNN and RMSSD of the uncorrected intervals are reported as
/// well. Nothing is computed across a [hole](HeartWindows::mark_gap), nor across more than 4 s without a
/// beat. The number of corrected beats is reported, too: above 5 % (`quality` below 0.5) the other values
/// are doubtful, but are still reported, as is customary.
///
/// In [causal](HeartWindows::causal) use, a span's beats are corrected with those from [`BEFORE_SECS`]
/// before it and none after it, so that the result depends on nothing else; for a [whole
/// recording](HeartWindows::whole), all beats are corrected at once. `coverage` is the share of the span
/// covered by intervals, including up to 2 s at its ends. `quality` is 1/(1 + c/5), where c is the
/// percentage of corrected beats among those in the span: 0.5 at 5 %.
///
/// ```
/// use teampulse_signal::analysis::{Span, Windows};
/// use teampulse_signal::hrv::HeartWindows;
///
/// let mut heart = HeartWindows::causal();
/// (0..40).for_each(|k| heart.push(k * 800_000_000 + k % 2 * 20_000_000));
/// let measured = heart.measure(Span { begin_ns: 0, end_ns: 30_000_000_000 });
/// let place = heart.values().iter().position(|value| value.name == "HRV_RMSSD").expect("it is one");
/// assert!((measured.values[place].expect("there are 38 beats") - 40.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug)]
pub struct HeartWindows {
    treatment: Treatment,
    domains: Vec<Domain>,
    values: Arc<[Value]>,
    beats: Beats,
    transforms: Transforms,
}

/// The treatment of artefacts.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Treatment {
    /// Artefacts are corrected by the method of Lipponen and Tarvainen.
    #[default]
    Corrected,
    /// Artefacts are kept, and only counted: for intervals that were corrected already, or for comparison with other
    /// programs. No interval then counts as too short or too long.
    AsTheyAre,
}

#[derive(Clone, Debug)]
enum Beats {
    Causal { at_ns: VecDeque<i64>, holes: Holes },
    Whole(CorrectedBeats),
}

impl HeartWindows {
    /// Creates a store for beats that arrive one by one.
    pub fn causal() -> HeartWindows {
        let beats = Beats::Causal { at_ns: VecDeque::new(), holes: Holes::default() };
        HeartWindows::of(beats, &format!("{CORRECTED} with the beats of {BEFORE_SECS} s before"))
    }

    /// Creates a store of all beats of a recording [ns], in any order, with its `holes` [ns, from and to] and manual
    /// edits, in seconds since `begin_ns`.
    ///
    /// An edit applies to the beat within [`EDIT_WITHIN_SECS`] of its time. Beats that were added, moved or
    /// confirmed manually are not corrected.
    pub fn whole(
        begin_ns: i64,
        at_ns: &[i64],
        holes: &[(i64, i64)],
        edits: &[Edit],
    ) -> HeartWindows {
        let mut all = Holes::default();
        for &(from_ns, to_ns) in holes {
            all.mark(from_ns, to_ns);
        }
        let beats = CorrectedBeats::of(begin_ns, at_ns.iter().copied(), &all, edits);
        HeartWindows::of(Beats::Whole(beats), &format!("{CORRECTED} over the whole recording"))
    }

    fn of(beats: Beats, corrected: &str) -> HeartWindows {
        let treatment = Treatment::Corrected;
        let (domains, values) = (Domain::ALL.to_vec(), recipes::values(corrected).into());
        HeartWindows { treatment, domains, values, beats, transforms: Transforms::default() }
    }

    /// Sets the treatment of artefacts.
    #[must_use]
    pub fn treated(self, treatment: Treatment) -> HeartWindows {
        if treatment == Treatment::Corrected {
            return self;
        }
        let is_one = |value: &Value| self.values.iter().any(|each| each.name == value.name);
        let values = recipes::values(AS_THEY_ARE).into_iter().filter(is_one).collect();
        HeartWindows { treatment, values, ..self }
    }

    /// Computes only the values of these domains.
    #[must_use]
    pub fn only(self, domains: &[Domain]) -> HeartWindows {
        let places = domains.iter().flat_map(|&domain| self.places(domain));
        let values = places.map(|place| self.values[place].clone()).collect();
        HeartWindows { domains: domains.to_vec(), values, ..self }
    }

    /// Takes in a beat [ns]; one older than the last is inserted in order.
    ///
    /// No effect on a whole recording.
    pub fn push(&mut self, beat_ns: i64) {
        let Beats::Causal { at_ns, .. } = &mut self.beats else { return };
        let place = at_ns.partition_point(|&each| each < beat_ns);
        if at_ns.get(place) != Some(&beat_ns) {
            at_ns.insert(place, beat_ns);
        }
    }

    /// Marks a gap in the data [ns], which no interval spans.
    ///
    /// Call it for gaps long enough to hide or shift a beat: 100 ms. No effect on a whole recording.
    pub fn mark_gap(&mut self, from_ns: i64, to_ns: i64) {
        let Beats::Causal { holes, .. } = &mut self.beats else { return };
        holes.mark(from_ns, to_ns);
    }

    /// Drops the data that only spans beginning before a time [ns] need.
    pub fn forget(&mut self, before_ns: i64) {
        let Beats::Causal { at_ns, holes } = &mut self.beats else { return };
        let before_ns = Span { begin_ns: before_ns, end_ns: before_ns };
        let before_ns = before_ns.with_before(BEFORE_SECS).begin_ns;
        while at_ns.front().is_some_and(|&each| each < before_ns) {
            at_ns.pop_front();
        }
        holes.forget(before_ns);
    }

    /// The indices of a domain's values, for [`measure_domain`](Self::measure_domain); empty where it was
    /// left out.
    pub fn places(&self, domain: Domain) -> Range<usize> {
        let before = self.domains.iter().take_while(|&&each| each != domain);
        let begin = before.map(|each| each.count()).sum();
        let count = if self.domains.contains(&domain) { domain.count() } else { 0 };
        begin..begin + count
    }

    /// Like [`measure`](Windows::measure), but returns only the values of one domain, those at its
    /// [places](Self::places), so that cheap values can be queried more often.
    pub fn measure_domain(&self, span: Span, domain: Domain) -> Measured {
        self.measure_domains(span, &[domain], None)
    }

    /// Like [`measure`](Windows::measure), reusing the nonlinear values of `last`, which was measured shortly before
    /// and ends with the heart's values.
    pub(crate) fn measure_after(&self, span: Span, last: Option<&Measured>) -> Measured {
        let last = last.and_then(|last| {
            let begin = last.values.len().checked_sub(self.values.len())?;
            last.values[begin..].get(self.places(Domain::Nonlinear))
        });
        self.measure_domains(span, &self.domains, last)
    }

    /// Replaces the values that noise in the times of beats falsifies (all but counts and means) by
    /// [`Reason::Quality`].
    pub(crate) fn withhold_variability(&self, values: &mut [Result<f64, Reason>]) {
        for (value, known) in self.values.iter().zip(values) {
            if known.is_ok() && !recipes::bears_noise(&value.name) {
                *known = Err(Reason::Quality);
            }
        }
    }

    /// Like [`measure`](Windows::measure), reusing recent nonlinear values where available.
    fn measure_domains(
        &self,
        span: Span,
        domains: &[Domain],
        nonlinear: Option<&[Result<f64, Reason>]>,
    ) -> Measured {
        let cut = self.cut(span);
        let quality = 1.0 / (1.0 + cut.corrected_percent() / MOST_PERCENT);
        if cut.coverage < LEAST_COVERAGE {
            let count = domains.iter().map(|domain| domain.count()).sum();
            return Measured::nothing(cut.coverage, quality, count, Reason::Gap);
        }
        let values = |&domain: &Domain| {
            let last = nonlinear.filter(|_| domain == Domain::Nonlinear);
            let held = last.and_then(|last| recipes::held(domain, &cut, last));
            held.unwrap_or_else(|| recipes::measure(domain, &cut, &self.transforms))
        };
        let values = domains.iter().flat_map(values).collect();
        Measured { coverage: cut.coverage, quality, values }
    }

    fn cut(&self, span: Span) -> Cut {
        match &self.beats {
            Beats::Whole(beats) => beats.cut(span, self.treatment),
            Beats::Causal { at_ns, holes } => {
                let begin_ns = span.with_before(BEFORE_SECS).begin_ns;
                let place = |time_ns: i64| at_ns.partition_point(|&each| each < time_ns);
                let (begin, end) = (place(begin_ns), place(span.end_ns));
                let beats = at_ns.range(begin..end.max(begin)).copied();
                CorrectedBeats::of(span.begin_ns, beats, holes, &[]).cut(span, self.treatment)
            }
        }
    }
}

/// The part of the recipes about corrected beats.
const CORRECTED: &str = "beats corrected (Lipponen & Tarvainen 2019; natural changes spared)";
const AS_THEY_ARE: &str =
    "uncorrected intervals; artefacts (Lipponen & Tarvainen 2019) counted only";

/// An edit applies to a beat within this time of the one that the edit names [s].
pub const EDIT_WITHIN_SECS: f64 = 0.15;

impl Windows for HeartWindows {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        self.measure_after(span, None)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.measure_after(span, Some(last))
    }
}
