//! An analysis of the signal crate at work on one stream of a person.

use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_core::feature::{OutputId, Outputs};
use teampulse_core::phases::Phase;
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Shape, Signal, Stream};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;
use teampulse_signal::analysis::{self, Live, Make, Measured, Told, Value};

use crate::over::{OVER_PHASES, PhasesTold, measured_span};
use crate::windows::window_name;

/// Windows are told of once a second of the stream's own time.
const HOP_NS: i64 = 1_000_000_000;

/// What an analysis is called, and which events it tells of.
pub(crate) struct Naming {
    /// The name below the input.
    pub(crate) leaf: &'static str,
    /// What the windows tell, in a sentence for people.
    pub(crate) doc: &'static str,
    /// The events: their kind in the analysis, the name of their stream, and what their number is.
    pub(crate) events: &'static [Happening],
}

/// Events of one kind.
pub(crate) struct Happening {
    /// As the analysis calls them.
    pub(crate) kind: &'static str,
    /// The name of their stream below the input.
    pub(crate) leaf: &'static str,
    /// As the wire calls them.
    pub(crate) word: EventKind,
    /// The detail that is the event's number.
    pub(crate) value: &'static str,
    /// The detail that is its length [s]; none for a moment.
    pub(crate) duration: &'static str,
}

/// An analysis at work on one stream, in windows of several lengths and over phases.
pub(crate) struct Running {
    naming: &'static Naming,
    make: fn(&Stream) -> Make,
    windows_secs: Vec<f64>,
    stream: Stream,
    work: Option<Work>,
    phases_told: PhasesTold,
}

/// An analysis that has begun.
struct Work {
    live: Live,
    readout: Readout,
    windows: Vec<OutputId>,
    events: Vec<OutputId>,
}

impl Running {
    /// Begins on a stream, in windows of `windows_secs` [s].
    pub(crate) fn begin(
        analysis: (&'static Naming, fn(&Stream) -> Make),
        windows_secs: &[f64],
        stream: &Stream,
        out: &mut Outputs,
    ) -> Running {
        let (naming, make) = analysis;
        let (windows_secs, stream) = (windows_secs.to_vec(), stream.clone());
        let work = None;
        let mut running = Running {
            naming,
            make,
            windows_secs,
            stream,
            work,
            phases_told: PhasesTold::default(),
        };
        running.work = running.start(out);
        running
    }

    /// The stream that it runs on.
    pub(crate) fn stream(&self) -> &Stream {
        &self.stream
    }

    /// The stream is known better: at another rate or with other channels it begins anew.
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
        let lengths_ns: Vec<i64> =
            self.windows_secs.iter().map(|secs| (secs * 1e9) as i64).collect();
        let (make, channels) = ((self.make)(stream), stream.channels.len());
        // A rate at which nothing can be told gives no stream.
        let live = Live::new(make, stream.rate_hz, channels, &lengths_ns, HOP_NS).ok()?;
        let window = |&secs: &f64| out.declare(self.window(secs, live.values()));
        let windows = self.windows_secs.iter().map(window).collect();
        let event = |happening: &Happening| out.declare(events(stream, happening));
        let events = self.naming.events.iter().map(event).collect();
        Some(Work { live, readout, windows, events })
    }

    fn window(&self, secs: f64, values: &[Value]) -> Stream {
        let over = format!("windows of {secs} s");
        let rate_hz = 1e9 / HOP_NS as f64;
        Stream { rate_hz, ..self.output(&window_name(secs), &over, values) }
    }

    fn output(&self, leaf: &str, over: &str, values: &[Value]) -> Stream {
        let recipe = |value: &Value| format!("{}: {}", value.name, value.method);
        let recipes: Vec<String> = values.iter().map(recipe).collect();
        Stream {
            signal: self.stream.signal,
            device: self.stream.device.clone(),
            channels: values.iter().map(|value| value.name.clone().into_owned()).collect(),
            units: values.iter().map(|value| value.unit.clone().into_owned()).collect(),
            method: format!("causal, {over}; {}", recipes.join("; ")),
            doc: self.naming.doc.to_owned(),
            ..Stream::derived(&self.stream, &format!("{}/{leaf}", self.naming.leaf), Shape::Feature)
        }
    }

    /// Takes in what came on the stream; `phases` are those of its subject.
    pub(crate) fn push(&mut self, sample: &Sample, phases: &[Phase], out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        let width = self.stream.channels.len();
        if let Some(numbers) = work.readout.read(&sample.data) {
            for (place, channels) in numbers.chunks_exact(width).enumerate() {
                let after_ns = (sample.period_ns * place as f64).round() as i64;
                let at_ns = sample.measured.nanos().saturating_add(after_ns);
                self.tell_phases(&mut work.live, phases, at_ns, out);
                let (windows, events) = (&work.windows, &work.events);
                work.live.push(at_ns, channels, &mut |told| match told {
                    Told::Window(place, span, measured) => {
                        let data = feature(span.secs(), &measured);
                        out.emit(windows[place], Time::from_nanos(span.end_ns), data);
                    }
                    Told::Event(event) => {
                        let is_this = |happening: &Happening| happening.kind == event.kind;
                        if let Some(place) = self.naming.events.iter().position(is_this) {
                            let channels = &self.stream.channels;
                            let data = happened(&self.naming.events[place], &event, channels);
                            out.emit(events[place], Time::from_nanos(event.at_ns), data);
                        }
                    }
                });
            }
        }
        self.work = Some(work);
    }

