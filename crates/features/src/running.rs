//! A running analysis of the signal crate on one stream of a person.

use std::sync::Arc;

use teampulse_core::data::{Data, Event, FeatureValues, Reason};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::Phase;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Channel, Shape, Signal, Stream, Window};
use teampulse_core::time::Time;
use teampulse_core::units::{Conversion, worked_in};
use teampulse_messages::readout::Readout;
use teampulse_signal::analysis::{self, Live, LiveOutput, Measured, Value};

use crate::analyses::{Analysis, Chosen, Documented, Happening};
use crate::over::{Held, LeftOut, OVER_PHASES, ReportedPhases, measured_span, refuse};

/// Windows are reported once a second of the stream's own time.
const HOP_NS: i64 = 1_000_000_000;

/// A phase is reported when samples this much later have arrived [ns]: a beat becomes known slightly after it, and the
/// last one of a phase belongs to the phase.
const KNOWN_AFTER_NS: i64 = 2_000_000_000;

/// A running analysis of one stream, in windows of several lengths and over phases.
pub(crate) struct Running {
    analysis: &'static Analysis,
    mains_hz: Option<f64>,
    windows_secs: Vec<f64>,
    stream: Stream,
    work: Option<Work>,
    reported_phases: ReportedPhases,
    is_refusal_reported: bool,
}

/// A started analysis.
struct Work {
    live: Live,
    held: Held,
    left_out: LeftOut,
    readout: Readout,
    /// The conversion of each channel to the unit of the analysis.
    conversions: Vec<Conversion>,
    numbers: Vec<f64>,
    windows: Vec<OutputId>,
    events: Vec<OutputId>,
}

