//! Thirty simulated operators from their sensors to the estimates: a check of our pipeline, not of
//! nature.

#![expect(clippy::unwrap_used, reason = "a test")]

use std::collections::BTreeMap;
use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope};
use teampulse_core::registry::Settings;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{About, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_emulators::body::{Body, Rates, Sensor, Settings as Worn, Traits};
use teampulse_emulators::task::{Operator, Plan, Skill, Task, Told, What};
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use teampulse_signal::statistics::{PageMethod, page_trend};

const PEOPLE: u64 = 30;
const LEVELS: [&str; 3] = ["1-back", "2-back", "3-back"];
const SENSORS: [(Sensor, Signal, &str); 3] = [
    (Sensor::Ecg, Signal::Ecg, "mV"),
    (Sensor::EdaWrist, Signal::Eda, "uS"),
    (Sensor::Respiration, Signal::Respiration, "cm"),
];
const FAMILIES: [&str; 6] = ["heart", "skin", "breath", "input", "state", "estimates"];

/// Features at work on each other's outputs, as the pump lets them.
struct Graph {
    features: Vec<Box<dyn Feature>>,
    at_work: Vec<AtWork>,
    streams: Vec<Stream>,
    told: Vec<(StreamId, Time, Arc<FeatureValues>)>,
}

struct AtWork {
    extractor: Box<dyn Extractor>,
    of: (usize, Option<StreamId>),
    inputs: Vec<StreamId>,
    out: Outputs,
    /// As the extractor and as the graph know its outputs.
    ids: Vec<(OutputId, StreamId)>,
    handed_on: usize,
}

impl Graph {
    fn new() -> Graph {
        let context = FeatureContext { windows_secs: vec![30.0] };
        let wanted = FEATURES.iter().filter(|entry| FAMILIES.contains(&entry.kind));
        let built = wanted.map(|entry| (entry.build)(Settings::empty(), &context).unwrap());
        let features = built.collect();
        Graph { features, at_work: Vec::new(), streams: Vec::new(), told: Vec::new() }
    }

    fn declare(&mut self, stream: Stream) -> StreamId {
        let id = StreamId(self.streams.len() as u32);
        for (number, feature) in self.features.iter().enumerate() {
            if !feature.accepts(&stream) {
                continue;
            }
            let of = (number, (feature.scope() == Scope::Stream).then_some(id));
            let known = self.at_work.iter().position(|each| each.of == of);
            let place = known.unwrap_or_else(|| {
                let extractor = feature.start(&stream);
                let (inputs, out, ids) = (Vec::new(), Outputs::new(), Vec::new());
                self.at_work.push(AtWork { extractor, of, inputs, out, ids, handed_on: 0 });
                self.at_work.len() - 1
            });
            let at_work = &mut self.at_work[place];
            at_work.inputs.push(id);
            at_work.extractor.join(id, &stream, &mut at_work.out);
        }
        self.streams.push(stream);
        self.settle();
        id
    }

    fn push(&mut self, stream: StreamId, at: Time, data: Data) {
        let period_ns = if let Data::Wave(wave) = &data { wave.period_ns } else { 0.0 };
        let sample = Sample {
            stream,
            measured: at,
            log_time: at,
            device_time: None,
            source_time: None,
            period_ns,
            index: 0,
            turn: Turn::OnTime,
            data,
        };
        for at_work in self.at_work.iter_mut().filter(|each| each.inputs.contains(&stream)) {
            at_work.extractor.push(&sample, &mut at_work.out);
        }
        self.settle();
    }

    fn tick(&mut self, now: Time) {
        self.at_work.iter_mut().for_each(|each| each.extractor.tick(now, &mut each.out));
        self.settle();
    }

    /// Hands on what was declared and emitted, until there is nothing more.
    fn settle(&mut self) {
        for place in 0..self.at_work.len() {
            while let Some(stream) = self.at_work[place].next_declared() {
                let id = StreamId(self.streams.len() as u32);
                let AtWork { out, ids, .. } = &mut self.at_work[place];
                ids.push((out.declare(stream.clone()), id));
                self.declare(stream);
            }
            while let Some((id, at, data)) = self.at_work[place].next_emitted() {
                if let Data::Feature(values) = &data {
                    self.told.push((id, at, Arc::clone(values)));
                }
                self.push(id, at, data);
            }
        }
    }

    /// A value of a stream, by the names of both, at each time that it was told.
    fn values(&self, stream: &str, channel: &str) -> Vec<(f64, Result<f64, Reason>)> {
        let (id, known) = (0..).zip(&self.streams).find(|(_, each)| each.name == stream).unwrap();
        let place = known.channels.iter().position(|each| each == channel).unwrap();
        let of_stream = self.told.iter().filter(|(told, ..)| *told == StreamId(id));
        let value = |values: &FeatureValues| match values.reasons[place] {
            Reason::Ok => Ok(values.values[place]),
            reason => Err(reason),
        };
        of_stream.map(|(_, at, values)| (at.secs(), value(values))).collect()
    }
}

impl AtWork {
    fn next_declared(&self) -> Option<Stream> {
        self.out.streams().get(self.ids.len()).cloned()
    }

    fn next_emitted(&mut self) -> Option<(StreamId, Time, Data)> {
        let (output, at, data) = self.out.samples().nth(self.handed_on)?;
        let (_, id) = self.ids.iter().find(|(known, _)| *known == output)?;
        self.handed_on += 1;
        Some((*id, at, data.clone()))
    }
}

fn person() -> Subject {
    Subject { about: About::Person, id: "p1".into() }
}

fn events(name: &str) -> Stream {
    Stream::raw(format!("/humans/persons/p1/task/{name}"), person(), Shape::Event)
}

/// A plan of which each level comes once.
fn plan() -> Plan {
    Plan { rounds: Some(1), ..Plan::default() }
}

/// What an operator lives through, second by second, in a graph.
fn lived(seed: u64) -> Graph {
    let rates = Rates {
        ecg_hz: Sensor::Ecg.usual_rate_hz(),
        eda_wrist_hz: Sensor::EdaWrist.usual_rate_hz(),
        respiration_hz: Sensor::Respiration.usual_rate_hz(),
        ..Rates::NONE
    };
    let worn = Worn { rates, ..Worn::default() };
    let body = Body::wearing(&Traits::of_seed(seed), seed, &worn).unwrap();
    let mut operator = Operator::new(body, Task::new(plan(), Skill::of_seed(seed), seed));
    let mut graph = Graph::new();
    let sensors: Vec<StreamId> = SENSORS.iter().map(|each| graph.declare(worn_as(*each))).collect();
    let input = Stream { signal: Signal::Input, ..events("presses") };
    let input = graph.declare(input.with_channels(&[("reaction_time", "s")]));
    let [phases, reports] = ["phases", "reports"].map(|name| graph.declare(events(name)));
    for second in 1..=310_u32 {
        let Told { happened, record } = operator.until(f64::from(second));
        for happening in happened {
            let at = time(happening.at_secs);
            match happening.what {
                What::Begins { phase, .. } => {
                    graph.push(phases, at, event(EventKind::Phase, phase, f64::NAN));
                }
                What::Report { isa } => {
                    graph.push(reports, at, event(EventKind::Report, "isa", f64::from(isa)));
                }
                What::Press { reaction_secs, .. } => {
                    graph.push(input, at, event(EventKind::Marker, "press", reaction_secs));
                }
                _ => {}
            }
        }
        for (stream, (sensor, ..)) in sensors.iter().zip(SENSORS) {
            let wave = record.wave(sensor);
            let data = Data::Wave(Wave {
                period_ns: 1e9 / wave.rate_hz,
                channels: 1,
                samples: wave.samples.as_slice().into(),
            });
            graph.push(*stream, time(wave.first_secs()), data);
        }
        for tenth in 1..=10 {
            graph.tick(time(f64::from(second - 1) + f64::from(tenth) / 10.0));
        }
    }
    graph
}

fn worn_as((sensor, signal, unit): (Sensor, Signal, &str)) -> Stream {
    let stream = Stream::raw(format!("/humans/persons/p1/worn/{signal}"), person(), Shape::Wave);
    let stream = Stream { signal, rate_hz: sensor.usual_rate_hz(), ..stream };
    stream.with_channels(&[("x", unit)])
}

fn event(kind: EventKind, label: &str, value: f64) -> Data {
    let label = label.to_owned();
    Data::Event(Arc::new(Event { kind, label, value, duration_secs: f64::NAN }))
}

fn time(secs: f64) -> Time {
    Time::from_nanos((secs * 1e9).round() as i64)
}

/// The ends of the levels [s].
fn ends() -> BTreeMap<&'static str, f64> {
    (0..)
        .map_while(|number| plan().phase(number))
        .map(|phase| (phase.name, phase.to_secs))
        .collect()
}

