//! The statistics of one stream.

use teampulse_core::data::Data;
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::{BASELINE, Phase, Phases};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Stream, Subject};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;
use teampulse_signal::analysis::LONGEST_HELD_NS;
use teampulse_signal::descriptive::{Pace, Rolling, View};

use super::outputs::{hop_secs_of, over_phases, over_window};
use super::values::{coverage, statistics, with_differences};
use crate::over::{Held, LeftOut, ReportedPhases, measured_span};
use crate::value::{Value, window_of};

/// Windows end at whole seconds of the stream's own time [ns].
const HOP_NS: i64 = 1_000_000_000;

/// The statistics of one stream.
pub(super) struct TrackedStream {
    stream: Stream,
    /// The subject of the stream.
    subject: Subject,
    windows_secs: Vec<f64>,
    /// `None` while the stream's numbers can't be read.
    work: Option<Work>,
    reported_phases: ReportedPhases,
}

struct Work {
    readout: Readout,
    rolling: Rolling,
    held: Held,
    left_out: LeftOut,
    windows: Vec<OutputId>,
    /// The statistics of the newest finished baseline.
    baseline: Option<Vec<Value>>,
}

impl TrackedStream {
    pub(super) fn new(stream: &Stream, windows_secs: &[f64]) -> TrackedStream {
        let (stream, subject) = (stream.clone(), stream.subject());
        let (windows_secs, reported_phases) = (windows_secs.to_vec(), ReportedPhases::default());
        TrackedStream { stream, subject, windows_secs, work: None, reported_phases }
    }

    /// Takes in a declaration of the stream: only different channels restart the statistics.
    pub(super) fn join(&mut self, stream: &Stream, out: &mut Outputs) {
        let names = |of: &Stream| {
            of.channels.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>()
        };
        let is_same = names(&self.stream) == names(stream);
        self.stream = stream.clone();
        let known = self.work.take().filter(|_| is_same);
        self.work = Readout::of(stream).map(|readout| {
            let windows =
                self.windows_secs.iter().map(|secs| out.declare(over_window(stream, *secs)));
            let windows = windows.collect();
            if let Some(mut work) = known {
                work.rolling.set_rate_hz(stream.rate_hz);
                Work { readout, windows, ..work }
            } else {
                let (rolling, held) = (self.rolling(), Held::new(&self.windows_secs));
                let left_out = LeftOut::default();
                Work { readout, windows, rolling, held, left_out, baseline: None }
            }
        });
    }

    fn rolling(&self) -> Rolling {
        let pace =
            |secs: &f64| Pace { length_ns: (secs * 1e9) as i64, hops: hop_secs_of(*secs) as i64 };
        let paces: Vec<Pace> = self.windows_secs.iter().map(pace).collect();
        Rolling::new(self.stream.rate_hz, self.stream.channels.len(), &paces, HOP_NS)
    }

    /// Takes in a sample of the stream, on time or late.
    pub(super) fn push(&mut self, sample: &Sample, phases: &Phases, out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        // A sample with another number of channels than declared counts as missing.
        let missing = || vec![f64::NAN; self.stream.channels.len()];
        let numbers = work.readout.read(&sample.data).map_or_else(missing, <[f64]>::to_vec);
        for (place, numbers) in numbers.chunks_exact(self.stream.channels.len()).enumerate() {
            let after_ns = (sample.period_ns * place as f64).round() as i64;
            let at_ns = sample.measured.nanos().saturating_add(after_ns);
            self.report_phases(&mut work, phases.of(&self.subject), at_ns, out);
            while let Some(end_ns) = work.rolling.advance(at_ns) {
                self.report_windows(&mut work, end_ns, out);
            }
            work.rolling.push(at_ns, numbers);
            work.held.came(at_ns, numbers.len() as u64);
            work.rolling.hold_since(work.held.since_ns());
        }
        let input = (&self.stream, "statistics");
        work.left_out.report(input, (&work.held, &self.windows_secs), sample.measured, out);
        self.work = Some(work);
    }

    /// Reports the phases that are over at `now`, whether or not samples have arrived since.
    pub(super) fn end_phases(&mut self, phases: &Phases, now: Time, out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        self.report_phases(&mut work, phases.of(&self.subject), now.nanos(), out);
        self.work = Some(work);
    }

    fn report_windows(&self, work: &mut Work, end_ns: i64, out: &mut Outputs) {
        for (place, secs) in self.windows_secs.iter().enumerate() {
            if !work.rolling.ends(place, end_ns) {
                continue;
            }
            let view = work.rolling.window(place);
            let values = with_differences(&view, work.baseline.as_deref());
            out.emit(work.windows[place], Time::from_nanos(end_ns), feature(*secs, &view, &values));
        }
    }

    /// Reports phases that ended at or before a time [ns], and keeps the samples that the next one
    /// needs.
    fn report_phases(&mut self, work: &mut Work, phases: &[Phase], at_ns: i64, out: &mut Outputs) {
        while let Some(phase) = self.reported_phases.next_over(phases, at_ns) {
            self.report_phase(work, phase, out);
        }
        let longest_ns = work.rolling.newest_ns().map_or(at_ns, |newest_ns| newest_ns.max(at_ns));
        let longest_ns = longest_ns.saturating_sub(LONGEST_HELD_NS).max(work.held.since_ns());
        let next_ns = self.reported_phases.next_begin_ns(phases);
        work.rolling.keep_from(next_ns.map_or(i64::MAX, |next_ns| next_ns.max(longest_ns)));
    }

    fn report_phase(&self, work: &mut Work, phase: &Phase, out: &mut Outputs) {
        let since_ns = work.rolling.begin_ns();
        let held_ns = work.held.since_ns();
        let Some(span) = since_ns.and_then(|since_ns| measured_span(phase, since_ns, held_ns))
        else {
            return;
        };
        let view = work.rolling.describe(span);
        if phase.label == BASELINE {
            work.baseline = Some(statistics(&view));
        }
        let values = with_differences(&view, work.baseline.as_deref());
        let output = out.declare(over_phases(&self.stream));
        out.emit(output, Time::from_nanos(span.end_ns), feature(span.secs(), &view, &values));
    }
}

fn feature(window_secs: f64, view: &View, values: &[Value]) -> Data {
    window_of(window_secs, coverage(view), 1.0, values)
}