impl Running {
    /// Starts on a stream, in windows of `windows_secs` [s].
    pub(crate) fn begin(
        (analysis, mains_hz): (&'static Analysis, Option<f64>),
        windows_secs: &[f64],
        stream: &Stream,
        out: &mut Outputs,
    ) -> Running {
        let (windows_secs, stream) = (windows_secs.to_vec(), stream.clone());
        let work = None;
        let mut running = Running {
            analysis,
            mains_hz,
            windows_secs,
            stream,
            work,
            reported_phases: ReportedPhases::default(),
            is_refusal_reported: false,
        };
        running.work = running.start(out);
        running
    }

    fn naming(&self) -> Documented {
        self.analysis.feature.expect("only features run live")
    }

    /// The stream that is analysed.
    pub(crate) fn stream(&self) -> &Stream {
        &self.stream
    }

    /// Takes in a new declaration of the stream: with a different rate, channels or units it starts again.
    pub(crate) fn join(&mut self, stream: &Stream, out: &mut Outputs) {
        let of = |stream: &Stream| (stream.rate_hz.to_bits(), stream.channels.clone());
        let is_same = of(&self.stream) == of(stream);
        self.stream = stream.clone();
        if self.work.is_none() || !is_same {
            self.work = self.start(out);
        }
    }

    fn start(&self, out: &mut Outputs) -> Option<Work> {
        let stream = &self.stream;
        let readout = Readout::of(stream)?;
        let conversions = conversions(stream).ok()?;
        let lengths_ns: Vec<i64> =
            self.windows_secs.iter().map(|secs| (secs * 1e9) as i64).collect();
        let (causal, chosen) = (self.analysis.causal, chosen(stream, self.mains_hz));
        let make = Box::new(move |rate_hz| causal(&chosen, rate_hz));
        let channels = stream.channels.len();
        // A rate at which no value can be computed gives no stream.
        let live = Live::new(make, stream.rate_hz, channels, &lengths_ns, HOP_NS).ok()?;
        let window = |&secs: &f64| out.declare(self.window(secs, live.values()));
        let windows = self.windows_secs.iter().map(window).collect();
        let event = |happening: &Happening| out.declare(events(stream, happening));
        let events = self.analysis.events.iter().map(event).collect();
        Some(Work {
            live,
            held: Held::new(&self.windows_secs),
            left_out: LeftOut::default(),
            readout,
            conversions,
            numbers: Vec::new(),
            windows,
            events,
        })
    }

    fn window(&self, secs: f64, values: &[Value]) -> Stream {
        let over = format!("windows of {secs} s");
        let rate_hz = 1e9 / HOP_NS as f64;
        Stream { rate_hz, ..self.output(Window::of_secs(secs), &over, values) }
    }

    fn output(&self, window: Window, over: &str, values: &[Value]) -> Stream {
        let recipe = |value: &Value| format!("{}: {}", value.name, value.method);
        let recipes: Vec<String> = values.iter().map(recipe).collect();
        Stream {
            signal: self.stream.signal,
            device: self.stream.device.clone(),
            channels: values.iter().map(|value| Channel::new(&*value.name, &*value.unit)).collect(),
            method: format!("causal, {over}; {}", recipes.join("; ")),
            doc: self.naming().doc.to_owned(),
            ..Stream::derived(&self.stream, self.naming().name, Shape::Feature).over(window)
        }
    }

    /// Takes in a sample of the stream; `phases` are those of its subject.
    pub(crate) fn push(&mut self, sample: &Sample, phases: &[Phase], out: &mut Outputs) {
        let Some(mut work) = self.work.take() else {
            self.report_refusal(sample.measured, out);
            return;
        };
        let width = self.stream.channels.len();
        if let Some(numbers) = work.readout.read(&sample.data) {
            let conversions = work.conversions.iter().cycle();
            work.numbers.clear();
            work.numbers.extend(numbers.iter().zip(conversions).map(|(number, to)| to.of(*number)));
            let numbers = std::mem::take(&mut work.numbers);
            for (place, channels) in numbers.chunks_exact(width).enumerate() {
                let after_ns = (sample.period_ns * place as f64).round() as i64;
                let at_ns = sample.measured.nanos().saturating_add(after_ns);
                let known_ns = at_ns.saturating_sub(KNOWN_AFTER_NS);
                self.report_phases(&mut work, phases, known_ns, out);
                let outputs = (&work.windows[..], &work.events[..]);
                let missing = work.live.push(at_ns, channels, &mut |output| {
                    self.emit(outputs, output, out);
                });
                // Missing samples take as much memory as others.
                let taken = missing.map_or(0, |missing| 1 + missing as u64);
                work.held.came(at_ns, taken * width as u64);
                work.live.hold_since(work.held.since_ns());
            }
            let input = (&self.stream, self.naming().name);
            work.left_out.report(input, (&work.held, &self.windows_secs), sample.measured, out);
            work.numbers = numbers;
        }
        self.work = Some(work);
    }

    /// The session is over: reports the windows that end with the stream.
    pub(crate) fn finish(&mut self, out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        let outputs = (&work.windows[..], &work.events[..]);
        work.live.finish(&mut |output| self.emit(outputs, output, out));
        self.work = Some(work);
    }

    /// Hands on a result of the analysis, to the outputs of windows or of events.
    fn emit(
        &self,
        (windows, events): (&[OutputId], &[OutputId]),
        output: LiveOutput,
        out: &mut Outputs,
    ) {
        match output {
            LiveOutput::Window(place, span, measured) => {
                let data = feature(span.secs(), &measured);
                out.emit(windows[place], Time::from_nanos(span.end_ns), data);
            }
            LiveOutput::Event(event) => {
                let is_this = |happening: &Happening| happening.kind == event.kind;
                if let Some(place) = self.analysis.events.iter().position(is_this) {
                    let channels = &self.stream.channels;
                    let data = happened(&self.analysis.events[place], &event, channels);
                    out.emit(events[place], Time::from_nanos(event.at_ns), data);
                }
            }
        }
    }

    /// Reports once, as a fault, that a stream's unit can't be converted to that of the analysis.
    fn report_refusal(&mut self, at: Time, out: &mut Outputs) {
        let Err((unit, to)) = conversions(&self.stream) else { return };
        if !std::mem::replace(&mut self.is_refusal_reported, true) {
            let leaf = self.naming().name;
            let label = format!("{leaf}: {unit} can't be converted to {to}");
            refuse((&self.stream, leaf), label, f64::NAN, at, out);
        }
    }

    /// Reports the phases that are over at `now`, whether or not samples have arrived since.
    pub(crate) fn end_phases(&mut self, phases: &[Phase], now: Time, out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        self.report_phases(&mut work, phases, now.nanos(), out);
        self.work = Some(work);
    }

    /// Reports phases that ended at or before a time [ns], and keeps the samples that the next one
    /// needs.
    fn report_phases(&mut self, work: &mut Work, phases: &[Phase], at_ns: i64, out: &mut Outputs) {
        while let Some(phase) = self.reported_phases.next_over(phases, at_ns) {
            self.report_phase(work, phase, out);
        }
        let begin_ns = self.reported_phases.next_begin_ns(phases);
        work.live.hold_from(begin_ns.map(|begin_ns| begin_ns.max(work.held.since_ns())));
    }

    fn report_phase(&self, work: &Work, phase: &Phase, out: &mut Outputs) {
        let (live, held_ns) = (&work.live, work.held.since_ns());
        let since_ns = live.begin_ns();
        let Some(span) = since_ns.and_then(|since_ns| measured_span(phase, since_ns, held_ns))
        else {
            return;
        };
        let output = out.declare(self.output(Window::Phases, OVER_PHASES, live.values()));
        out.emit(output, Time::from_nanos(span.end_ns), feature(span.secs(), &live.measure(span)));
    }
}

/// The conversion of each channel to the unit in which the signal is analysed; otherwise the unit that can't be
/// converted, and the one needed.
fn conversions(stream: &Stream) -> Result<Vec<Conversion>, (String, &'static str)> {
    let conversion = |Channel { unit, .. }: &Channel| {
        let refused = || (unit.clone(), worked_in(stream.signal).unwrap_or("1"));
        Conversion::for_signal(stream.signal, unit).ok_or_else(refused)
    };
    stream.channels.iter().map(conversion).collect()
}

/// The properties of a stream for its analysis.
fn chosen(stream: &Stream, mains_hz: Option<f64>) -> Chosen {
    let channels = stream.channels.iter().map(|channel| channel.name.clone()).collect();
    let unit = stream.channels.first().map(|channel| channel.unit.clone());
    let unit = unit.filter(|unit| !unit.is_empty()).unwrap_or_else(|| "1".to_owned());
    Chosen { channels, unit, mains_hz, ..Chosen::default() }
}

fn events(input: &Stream, happening: &Happening) -> Stream {
    Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        method: format!("causal; the number is {}", happening.value),
        doc: format!(
            "Each {} in {}, at the time when it became known; where the quality of the windows is poor, anything that looks like one.",
            happening.kind, input.name
        ),
        ..Stream::derived(input, happening.leaf, Shape::Event)
    }
}