    /// Tells of the phases that are over at `now`, whether or not samples have come since.
    pub(crate) fn end_phases(&mut self, phases: &[Phase], now: Time, out: &mut Outputs) {
        let Some(mut work) = self.work.take() else { return };
        self.tell_phases(&mut work.live, phases, now.nanos(), out);
        self.work = Some(work);
    }

    /// Tells of phases that ended at or before a time [ns], and holds what the next one needs.
    fn tell_phases(&mut self, live: &mut Live, phases: &[Phase], at_ns: i64, out: &mut Outputs) {
        while let Some(phase) = self.phases_told.next_over(phases, at_ns) {
            self.tell_phase(live, phase, out);
        }
        live.hold_from(self.phases_told.next_begin_ns(phases));
    }

    fn tell_phase(&self, live: &mut Live, phase: &Phase, out: &mut Outputs) {
        let Some(span) = live.begin_ns().and_then(|since_ns| measured_span(phase, since_ns)) else {
            return;
        };
        let output = out.declare(self.output("phases", OVER_PHASES, live.values()));
        out.emit(output, Time::from_nanos(span.end_ns), feature(span.secs(), &live.measure(span)));
    }
}

fn events(input: &Stream, happening: &Happening) -> Stream {
    Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        method: format!("causal; the number is {}", happening.value),
        doc: format!(
            "Each {} in {}, when it became known; where the quality of the windows is poor, what looks like one.",
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
        values: measured.values.iter().map(|value| value.unwrap_or(f64::NAN)).collect(),
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
    }
}

/// An event; one that was found in one of several channels is labelled with that.
fn happened(happening: &Happening, event: &analysis::Event, channels: &[String]) -> Data {
    let detail = |name: &str| {
        let found = event.details.iter().find(|(each, _)| *each == name);
        found.map(|(_, value)| *value)
    };
    let channel = detail("channel").and_then(|index| channels.get(index as usize));
    Data::Event(Arc::new(Event {
        kind: happening.word,
        label: channel.map_or(happening.kind, String::as_str).to_owned(),
        value: detail(happening.value).unwrap_or(f64::NAN),
        duration_secs: detail(happening.duration).unwrap_or(0.0),
    }))
}

#[cfg(test)]
mod tests {
    use teampulse_core::data::Wave;
    use teampulse_core::stream::{About, Origin, StreamId, Subject};
    use teampulse_signal::ecg;

    use super::*;
    use crate::context::FeatureContext;
    use crate::people::heart::Heart;
    use teampulse_core::registry::Component;
    use teampulse_core::sample::Turn;

