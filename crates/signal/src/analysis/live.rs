use super::{Cadence, Causal, Event, LEAST_COVERAGE, Measured, Reason, Span, Value};
use crate::error::SignalError;

/// Creates an analysis for a rate [Hz].
pub type Make = Box<dyn Fn(f64) -> Result<Box<dyn Causal + Send>, SignalError> + Send>;

/// A running analysis of a stream of samples: fills gaps, reports events as they become known, and windows as
/// they end.
///
/// Windows of each length end together, one hop apart counted from the first sample, and are reported when
/// the first sample at or after their end arrives, or the stream [ends](Self::finish) there. A gap is filled
/// with missing samples. During a gap longer than the longest window nothing is reported; after one that is
/// also longer than [`LONGEST_HELD_NS`], or that would take a million samples to fill, the analysis restarts.
/// All results are a function of the samples and their times alone: a live session, its replay and a later
/// analysis of the same samples agree bit for bit.
///
/// Expensive values are recomputed every 10 s and [held](super::Windows::measure_again) in between. Windows
/// of different lengths, and [of different signals](Causal::turn_secs), are recomputed in different seconds,
/// determined only by their lengths and the start, to spread the load.
///
/// Other spans than windows can be queried with [`measure`](Self::measure) while
/// [`hold_from`](Self::hold_from) keeps their samples; that does not affect the windows.
pub struct Live {
    make: Make,
    analysis: Box<dyn Causal + Send>,
    rate_hz: f64,
    lengths_ns: Vec<i64>,
    hop_ns: i64,
    /// The time from the start to the first window end [ns].
    first_ns: i64,
    cadence: Cadence,
    begin_ns: Option<i64>,
    /// The next window end.
    end_ns: i64,
    /// For each length, the turn of the last full computation and its result.
    whole: Vec<Option<(i64, Measured)>>,
    /// The start of what is held for spans other than windows.
    held_from_ns: Option<i64>,
    /// Nothing before this time is held.
    held_since_ns: i64,
    /// The number of samples before the last restart.
    before: usize,
    pushed: usize,
    nothing: Vec<f64>,
}

/// How far back samples can be held for spans other than windows [ns]: 600 s, plus 5 s for queries shortly
/// after a span has ended.
pub const LONGEST_HELD_NS: i64 = 600_000_000_000;

/// The most samples filled into a gap: at 1 kHz a quarter of an hour.
const MOST_FILLED: usize = 1_000_000;
/// How long after its end a span may be queried, by when all of its events are known [ns].
const ASKED_LATER_NS: i64 = 5_000_000_000;

/// The largest factor by which an interval between samples may exceed that of the nominal rate.
const CLOCKS_DIFFER: f64 = 1.01;

/// The period after which a window is fully recomputed [ns].
const ANEW_NS: i64 = 10_000_000_000;
/// A window's length modulo this is its phase within that period [ns]: windows of 30, 60 and 300 s come 2 s
/// apart.
const TURNS_NS: i64 = 7_000_000_000;

/// A result of a live analysis.
#[derive(Clone, Debug, PartialEq)]
pub enum LiveOutput {
    /// An event.
    Event(Event),
    /// The values of a window, with the index of its length.
    Window(usize, Span, Measured),
}

impl Live {
    /// Creates an analysis of `channels` channels at `rate_hz` [Hz] in windows of `lengths_ns` [ns], reported every
    /// `hop_ns` [ns]. Without lengths, only events are reported and everything is kept. At a rate of 0, samples are
    /// irregular and never count as missing.
    pub fn new(
        make: Make,
        rate_hz: f64,
        channels: usize,
        lengths_ns: &[i64],
        hop_ns: i64,
    ) -> Result<Live, SignalError> {
        let nothing = vec![f64::NAN; channels];
        Ok(Live {
            analysis: make(rate_hz)?,
            make,
            rate_hz,
            lengths_ns: lengths_ns.iter().map(|length_ns| (*length_ns).max(1)).collect(),
            hop_ns: hop_ns.max(1),
            first_ns: hop_ns.max(1),
            cadence: Cadence::new(rate_hz),
            begin_ns: None,
            end_ns: 0,
            whole: vec![None; lengths_ns.len()],
            held_from_ns: None,
            held_since_ns: i64::MIN,
            before: 0,
            pushed: 0,
            nothing,
        })
    }