fn feature(window_secs: f64, measured: &Measured) -> Data {
    Data::Feature(Arc::new(FeatureValues {
        window_secs,
        coverage: measured.coverage as f32,
        quality: measured.quality as f32,
        // An empty sum is a zero with a sign, which is left out.
        values: measured.values.iter().map(|value| value.map_or(f64::NAN, |it| it + 0.0)).collect(),
        sigmas: Vec::new(),
        reasons: measured.values.iter().map(|value| reason(*value)).collect(),
    }))
}

fn reason(value: Result<f64, analysis::Reason>) -> Reason {
    match value {
        Ok(_) => Reason::Ok,
        Err(analysis::Reason::Short) => Reason::Short,
        Err(analysis::Reason::Gap) => Reason::Gap,
        Err(analysis::Reason::Quality) => Reason::Quality,
        Err(analysis::Reason::Missing) => Reason::Missing,
        Err(analysis::Reason::Undefined) => Reason::Undefined,
        Err(analysis::Reason::Nothing) => Reason::Nothing,
    }
}

/// An event; one found in one of several channels is labelled with that channel.
fn happened(happening: &Happening, event: &analysis::Event, channels: &[Channel]) -> Data {
    let detail = |name: &str| {
        let found = event.details.iter().find(|(each, _)| *each == name);
        found.map(|(_, value)| *value)
    };
    let channel = detail("channel").and_then(|index| channels.get(index as usize));
    Data::Event(Arc::new(Event {
        kind: happening.word,
        label: channel.map_or(happening.kind, |channel| &channel.name).to_owned(),
        value: detail(happening.value).unwrap_or(f64::NAN),
        duration_secs: detail(happening.duration).unwrap_or(0.0),
    }))
}

#[cfg(test)]
mod tests;
