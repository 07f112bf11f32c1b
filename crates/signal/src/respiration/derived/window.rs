//! The breathing rate of windows, from segments that they share.

use std::cell::RefCell;

use super::Derived;
use super::fusion::{STRETCH_NS, Stretch};
use super::kept::Kept;
use super::modulation::{Beat, intervals};
use crate::analysis::{Reason, Span};
use crate::estimate::Estimate;
use crate::gaps::is_usable;
use crate::robust::{SIGMA_FROM_MAD, mad, median};

/// The largest standard uncertainty reported [1/min].
const LARGEST_SIGMA: f64 = 2.0;
/// The smallest share of a window that intervals between beats must cover.
const LEAST_COVERED: f64 = 0.5;
/// The tolerance for a window shorter than a segment by rounding [ns].
const ROUNDING_NS: i64 = 1_000;

/// Computes the breathing rate of successive windows.
///
/// Segment results are cached, because windows that end each second share most of theirs. The cache does not
/// affect the results: a segment whose beats have changed is recomputed.
#[derive(Default)]
pub(crate) struct BreathingWindows {
    kept: RefCell<Kept>,
}

impl BreathingWindows {
    /// The rate in a span; beats outside it, or out of order, are left out.
    pub(crate) fn measure(
        &self,
        beats: impl Iterator<Item = Beat>,
        span: Span,
    ) -> Result<Derived, Reason> {
        if span.end_ns.saturating_sub(span.begin_ns) < STRETCH_NS - ROUNDING_NS {
            return Err(Reason::Short);
        }
        let beats = ascending(beats, span);
        let has_height = |beat: &Beat| beat.heights.iter().any(|&height| is_usable(height));
        if !beats.is_empty() && !beats.iter().any(has_height) {
            return Err(Reason::Missing);
        }
        let covered_secs: f64 = intervals(&beats, span.begin_ns).map(|(_, secs)| secs).sum();
        if covered_secs < LEAST_COVERED * span.secs() {
            return Err(Reason::Gap);
        }
        let mut kept = self.kept.borrow_mut();
        let (mut all, mut results) = (0, Vec::new());
        for begin_ns in stretches(span) {
            all += 1;
            let place = |at_ns: i64| beats.partition_point(|beat| beat.at_ns < at_ns);
            let within = place(begin_ns)..place(begin_ns.saturating_add(STRETCH_NS));
            results.extend(kept.stretch(&beats[within], begin_ns));
        }
        of_stretches(&results, all)
    }
}

fn ascending(beats: impl Iterator<Item = Beat>, span: Span) -> Vec<Beat> {
    let mut ascending: Vec<Beat> = Vec::with_capacity(beats.size_hint().0);
    for beat in beats.filter(|beat| span.holds(beat.at_ns)) {
        if ascending.last().is_none_or(|last| last.at_ns < beat.at_ns) {
            ascending.push(beat);
        }
    }
    ascending
}

/// The starts of segments with 50 % overlap that fill the span [ns].
fn stretches(span: Span) -> impl Iterator<Item = i64> {
    let spare_ns = span.end_ns.saturating_sub(span.begin_ns).saturating_sub(STRETCH_NS).max(0);
    let hop_ns = STRETCH_NS / 2;
    let steps = (spare_ns - ROUNDING_NS + hop_ns - 1) / hop_ns;
    let share_ns =
        move |step: i64| i128::from(spare_ns) * i128::from(step) / i128::from(steps.max(1));
    (0..=steps).map(move |step| span.begin_ns.saturating_add(share_ns(step) as i64))
}

/// The median of the segments with a result, out of all of them.
fn of_stretches(results: &[Stretch], all: usize) -> Result<Derived, Reason> {
    if results.is_empty() || 2 * results.len() < all {
        return Err(Reason::Quality);
    }
    let rate_per_min = median_of(results);
    if rate_per_min.sigma > LARGEST_SIGMA {
        return Err(Reason::Quality);
    }
    let clarities: f64 = results.iter().map(|stretch| stretch.clarity).sum();
    Ok(Derived { rate_per_min, clarity: clarities / all as f64 })
}

/// The median rate; two segments that overlap by half count as one and a half.
fn median_of(results: &[Stretch]) -> Estimate {
    let rates: Vec<f64> = results.iter().map(|stretch| stretch.rate_per_min.value).collect();
    let value = median(&rates).unwrap_or(f64::NAN);
    let within: f64 = results.iter().map(|each| each.rate_per_min.sigma.powi(2)).sum();
    let between = (SIGMA_FROM_MAD * mad(&rates).unwrap_or(f64::NAN)).powi(2);
    let count = rates.len() as f64;
    let variance = within / count + between;
    Estimate { value, sigma: (variance / (count / 2.0 + 0.5)).sqrt() }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A beat some 0.8 s after the one before it, with a rhythm of 15 a minute and some noise.
    fn beat(number: i64) -> Beat {
        let secs = 0.8 * number as f64;
        let breath = (TAU * 0.25 * secs).sin();
        let noise = |factor: i64| (number * factor % 97) as f64 / 97.0 - 0.5;
        let at_ns = ((secs + 0.03 * breath) * 1e9) as i64;
        Beat { at_ns, heights: [1.0 + 0.1 * breath + 0.1 * noise(31), 0.2 * noise(57) - breath] }
    }

    #[test]
    fn what_is_kept_is_what_would_be_reported_anew() {
        let kept = BreathingWindows::default();
        for end_secs in 300..420 {
            let end_ns = end_secs * 1_000_000_000;
            // The newest beats are not known yet, and one is found some seconds later.
            let known = (0..600).map(beat).filter(|beat| beat.at_ns < end_ns - 400_000_000);
            let known = known.filter(|beat| end_secs > 350 || beat.at_ns / 1_000_000_000 != 340);
            for length_secs in [30, 45, 50, 60, 300] {
                let span = Span { begin_ns: end_ns - length_secs * 1_000_000_000, end_ns };
                let results = kept.measure(known.clone(), span);
                assert_eq!(results, BreathingWindows::default().measure(known.clone(), span));
                assert!((results.unwrap().rate_per_min.value - 15.0).abs() < 1.0);
            }
        }
    }

    #[test]
    fn stretches_fill_a_span_and_overlap_by_half_at_least() {
        for (length_secs, begins_secs) in
            [(30, vec![0.0]), (45, vec![0.0, 15.0]), (50, vec![0.0, 10.0, 20.0])]
        {
            let span = Span { begin_ns: 0, end_ns: length_secs * 1_000_000_000 };
            let begins: Vec<f64> = stretches(span).map(|begin_ns| begin_ns as f64 / 1e9).collect();
            assert_eq!(begins, begins_secs);
        }
    }
}