    /// Sets the origin of the windows' ends to a time [ns] instead of the time of the first sample.
    #[must_use]
    pub fn beginning_at(mut self, begin_ns: i64) -> Live {
        self.begin_ns = Some(begin_ns);
        self.end_ns = begin_ns.saturating_add(self.first_ns);
        self
    }

    /// Sets the first window end to `first_ns` [ns] after the start (at most one hop); the others follow every
    /// hop.
    #[must_use]
    pub fn first_after(mut self, first_ns: i64) -> Live {
        self.first_ns = first_ns.clamp(1, self.hop_ns);
        self
    }

    /// The next window end [ns]; `None` before the first sample.
    pub fn next_end_ns(&self) -> Option<i64> {
        self.begin_ns.map(|_| self.end_ns)
    }

    /// The time of the newest sample [ns]; `None` before the first.
    pub fn newest_ns(&self) -> Option<i64> {
        self.cadence.last_ns()
    }

    /// The time of the first sample, or the origin set for the windows [ns]; `None` before the first.
    pub fn begin_ns(&self) -> Option<i64> {
        self.begin_ns
    }

    /// From now on, keeps what is needed by spans that start at or after a time [ns], up to [`LONGEST_HELD_NS`]; `None`
    /// keeps only what windows need.
    pub fn hold_from(&mut self, begin_ns: Option<i64>) {
        self.held_from_ns = begin_ns;
    }

    /// Drops everything before a time [ns] and reports no windows that start before it, to bound memory. The
    /// limit never moves back.
    pub fn hold_since(&mut self, since_ns: i64) {
        self.held_since_ns = self.held_since_ns.max(since_ns);
    }

    /// The values computed for each window.
    pub fn values(&self) -> &[Value] {
        self.analysis.values()
    }

    /// The values of a span, as far as its samples are still held.
    pub fn measure(&self, span: Span) -> Measured {
        self.aged(span, self.analysis.measure(span))
    }

    /// Marks a window shorter than its length as short.
    fn aged(&self, span: Span, measured: Measured) -> Measured {
        let is_young = self.begin_ns.is_none_or(|begin_ns| span.begin_ns < begin_ns);
        if is_young && measured.coverage < LEAST_COVERAGE { young(measured) } else { measured }
    }

    /// Takes in the sample measured at `at_ns` [ns], and reports what it completes.
    ///
    /// Returns the number of samples missing before it; `None` when it is not after the last one and was
    /// dropped.
    pub fn push(
        &mut self,
        at_ns: i64,
        channels: &[f64],
        report: &mut dyn FnMut(LiveOutput),
    ) -> Option<usize> {
        let last_ns = self.cadence.last_ns();
        let missing = self.cadence.missing_before(at_ns)?;
        let Some(last_ns) = last_ns else {
            if self.begin_ns.is_none() {
                self.begin_ns = Some(at_ns);
                self.end_ns = at_ns.saturating_add(self.first_ns);
            }
            self.end_ns = self.end_ns.max(self.end_after_ns(at_ns.saturating_sub(self.hop_ns)));
            self.take(at_ns, channels, report);
            return Some(0);
        };
        let gap_ns = at_ns.saturating_sub(last_ns);
        if self.empties_windows(gap_ns) {
            self.end_ns = self.end_after_ns(at_ns);
            self.whole.fill(None);
        }
        let is_long = self.empties_windows(gap_ns) && gap_ns > LONGEST_HELD_NS;
        if is_long || missing > MOST_FILLED {
            self.whole.fill(None);
            self.begin_anew(missing);
        } else {
            for number in 1..=missing {
                let missing_ns = Cadence::missing_ns(last_ns, at_ns, number, missing);
                let nothing = std::mem::take(&mut self.nothing);
                self.take(missing_ns, &nothing, report);
                self.nothing = nothing;
            }
        }
        self.take(at_ns, channels, report);
        Some(missing)
    }

    /// At the end of the stream, reports the windows that the samples so far fill: those that end at most one sample
    /// interval after the newest sample.
    pub fn finish(&mut self, report: &mut dyn FnMut(LiveOutput)) {
        let Some(newest_ns) = self.newest_ns() else { return };
        let interval_ns = if self.rate_hz > 0.0 { 1e9 / self.rate_hz * CLOCKS_DIFFER } else { 1.0 };
        let complete_ns = newest_ns.saturating_add(interval_ns.ceil() as i64);
        self.report_until(complete_ns, report);
    }

