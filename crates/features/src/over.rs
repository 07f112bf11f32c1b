//! The samples of a stream that are held for its windows and phases, and the finished phases: each is reported once, as
//! far as its samples are still held.

use std::collections::VecDeque;
use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::feature::Outputs;
use teampulse_core::phases::Phase;
use teampulse_core::stream::{Shape, Signal, Stream};
use teampulse_core::time::Time;
use teampulse_signal::analysis::{LONGEST_HELD_NS, Span};

/// The part of a phase that is measured, as stated in a recipe.
pub(crate) const OVER_PHASES: &str = "each phase, or the last 600 s of a longer one, or less if these have more than 8 million numbers";

/// The most numbers of a stream that are held for windows and for the present phase: enough for 400 s of 20 channels at
/// 1 kHz. One stream takes a few times eight bytes for each number.
const MOST_HELD: u64 = 8_000_000;

/// Decides how far back the numbers of a stream are held, so that there are never more than
/// [`MOST_HELD`].
/// Time is counted in whole seconds of the stream's own time, so that any chunking holds the same numbers.
#[derive(Clone, Debug)]
pub(crate) struct Held {
    /// The most numbers.
    most: u64,
    /// The longest time that a window or a phase needs [s].
    longest_secs: i64,
    /// Each second with its count of numbers, ascending; some have none.
    seconds: VecDeque<(i64, u64)>,
    numbers: u64,
    /// The first second that is held.
    from_sec: Option<i64>,
}

impl Held {
    /// The limit for a stream with windows of these lengths [s].
    pub(crate) fn new(windows_secs: &[f64]) -> Held {
        let longest_secs = windows_secs.iter().copied().fold(0.0, f64::max).ceil() as i64;
        let longest_secs = longest_secs.max(LONGEST_HELD_NS / SECOND_NS);
        let (seconds, from_sec) = (VecDeque::new(), None);
        Held { most: MOST_HELD, longest_secs, seconds, numbers: 0, from_sec }
    }

    /// Counts numbers measured at a time [ns]. Late numbers count in the newest second.
    pub(crate) fn came(&mut self, at_ns: i64, numbers: u64) {
        let sec = at_ns.div_euclid(SECOND_NS);
        match self.seconds.back_mut() {
            Some((newest, count)) if *newest >= sec => *count += numbers,
            _ => self.seconds.push_back((sec, numbers)),
        }
        self.numbers += numbers;
        while let Some(&(first, count)) = self.seconds.front()
            && self.seconds.len() > 1
            && (self.numbers > self.most || sec.saturating_sub(first) > self.longest_secs)
        {
            if self.numbers > self.most {
                self.from_sec = Some(first.saturating_add(1));
            }
            self.numbers -= count;
            self.seconds.pop_front();
        }
    }

    /// The earliest time that can be held [ns].
    pub(crate) fn since_ns(&self) -> i64 {
        self.from_sec.map_or(i64::MIN, |sec| sec.saturating_mul(SECOND_NS))
    }

    /// Whether all of a window of this many seconds that ends now is held.
    fn holds(&self, secs: f64) -> bool {
        let now_ns = self.seconds.back().map_or(i64::MAX, |(sec, _)| sec.saturating_mul(SECOND_NS));
        now_ns.saturating_sub((secs * 1e9) as i64) >= self.since_ns()
    }

    /// The mean number of numbers in each second that is held.
    fn per_sec(&self) -> f64 {
        let ends = self.seconds.front().zip(self.seconds.back());
        let secs = ends.map_or(1, |((first, _), (newest, _))| newest.saturating_sub(*first) + 1);
        self.numbers as f64 / secs as f64
    }
}

/// The windows of a stream that are skipped, as they would hold too many numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeftOut(usize);

impl LeftOut {
    /// Reports, as a fault below the input, which windows of `lengths_secs` [s], ascending, are skipped; each once, as
    /// the rate of a stream may vary around the limit.
    pub(crate) fn report(
        &mut self,
        (input, leaf): (&Stream, &str),
        (held, lengths_secs): (&Held, &[f64]),
        at: Time,
        out: &mut Outputs,
    ) {
        let fitting = lengths_secs.iter().take_while(|secs| held.holds(**secs)).count();
        if lengths_secs.len() - fitting <= self.0 {
            return;
        }
        self.0 = lengths_secs.len() - fitting;
        let secs = lengths_secs[fitting];
        let label = format!(
            "{leaf}: windows of {secs} s and more are left out where they have more than {} numbers: {:.0} come \
             each second",
            held.most,
            held.per_sec()
        );
        refuse((input, leaf), label, held.per_sec(), at, out);
    }
}

