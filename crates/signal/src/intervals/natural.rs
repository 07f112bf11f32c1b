//! Natural variability that resembles artefacts.

use super::artefacts::{Artefact, Kind, Series};

/// Changes up to this many thresholds are in the tail of normal changes. The quartile deviation of absolute values,
/// from which thresholds are computed, is 0.42 standard deviations and not 0.67: 1.5 thresholds are the intended 3.3
/// standard deviations.
const TAIL_THRESHOLDS: f64 = 1.5;
/// An interval is near the usual one if it deviates by at most this share: half of the 20 % above which a beat is
/// commonly called premature.
const NEAR_USUAL: f64 = 0.1;
/// Even near the usual interval, changes above this many thresholds are too sudden: the beat is misplaced.
const SUDDEN_THRESHOLDS: f64 = 2.0;
/// The longest interval that may be a slower heart rather than a missed beat, relative to the usual interval.
const LONGEST_OFF: f64 = 0.5;
/// A neighbour is long, too, when its excess is at least this share of the longer one's.
const ALIKE: f64 = 0.4;

/// Whether an artefact is natural variability: changes due to breathing and posture, small ones in a steady
/// rhythm, or a long interval among others.
///
/// Missed and extra beats are never natural.
pub(super) fn is_natural(series: &Series, Artefact { beat, kind }: Artefact) -> bool {
    // An ectopic beat is recognised at the one after it.
    let first = match kind {
        Kind::Missed | Kind::Extra => return false,
        Kind::Ectopic => -1,
        Kind::LongShort => 0,
    };
    let most = |sizes: &mut dyn Iterator<Item = f64>| sizes.map(f64::abs).fold(0.0, f64::max);
    let change = most(&mut (first..=1).map(|by| series.change_at(beat, by)));
    let off = most(&mut (first..=0).map(|by| series.off_usual(beat.saturating_add_signed(by))));
    change <= TAIL_THRESHOLDS
        || (off <= NEAR_USUAL && change <= SUDDEN_THRESHOLDS)
        || (kind == Kind::LongShort && is_one_of_long_ones(series, beat))
}

/// Whether both an interval and an adjacent one are long, though neither is long enough to hide a beat.
fn is_one_of_long_ones(series: &Series, beat: usize) -> bool {
    let own = series.off_usual(beat);
    let is_alike = |beside: f64| {
        let (less, more) = if own < beside { (own, beside) } else { (beside, own) };
        less > ALIKE * more && more < LONGEST_OFF
    };
    own > 0.0
        && [beat.saturating_sub(1), beat + 1].map(|k| series.off_usual(k)).into_iter().any(is_alike)
}