/// What an estimate was at the end of each level, after the baseline, which is 0 by its definition.
fn by_level(graph: &Graph, (spans, channel): Which) -> Row {
    let told = graph.values(&format!("/humans/persons/p1/estimates/{spans}"), channel);
    let at = |secs: f64| told.iter().find(|(at, _)| (at - secs).abs() < 0.01).unwrap().1.unwrap();
    let [one, two, three] = LEVELS.map(|level| at(ends()[level]));
    [0.0, one, two, three]
}

/// Over which spans, and which estimate.
type Which = (&'static str, &'static str);
/// It in the baseline and at each level.
type Row = [f64; 4];

const ESTIMATES: [Which; 5] = [
    ("phases", "workload"),
    ("phases", "workload_physiology"),
    ("phases", "arousal"),
    ("w30", "workload_physiology"),
    ("w30", "arousal"),
];

/// The estimates about everyone, on two threads.
fn everyone() -> Vec<Vec<(Which, Row)>> {
    let of_one = |seed| {
        let graph = lived(seed);
        ESTIMATES.map(|which| (which, by_level(&graph, which))).to_vec()
    };
    std::thread::scope(|scope| {
        let halves = [0, 1].map(|half| {
            scope.spawn(move || (half..PEOPLE).step_by(2).map(of_one).collect::<Vec<_>>())
        });
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    })
}

#[test]
fn estimates_order_the_levels_of_a_task_in_a_group_and_not_in_everyone() {
    let mut rows: BTreeMap<Which, Vec<Row>> = BTreeMap::new();
    for of_one in everyone() {
        for (stream, row) in of_one {
            rows.entry(stream).or_default().push(row);
        }
    }
    for ((span, channel), people) in rows {
        let columns: [Vec<f64>; 4] =
            std::array::from_fn(|place| people.iter().map(|row| row[place]).collect());
        let means = columns.each_ref().map(|all| all.iter().sum::<f64>() / all.len() as f64);
        let ordered = people.iter().filter(|row| row.is_sorted_by(|a, b| a < b)).count();
        let page = page_trend(&columns.each_ref().map(Vec::as_slice), PageMethod::Auto).unwrap();
        let of_levels = [&columns[1][..], &columns[2], &columns[3]];
        let levels = page_trend(&of_levels, PageMethod::Auto).unwrap();
        eprintln!(
            "{span} {channel}: means {means:.2?}, ordered in {ordered} of {PEOPLE} people, Page p {:.1e}, \
             of the levels alone {:.1e}",
            page.p, levels.p
        );
        assert!(page.p < 0.001, "{span} {channel}: {page:?}");
    }
}
