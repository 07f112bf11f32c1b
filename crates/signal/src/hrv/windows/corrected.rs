//! Corrected beats.

use super::cut::{Cut, LONGEST_EDGE_SECS};
use super::holes::Holes;
use super::{EDIT_WITHIN_SECS, Treatment};
use crate::analysis::Span;
use crate::intervals::{Beats, Correction, Edit, Kind, PLAUSIBLE_MS};

/// A time without a beat that is longer than this [s] is a hole: even at the longest plausible interval (2 s), more
/// than one beat was missed.
const LONGEST_SECS: f64 = 4.0;

/// Beats after correction, each stretch between holes on its own.
#[derive(Clone, Debug)]
pub(super) struct CorrectedBeats {
    origin_ns: i64,
    /// The time of each beat [s since the origin], and whether an interval ends there.
    beats: Vec<(f64, bool)>,
    /// The beats before correction, likewise.
    uncorrected: Vec<(f64, bool)>,
    /// Beats as detected and edited [s].
    detected_secs: Vec<f64>,
    /// The corrections with their times [s], in order.
    corrections: Vec<(f64, Kind)>,
    /// Times without data [s].
    holes_secs: Vec<(f64, f64)>,
}

impl CorrectedBeats {
    pub(super) fn of(
        origin_ns: i64,
        at_ns: impl Iterator<Item = i64>,
        holes: &Holes,
        edits: &[Edit],
    ) -> CorrectedBeats {
        let secs = |at_ns: i64| at_ns.saturating_sub(origin_ns) as f64 / 1e9;
        let detected = Beats::detected(&at_ns.map(secs).collect::<Vec<_>>());
        let (detected, _) = detected.edited(edits, EDIT_WITHIN_SECS);
        let holes_secs: Vec<(f64, f64)> =
            holes.iter().map(|(from_ns, to_ns)| (secs(from_ns), secs(to_ns))).collect();
        let (mut beats, mut uncorrected, mut corrections) = (Vec::new(), Vec::new(), Vec::new());
        for stretch in
            detected.split(|from, to| to - from > LONGEST_SECS || crosses(&holes_secs, from, to))
        {
            let times_secs = stretch.times_secs().iter().copied().enumerate();
            uncorrected.extend(times_secs.map(|(place, at_secs)| (at_secs, place > 0)));
            let corrected = Correction::default().correct(&stretch);
            let is_one = corrected.beats.intervals_ms().into_iter().map(f64::is_finite);
            let is_one = std::iter::once(false).chain(is_one);
            beats.extend(corrected.beats.times_secs().iter().copied().zip(is_one));
            corrections.extend(corrected.corrections);
        }
        corrections.sort_by(|a: &(f64, Kind), b| a.0.total_cmp(&b.0));
        let detected_secs = detected.times_secs().to_vec();
        CorrectedBeats { origin_ns, beats, uncorrected, detected_secs, corrections, holes_secs }
    }

    /// The beats within a span.
    pub(super) fn cut(&self, span: Span, treatment: Treatment) -> Cut {
        let secs = |at_ns: i64| at_ns.saturating_sub(self.origin_ns) as f64 / 1e9;
        let (begin_secs, end_secs) = (secs(span.begin_ns), secs(span.end_ns));
        let held = |at_secs: f64| (begin_secs..end_secs).contains(&at_secs);
        let within = |beats: &'_ [(f64, bool)]| {
            let first = beats.partition_point(|beat| beat.0 < begin_secs);
            first..beats.partition_point(|beat| beat.0 < end_secs).max(first)
        };
        let uncorrected = &self.uncorrected[within(&self.uncorrected)];
        let beats = match treatment {
            Treatment::Corrected => &self.beats[within(&self.beats)],
            Treatment::AsTheyAre => uncorrected,
        };
        let detected = self.detected_secs.iter().filter(|&&at_secs| held(at_secs)).count();
        let corrections = self.corrections.iter().filter(|each| held(each.0));
        let plausible = |interval_ms: f64| {
            let is_one = treatment == Treatment::AsTheyAre || PLAUSIBLE_MS.contains(&interval_ms);
            if is_one { interval_ms } else { f64::NAN }
        };
        let intervals_ms: Vec<f64> = intervals_ms(beats).map(plausible).collect();
        let present_ms: f64 = intervals_ms.iter().filter(|each| each.is_finite()).sum();
        let edge = |from: f64, to: f64| {
            let counts = to - from <= LONGEST_EDGE_SECS && !crosses(&self.holes_secs, from, to);
            if counts { to - from } else { 0.0 }
        };
        let edges_secs = match (beats.first(), beats.last()) {
            (Some(first), Some(last)) => edge(begin_secs, first.0) + edge(last.0, end_secs),
            _ => 0.0,
        };
        let covered = (present_ms / 1000.0 + edges_secs) / span.secs();
        Cut {
            coverage: if covered.is_finite() { covered.clamp(0.0, 1.0) } else { 0.0 },
            window_secs: span.secs(),
            ends_secs: beats.iter().skip(1).map(|beat| beat.0 - begin_secs).collect(),
            intervals_ms,
            uncorrected_ms: self::intervals_ms(uncorrected).collect(),
            detected,
            corrections: corrections.map(|each| each.1).collect(),
        }
    }
}

/// Intervals between successive beats [ms]; NaN where there is none.
fn intervals_ms(beats: &[(f64, bool)]) -> impl Iterator<Item = f64> + '_ {
    beats.windows(2).map(|pair| {
        // Times are whole nanoseconds: rounding must not turn 50 ms into more than 50 ms.
        let interval_ms = ((pair[1].0 - pair[0].0) * 1e9).round() / 1e6;
        if pair[1].1 { interval_ms } else { f64::NAN }
    })
}

/// Whether a hole lies between two times [s].
fn crosses(holes_secs: &[(f64, f64)], from: f64, to: f64) -> bool {
    let first = holes_secs.partition_point(|hole| hole.1 <= from);
    holes_secs.get(first).is_some_and(|hole| hole.0 < to)
}
