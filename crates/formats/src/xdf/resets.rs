//! Resets of a stream's clock: its computer was restarted, or replaced by another one.

use super::clock::Fit;

/// A measured offset that differs by more than this from the previous one belongs to another clock [s]: a delayed
/// measurement is wrong by less.
const RESET_SECS: f64 = 1.0;
/// The largest relative drift between two clocks, by which an offset may change over time.
const DRIFT: f64 = 1e-3;
/// LSL measures every 5 s: a stamp that is this much later than the last measurement may come from another clock [s].
const MEASURED_SECS: f64 = 10.0;
/// A stamp that goes back by more than this comes from the next clock, if it is this close to that clock's measurements
/// [s].
const BACK_SECS: f64 = 0.5;
const NEAR_SECS: f64 = 60.0;

/// A clock between two resets.
#[derive(Debug)]
struct Epoch {
    /// The first and the last time of the clock's offsets, by the clock itself [s].
    first_secs: f64,
    last_secs: f64,
    /// The recorder's clock minus this clock.
    offset: Fit,
}

impl Epoch {
    fn of(offsets: &[(f64, f64)]) -> Option<Epoch> {
        let times = || offsets.iter().map(|offset| offset.0);
        Some(Epoch {
            first_secs: times().reduce(f64::min)?,
            last_secs: times().reduce(f64::max)?,
            offset: Fit::without_outliers(offsets)?,
        })
    }

    fn convert(&self, secs: f64) -> f64 {
        secs + self.offset.at(secs)
    }

    /// How far a time is outside the epoch [s].
    fn distance_secs(&self, secs: f64) -> f64 {
        (self.first_secs - secs).max(secs - self.last_secs).max(0.0)
    }
}

/// Converts stamps to the recorder's clock, in place; returns how many times their clock was reset.
pub(super) fn convert(stamps_secs: &mut [f64], offsets: &[(f64, f64)]) -> usize {
    let epochs: Vec<Epoch> = split(offsets).into_iter().filter_map(Epoch::of).collect();
    let Some(mut now) = epochs.first() else { return 0 };
    let mut coming = &epochs[1..];
    let mut before_secs = f64::NEG_INFINITY;
    for stamp in stamps_secs {
        while let Some((later, rest)) = coming.split_first()
            && begins((now, later), *stamp, before_secs)
        {
            (now, coming) = (later, rest);
        }
        before_secs = now.convert(*stamp);
        *stamp = before_secs;
    }
    epochs.len() - 1
}

/// Whether a stamp belongs to the later of two clocks; `before_secs` is the previous stamp, converted [s].
fn begins((now, later): (&Epoch, &Epoch), secs: f64, before_secs: f64) -> bool {
    let (off_now_secs, off_later_secs) = (now.distance_secs(secs), later.distance_secs(secs));
    let is_earlier = |epoch: &Epoch| epoch.convert(secs) < before_secs - BACK_SECS;
    let goes_back = is_earlier(now) && !is_earlier(later) && off_later_secs < NEAR_SECS;
    goes_back || off_now_secs > off_later_secs.max(MEASURED_SECS)
}

/// Splits the offsets at resets.
fn split(offsets: &[(f64, f64)]) -> Vec<&[(f64, f64)]> {
    let mut parts = Vec::new();
    let mut start = 0;
    for at in 1..offsets.len() {
        if is_reset(&offsets[start..], at - start) {
            parts.push(&offsets[start..at]);
            start = at;
        }
    }
    parts.push(&offsets[start..]);
    parts
}

/// Whether the clock was reset before an offset: the offset jumps, and later ones do not return.
fn is_reset(offsets: &[(f64, f64)], at: usize) -> bool {
    let (before, found) = (offsets[at - 1], offsets[at]);
    let returns = at > 1 && !differs(offsets[at - 2], found);
    if returns || !differs(before, found) {
        return false;
    }
    match offsets.get(at + 1) {
        Some(after) => !differs(found, *after) && differs(before, *after),
        // The last offset may be an outlier, but a clock that goes back is another clock.
        None => found.0 < before.0,
    }
}