    /// Whether a gap [ns] is too long for any window to hold data from before it.
    fn empties_windows(&self, gap_ns: i64) -> bool {
        self.lengths_ns.iter().max().is_some_and(|&longest_ns| gap_ns > longest_ns)
    }

    /// The first window end after a time [ns]; those in between have no data.
    fn end_after_ns(&self, at_ns: i64) -> i64 {
        let [at, end, hop] = [at_ns, self.end_ns, self.hop_ns].map(i128::from);
        let hops = (at - end).div_euclid(hop) + 1;
        i64::try_from(end + hops.max(0) * hop).unwrap_or(i64::MAX)
    }

    fn begin_anew(&mut self, missing: usize) {
        // The rate was valid when the analysis was created.
        if let Ok(analysis) = (self.make)(self.rate_hz) {
            self.analysis = analysis;
        }
        self.before += self.pushed + missing;
        self.pushed = 0;
    }

    fn take(&mut self, at_ns: i64, channels: &[f64], report: &mut dyn FnMut(LiveOutput)) {
        self.report_until(at_ns, report);
        self.analysis.push(at_ns, channels);
        self.pushed += 1;
        while let Some(mut event) = self.analysis.next_event() {
            event.sample += self.before as f64;
            report(LiveOutput::Event(event));
        }
    }

    /// Reports the windows that end at a time [ns] or earlier.
    fn report_until(&mut self, at_ns: i64, report: &mut dyn FnMut(LiveOutput)) {
        // At the end of the range of times, no other window ends.
        while at_ns >= self.end_ns && self.end_ns < i64::MAX && !self.lengths_ns.is_empty() {
            self.report_windows(report);
        }
    }

    fn measure_window(&mut self, place: usize, span: Span) -> Measured {
        let turn = self.turn(place, span.end_ns);
        match &self.whole[place] {
            Some((last_turn, last)) if *last_turn == turn => {
                self.analysis.measure_again(span, last)
            }
            _ => {
                let measured = self.analysis.measure(span);
                self.whole[place] = Some((turn, measured.clone()));
                measured
            }
        }
    }

    /// The number of the turn in which windows of a length (by index) end at a time [ns].
    fn turn(&self, place: usize, end_ns: i64) -> i64 {
        let since_ns = end_ns.saturating_sub(self.begin_ns.unwrap_or(end_ns));
        let turn_ns = self.lengths_ns[place] % TURNS_NS + self.analysis.turn_secs() * 1_000_000_000;
        since_ns.saturating_sub(turn_ns).div_euclid(ANEW_NS)
    }

    fn report_windows(&mut self, report: &mut dyn FnMut(LiveOutput)) {
        let mut earliest_ns = self.end_ns;
        for place in 0..self.lengths_ns.len() {
            let begin_ns = self.end_ns.saturating_sub(self.lengths_ns[place]);
            if begin_ns < self.held_since_ns {
                self.whole[place] = None;
                continue;
            }
            let span = Span { begin_ns, end_ns: self.end_ns };
            let measured = self.measure_window(place, span);
            report(LiveOutput::Window(place, span, self.aged(span, measured)));
            earliest_ns = earliest_ns.min(begin_ns);
        }
        let held_ns = self.held_from_ns.map_or(i64::MAX, |held_from_ns| {
            held_from_ns.max(self.end_ns.saturating_sub(LONGEST_HELD_NS + ASKED_LATER_NS))
        });
        let needed_ns = earliest_ns.saturating_add(self.hop_ns).min(held_ns);
        self.analysis.forget(needed_ns.max(self.held_since_ns));
        self.end_ns = self.end_ns.saturating_add(self.hop_ns);
    }
}

/// Replaces the reason for missing values: before the first sample nothing is missing, the window is only not
/// yet full.
fn young(measured: Measured) -> Measured {
    let reason = |reason| if reason == Reason::Gap { Reason::Short } else { reason };
    let values = measured.values.into_iter().map(|value| value.map_err(reason)).collect();
    Measured { values, ..measured }
}

#[cfg(test)]
mod tests;