/// Reports, as a fault below a stream, a feature that is not computed.
pub(crate) fn refuse(
    (input, leaf): (&Stream, &str),
    label: String,
    value: f64,
    at: Time,
    out: &mut Outputs,
) {
    let output = out.declare(Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        doc: format!("Features of {} that are not computed, with the reason.", input.name),
        ..Stream::derived(input, leaf, Shape::Event).below("refused")
    });
    let fault = Event { kind: EventKind::Fault, label, value, duration_secs: 0.0 };
    out.emit(output, at, Data::Event(Arc::new(fault)));
}

const SECOND_NS: i64 = 1_000_000_000;

/// The phases that were reported already.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReportedPhases(usize);

impl ReportedPhases {
    /// The next phase that has ended by a time [ns]; returns each phase once.
    pub(crate) fn next_over<'a>(&mut self, phases: &'a [Phase], at_ns: i64) -> Option<&'a Phase> {
        let is_over = |phase: &&Phase| phase.end.is_some_and(|end| end.nanos() <= at_ns);
        let next = phases.get(self.0).filter(is_over)?;
        self.0 += 1;
        Some(next)
    }

    /// When the next phase to be reported begins [ns]; `None` when it is not known yet.
    pub(crate) fn next_begin_ns(self, phases: &[Phase]) -> Option<i64> {
        phases.get(self.0).map(|phase| phase.begin.nanos())
    }
}

/// The part of a finished phase that is measured: all of it, or as much of its end as is held (`held_ns`).
/// `None` for a phase without length, or before the first sample (`since_ns`).
pub(crate) fn measured_span(phase: &Phase, since_ns: i64, held_ns: i64) -> Option<Span> {
    let (begin_ns, end_ns) = (phase.begin.nanos(), phase.end?.nanos());
    let begin_ns = begin_ns.max(end_ns.saturating_sub(LONGEST_HELD_NS)).max(held_ns);
    (end_ns > begin_ns.max(since_ns)).then_some(Span { begin_ns, end_ns })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The time from which numbers are held after this many seconds with this many numbers each
    /// [s].
    fn held_from_secs(secs: i64, numbers: u64) -> Option<i64> {
        let mut held = Held::new(&[]);
        for sec in 0..secs {
            for tenth in 0..10 {
                held.came(sec * SECOND_NS + tenth * SECOND_NS / 10, numbers / 10);
            }
            assert!(held.numbers <= MOST_HELD.max(numbers));
        }
        (held.since_ns() != i64::MIN).then(|| held.since_ns() / SECOND_NS)
    }

    #[test]
    fn a_usual_stream_is_held_for_ten_minutes() {
        for numbers in [130, 1000, 12_000] {
            assert_eq!(held_from_secs(2000, numbers), None, "{numbers} a second");
        }
    }

    #[test]
    fn a_stream_at_its_limit_holds_a_bounded_number() {
        assert_eq!(held_from_secs(600, 200_000), Some(560));
        assert_eq!(held_from_secs(600, 20_000), Some(200));
        assert_eq!(held_from_secs(50, 10_000_000), Some(49));
    }

    #[test]
    fn a_window_fits_while_it_has_no_more_numbers_than_are_held() {
        // 3600 s of 1 kHz are 3.6 million numbers, of 20 kHz 72 million.
        for (numbers, fits) in [
            (1000, [true, true, true]),
            (20_000, [true, true, false]),
            (200_000, [true, false, false]),
        ] {
            let lengths_secs = [30.0, 300.0, 3600.0];
            let mut held = Held::new(&lengths_secs);
            (0..4000).for_each(|sec| held.came(sec * SECOND_NS, numbers));
            assert_eq!(lengths_secs.map(|secs| held.holds(secs)), fits, "{numbers} a second");
            assert!((held.per_sec() / numbers as f64 - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn late_numbers_and_those_after_a_gap_count_too() {
        let mut held = Held::new(&[]);
        held.came(1000 * SECOND_NS, 6_000_000);
        held.came(500 * SECOND_NS, 1_000_000);
        assert_eq!(held.since_ns(), i64::MIN);
        held.came(1001 * SECOND_NS, 1_500_000);
        assert_eq!(held.since_ns(), 1001 * SECOND_NS);
        held.came(9000 * SECOND_NS, 10);
        assert_eq!((held.numbers, held.since_ns()), (10, 1001 * SECOND_NS));
    }
}