    #[test]
    fn an_event_of_one_channel_of_several_is_labelled_with_it() {
        let naming = Happening {
            kind: "burst",
            leaf: "bursts",
            word: EventKind::Burst,
            value: "peak",
            duration: "",
        };
        let channels = ["flexor".to_owned(), "extensor".to_owned()];
        let label = |details: &[(&'static str, f64)]| {
            let details = details.to_vec();
            let event = analysis::Event { kind: "burst", sample: 0.0, at_ns: 0, details };
            let Data::Event(event) = happened(&naming, &event, &channels) else { panic!() };
            event.label.clone()
        };
        assert_eq!(label(&[("channel", 1.0), ("peak", 3.0)]), "extensor");
        assert_eq!(label(&[("peak", 3.0)]), "burst");
    }

    const RATE_HZ: f64 = 130.0;
    /// The clock of the strap is a little fast.
    const PERIOD_NS: f64 = 1e9 / RATE_HZ * 1.000_05;

    fn ecg() -> Stream {
        let subject = Subject { about: About::Person, id: "p1".into() };
        let stream = Stream::raw("/humans/persons/p1/polar_h10/ecg", subject, Shape::Wave);
        let stream = Stream { signal: Signal::Ecg, rate_hz: RATE_HZ, ..stream };
        stream.with_channels(&[("ecg", "mV")])
    }

    /// A bump each 100 samples and a little, broad ones between them.
    fn voltages() -> Vec<f64> {
        let bump = |k: usize, at: f64, width: f64| {
            let from = (k % 101) as f64 - at;
            (-(from / width).powi(2) / 2.0).exp()
        };
        (0..7800).map(|k| bump(k, 40.0, 1.5) + 0.2 * bump(k, 75.0, 6.0)).collect()
    }

    /// What comes out when samples come in waves of these many, some of them lost.
    fn told(lengths: &[usize]) -> (Vec<Stream>, Vec<(OutputId, Time, String)>) {
        let feature = Heart { windows_secs: Some(vec![10.0]) };
        let feature = feature.build(&FeatureContext::default()).unwrap();
        let stream = ecg();
        assert!(feature.accepts(&stream));
        let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
        extractor.join(StreamId(0), &stream, &mut out);
        let (voltages, mut begin) = (voltages(), 0);
        for length in lengths.iter().cycle() {
            let end = (begin + length).min(voltages.len());
            if begin == end {
                break;
            }
            let ns = (begin as f64 * PERIOD_NS).round() as i64;
            extractor.push(&wave(ns, &voltages[begin..end]), &mut out);
            begin = end;
        }
        let samples = out.samples().map(|(id, at, data)| (id, at, format!("{data:?}")));
        (out.streams().to_vec(), samples.collect())
    }

    fn wave(at_ns: i64, samples: &[f64]) -> Sample {
        let at = Time::from_nanos(1_700_000_000_000_000_000 + at_ns);
        let samples = samples.into();
        Sample {
            stream: StreamId(0),
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns: PERIOD_NS,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Wave(Wave { period_ns: 1e9 / RATE_HZ, channels: 1, samples }),
        }
    }

    #[test]
    fn beats_and_windows_come_out_with_their_names_and_units() {
        let (streams, samples) = told(&[73]);
        let names: Vec<&str> = streams.iter().map(|stream| stream.name.as_str()).collect();
        let ecg = "/humans/persons/p1/polar_h10/ecg";
        assert_eq!(names, [format!("{ecg}/heart/w10"), format!("{ecg}/beats")]);
        let place = streams[0].channels.iter().position(|name| name == "ECG_Rate_Mean").unwrap();
        assert_eq!(streams[0].units[place], "1/min");
        let beats = samples.iter().filter(|(.., data)| data.contains("Beat")).count();
        assert!((75..=77).contains(&beats), "{beats} of 77");
        let windows = samples.iter().filter(|(.., data)| data.contains("window_secs: 10.0"));
        // Each second of a minute, but for the end of the last.
        assert_eq!(windows.count(), 59);
    }

    #[test]
    fn waves_of_any_length_give_the_same() {
        let whole = told(&[73]).1;
        // Where a wave begins, its time is rounded: no more than that may differ.
        for lengths in [&[7800][..], &[1], &[5, 200, 33]] {
            let other = told(lengths).1;
            assert_eq!(whole.len(), other.len());
            for (one, other) in whole.iter().zip(&other) {
                assert_eq!(one.0, other.0);
                assert!((one.1.nanos() - other.1.nanos()).abs() <= 2);
            }
        }
    }

    #[test]
    fn live_is_what_the_analysis_tells_afterwards() {
        let make: Make =
            Box::new(|rate_hz| ecg::analysis::causal(&ecg::analysis::Settings::default(), rate_hz));
        let mut live = Live::new(make, RATE_HZ, 1, &[10_000_000_000], HOP_NS).unwrap();
        let mut expected = Vec::new();
        for (sample, voltage) in voltages().into_iter().enumerate() {
            let wave_begin = (sample / 73 * 73) as f64;
            let from_begin = ((sample % 73) as f64 * PERIOD_NS).round() as i64;
            let at_ns = 1_700_000_000_000_000_000 + (wave_begin * PERIOD_NS).round() as i64;
            live.push(at_ns + from_begin, &[voltage], &mut |told| {
                if let Told::Window(_, span, measured) = told {
                    expected.push(format!("{:?}", feature(span.secs(), &measured)));
                }
            });
        }
        let windows = told(&[73]).1.into_iter().map(|(.., data)| data);
        let windows: Vec<String> = windows.filter(|data| data.contains("window_secs")).collect();
        assert!(windows == expected);
    }

    #[test]
    fn a_robot_s_or_a_derived_signal_is_left_alone() {
        let feature = Heart::default().build(&FeatureContext::default()).unwrap();
        assert!(!feature.accepts(&Stream { about: About::Robot, ..ecg() }));
        assert!(!feature.accepts(&Stream { origin: Origin::Derived, ..ecg() }));
        assert!(!feature.accepts(&Stream { rate_hz: 0.0, ..ecg() }));
        assert!(!feature.accepts(&Stream { signal: Signal::Ppg, ..ecg() }));
    }

    #[test]
    fn a_rate_at_which_nothing_can_be_told_gives_no_stream() {
        let feature = Heart::default().build(&FeatureContext::default()).unwrap();
        let stream = Stream { rate_hz: 1.0, ..ecg() };
        let (mut extractor, mut out) = (feature.start(&stream), Outputs::new());
        extractor.join(StreamId(0), &stream, &mut out);
        extractor.push(&wave(0, &[1.0; 10]), &mut out);
        assert!(out.streams().is_empty() && out.samples().next().is_none());
    }
}
