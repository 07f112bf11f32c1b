//! The store of an analysed PPG, which can be queried for any span.

use super::analysis::Settings;
use super::cycles::Cycles;
use super::doubt::{Doubt, MOST_FLAGGED};
use super::pieces::Pieces;
use super::pulse::Pulse;
use super::pulses::Pulses;
use super::quality::Quality;
use super::runs::Runs;
use super::smoothed::Smoothed;
use super::train::Train;
use super::values;
use super::view::View;
use crate::analysis::{LEAST_COVERAGE, Measured, Reason, Span, Track, Value, Windows};
use crate::hrv::{BEFORE_SECS, HeartWindows};
use crate::respiration::derived::BreathingWindows;

/// The smallest probability of the rate for which it is reported.
const LEAST_PROBABILITY: f64 = 0.4;
/// A pulse may be missed in a longer run of missing data [s].
const HIDING_SECS: f64 = 0.3;
/// The time before the end in which pulses are not known yet [s].
const UNKNOWN_SECS: f64 = 0.5;

/// The samples at the working rate and their pulses, as far as they do not depend on windows.
pub(super) struct PpgWindows {
    signal: Track,
    runs: Runs,
    smoothed: Smoothed,
    pieces: Pieces,
    pulses: Pulses,
    /// The sensor's motion and its limit, where known.
    motion: Option<(Track, f64)>,
    /// The heart windows, without heartbeats, which depend on the quality in each span.
    heart: HeartWindows,
    breathing: BreathingWindows,
    values: Vec<Value>,
}

impl PpgWindows {
    /// Creates a store; `how` states how pulses were detected.
    pub(super) fn new(rate_hz: f64, settings: &Settings, how: &'static str) -> PpgWindows {
        let heart = HeartWindows::causal().only(&settings.domains);
        let values = [values::of_signal(how, &settings.unit), heart.values().to_vec()].concat();
        PpgWindows {
            signal: Track::new(rate_hz),
            runs: Runs::new(rate_hz),
            smoothed: Smoothed::new(rate_hz),
            pieces: Pieces::new(rate_hz),
            pulses: Pulses::default(),
            motion: settings.motion_limit.map(|limit| (Track::new(rate_hz), limit)),
            heart,
            breathing: BreathingWindows::default(),
            values,
        }
    }

    pub(super) fn push(&mut self, at_ns: i64, value: f64, motion: f64) {
        self.signal.push(at_ns, value);
        self.runs.push(value);
        self.smoothed.push(value);
        self.pieces.take(&self.smoothed);
        self.pulses.settle(&self.smoothed);
        if let Some((track, _)) = &mut self.motion {
            track.push(at_ns, motion);
        }
    }

    /// Takes in a pulse; returns its time [ns], and the interval from the one before [ms]: NaN for the first one, and if
    /// missing data may hide a pulse between them.
    pub(super) fn push_pulse(&mut self, pulse: Pulse) -> (i64, f64) {
        let at_ns = self.signal.time_ns(pulse.sample).unwrap_or_default();
        let before = self.pulses.push(at_ns, pulse.sample);
        self.pulses.settle(&self.smoothed);
        let interval_ms = before.and_then(|before| self.interval_ms(before, pulse.sample));
        (at_ns, interval_ms.unwrap_or(f64::NAN))
    }

    /// The interval between two successive pulses [ms]; `None` if missing data may hide a pulse between them.
    fn interval_ms(&self, before: f64, pulse: f64) -> Option<f64> {
        let between = before as usize..pulse as usize;
        let hiding = (HIDING_SECS * self.signal.rate_hz()) as usize;
        let is_known =
            between.start >= self.signal.held().start && self.signal.longest_gap(between) <= hiding;
        is_known.then_some((pulse - before) / self.signal.rate_hz() * 1e3)
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        let before = Span { begin_ns: before_ns, end_ns: before_ns }.with_before(BEFORE_SECS);
        self.signal.forget(before.begin_ns);
        if let Some((track, _)) = &mut self.motion {
            track.forget(before.begin_ns);
        }
        self.pulses.forget(before.begin_ns);
        let first = self.signal.held().start;
        self.runs.forget(first);
        self.smoothed.forget(first);
        self.pieces.forget(first);
    }

    /// The data of a span, and of the minute before it.
    fn view(&self, span: Span) -> View {
        let rate_hz = self.signal.rate_hz();
        let context = span.with_before(BEFORE_SECS);
        let samples = self.signal.samples_in(context);
        let inside = self.signal.samples_in(span).start;
        let living = self.runs.living(samples.clone(), self.signal.iter(samples.clone()));
        let pulses = self.pulses.within(context, &self.smoothed);
        let seen = self.smoothed.part(samples.clone());
        let mut quality = Quality::over(rate_hz, &seen, &living, &pulses);
        self.discard_moved(&mut quality);
        let pieces = self.pieces.within(&(inside..samples.end)).copied().collect();
        let known = self.signal.held().end as f64 - UNKNOWN_SECS * rate_hz;
        let known = (samples.end as f64).min(known).max(inside as f64 + 1.0);
        View { quality, rate_hz, living, pulses, pieces, inside, known }
    }

    /// The probability that the pulse rate is correct within 10 %.
    fn probability(&self, view: &View, span: Span) -> f64 {
        let (seen, rate_hz) = (self.smoothed.part(self.smoothed.held()), self.signal.rate_hz());
        let doubt = Doubt {
            train: Train::of(&view.pulses_inside(), rate_hz),
            cycles: Cycles::of(&seen, &view.neighbours(), rate_hz),
            flagged: view.flagged(),
            skewness: view.skewness().unwrap_or(f64::NAN),
            secs: span.secs(),
        };
        doubt.probability()
    }

    fn discard_moved(&self, quality: &mut Quality) {
        let Some((track, limit)) = &self.motion else { return };
        quality.discard(|cycle| {
            let place = |at: f64| at.round().max(0.0) as usize;
            track.iter(place(cycle.begin)..place(cycle.end)).any(|level| level > *limit)
        });
    }
}

impl Windows for PpgWindows {
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

impl PpgWindows {
    /// Measures a span, reusing the expensive values of the heart rate from `last`.
    fn measure_after(&self, span: Span, last: Option<&Measured>) -> Measured {
        let coverage = self.signal.coverage(span);
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, 0.0, self.values.len(), Reason::Gap);
        }
        let view = self.view(span);
        let mut heart = self.heart.clone();
        view.good_pulses().for_each(|at_ns| heart.push(at_ns));
        view.holes().for_each(|(from_ns, to_ns)| heart.mark_gap(from_ns, to_ns));
        let mut of_pulses = view.of_pulses(span, &self.breathing);
        let mut of_heart = heart.measure_after(span, last).values;
        let quality = self.probability(&view, span);
        if view.flagged() > MOST_FLAGGED || quality < LEAST_PROBABILITY {
            of_pulses.fill(Err(Reason::Quality));
            of_heart.fill(Err(Reason::Quality));
        } else if view.is_blurred() {
            heart.withhold_variability(&mut of_heart);
        }
        let values = [of_pulses, view.of_signal(quality).values(), of_heart].concat();
        Measured { coverage, quality, values }
    }
}