fn differs(a: (f64, f64), b: (f64, f64)) -> bool {
    let elapsed_secs = ((b.0 + b.1) - (a.0 + a.1)).abs();
    (b.1 - a.1).abs() > RESET_SECS + DRIFT * elapsed_secs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Offsets every 5 s for a recorder's clock within a span, of a clock that is this much behind it, and drifts.
    fn offsets(recorder_secs: std::ops::Range<i32>, behind_secs: f64) -> Vec<(f64, f64)> {
        let at = recorder_secs.step_by(5).map(f64::from);
        at.map(|secs| (secs - behind_secs, behind_secs + 2e-5 * secs)).collect()
    }

    /// Stamps at this rate while the recorder's clock was within a span.
    fn stamps(span: (f64, f64), rate_hz: f64, behind_secs: f64) -> Vec<f64> {
        let count = ((span.1 - span.0) * rate_hz) as usize;
        (0..count).map(|place| span.0 + place as f64 / rate_hz - behind_secs).collect()
    }

    /// The largest error of stamps that were sampled within two spans, by clocks that are behind by this much [s].
    fn worst_secs(spans: [(f64, f64); 2], rate_hz: f64, behind_secs: [f64; 2]) -> (usize, f64) {
        let (mut found, mut truth, mut measured) = (Vec::new(), Vec::new(), Vec::new());
        for (span, behind_secs) in spans.into_iter().zip(behind_secs) {
            found.extend(stamps(span, rate_hz, behind_secs));
            truth.extend(stamps(span, rate_hz, 0.0));
            measured.extend(offsets(span.0 as i32 + 2..span.1 as i32, behind_secs));
        }
        let resets = convert(&mut found, &measured);
        let off = found.iter().zip(&truth).map(|(found, truth)| (found - truth).abs());
        (resets, off.fold(0.0, f64::max))
    }

    #[test]
    fn stamps_are_converted_by_the_clock_that_they_are_of() {
        let spans = [(0.0, 120.0), (150.0, 300.0)];
        for rate_hz in [0.2, 1.0, 4.0, 250.0] {
            for behind_secs in [
                [-5000.0, 140.0],
                [140.0, -5000.0],
                [0.0, 50.0],
                [50.0, 0.0],
                [0.0, 10.0],
                [10.0, 0.0],
                [-1e6, 1e6],
                [0.0, 1.8],
                [1.8, 0.0],
            ] {
                let (resets, worst_secs) = worst_secs(spans, rate_hz, behind_secs);
                assert_eq!(resets, 1, "{behind_secs:?}");
                assert!(worst_secs < 0.02, "{worst_secs} s at {rate_hz} Hz, {behind_secs:?}");
            }
        }
    }

    #[test]
    fn a_stream_that_goes_on_without_a_pause_is_converted_as_well() {
        for behind_secs in [[0.0, 50.0], [0.0, 500.0], [500.0, 0.0]] {
            let (resets, worst_secs) =
                worst_secs([(0.0, 120.0), (120.0, 300.0)], 100.0, behind_secs);
            assert_eq!(resets, 1);
            assert!(worst_secs < 0.02, "{worst_secs} s, {behind_secs:?}");
        }
    }

    #[test]
    fn delayed_measurements_and_drift_are_no_resets() {
        let mut measured = offsets(0..600, 30.0);
        measured[10].1 += 1.7;
        measured[40].1 -= 3.0;
        measured.last_mut().unwrap().1 += 1.4;
        let mut found = stamps((0.0, 600.0), 10.0, 30.0);
        assert_eq!(convert(&mut found, &measured), 0);
        // A clock without a break for half a day.
        let slow: Vec<_> =
            (0..9000).map(|at| (f64::from(at) * 5.0, f64::from(at) * 5e-4)).collect();
        assert_eq!(convert(&mut [0.0, 1.0], &slow), 0);
        assert_eq!(convert(&mut [0.0, 1.0], &[(0.0, 0.0), (3600.0, 1.5)]), 0);
    }

    #[test]
    fn a_clock_may_be_reset_twice_and_at_the_end() {
        let measured =
            [offsets(0..60, 0.0), offsets(60..120, 1000.0), offsets(120..124, 2000.0)].concat();
        let mut found = [
            stamps((0.0, 60.0), 10.0, 0.0),
            stamps((60.0, 120.0), 10.0, 1000.0),
            stamps((120.0, 124.0), 10.0, 2000.0),
        ]
        .concat();
        assert_eq!(convert(&mut found, &measured), 2);
        let truth = stamps((0.0, 124.0), 10.0, 0.0);
        let off = found.iter().zip(&truth).map(|(found, truth)| (found - truth).abs());
        assert!(off.fold(0.0, f64::max) < 0.02);
        assert_eq!(convert(&mut [], &measured), 2);
        assert_eq!(convert(&mut [3.0], &[]), 0);
    }
}
