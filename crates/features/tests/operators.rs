//! Thirty simulated operators from their sensors to the estimates: a check of our pipeline, not of
//! nature.

#![expect(clippy::unwrap_used, reason = "a test")]

#[expect(dead_code, reason = "what signals that go bad need")]
mod living;

use std::collections::BTreeMap;
use std::sync::Arc;

use async_trait::async_trait;
use living::{after, hand_over, heard};
use teampulse_core::data::{Data, Event, EventKind, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::sample::Record;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{About, Shape, Signal, Stream, StreamId, Subject};
use teampulse_emulators::body::{Body, Rates, Sensor, Settings, Traits};
use teampulse_emulators::task::{Happening, Operator, OperatorOutput, Plan, Skill, Task, What};
use teampulse_signal::statistics::{PageMethod, page_trend};

const PEOPLE: u64 = 30;
const LEVELS: [&str; 3] = ["1-back", "2-back", "3-back"];
const SENSORS: [Sensor; 3] = [Sensor::Ecg, Sensor::EdaWrist, Sensor::Respiration];
/// The features that the estimates need.
const FAMILIES: [&str; 6] = ["heart", "skin", "breath", "input", "state", "estimates"];
/// How long each person is simulated [s], until the last level is reported; and the length of each step
/// [s].
const SECS: u32 = 410;
const CHUNK_SECS: f64 = 0.25;

/// A plan with each level once, after a baseline long enough for z in windows of 30 s.
fn plan() -> Plan {
    Plan { baseline_secs: 150.0, rounds: Some(1), ..Plan::default() }
}

/// An operator as a source.
struct Operating(Operator);

impl Operating {
    fn of_seed(seed: u64) -> Operating {
        let rates = Rates {
            ecg_hz: Sensor::Ecg.usual_rate_hz(),
            eda_wrist_hz: Sensor::EdaWrist.usual_rate_hz(),
            respiration_hz: Sensor::Respiration.usual_rate_hz(),
            ..Rates::NONE
        };
        let settings = Settings { rates, ..Settings::default() };
        let body = Body::wearing(&Traits::of_seed(seed), seed, &settings).unwrap();
        Operating(Operator::new(body, Task::new(plan(), Skill::of_seed(seed), seed)))
    }
}

#[async_trait]
impl Source for Operating {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let declare = |stream| outlet.declare_at(stream, after(0.0));
        let sensors = SENSORS.map(|sensor| declare(living::stream(sensor)));
        let presses = Stream { signal: Signal::Input, ..events("presses") };
        let presses = declare(presses.with_channels(&[("reaction_time", "s")]));
        let [phases, reports] = ["phases", "reports"].map(|name| declare(events(name)));
        for number in 1..=SECS * 4 {
            let at_secs = f64::from(number) * CHUNK_SECS;
            let OperatorOutput { happened, record } = self.0.until(at_secs);
            let mut readings: Vec<Reading> = happened
                .iter()
                .filter_map(|happening| happens(happening, [phases, presses, reports]))
                .collect();
            for (stream, sensor) in sensors.into_iter().zip(SENSORS) {
                let wave = record.wave(sensor);
                let data = Data::Wave(Wave {
                    period_ns: 1e9 / wave.rate_hz,
                    channels: 1,
                    samples: wave.samples.as_slice().into(),
                });
                let source_time = Some(after(wave.first_secs()));
                readings.push(Reading {
                    index: None,
                    stream,
                    device_time: None,
                    source_time,
                    data,
                });
            }
            for reading in readings {
                hand_over(reading, after(at_secs), outlet).await;
            }
        }
        Ok(())
    }
}

fn happens(happening: &Happening, [phases, presses, reports]: [StreamId; 3]) -> Option<Reading> {
    let (stream, kind, label, value) = match happening.what {
        What::Begins { phase, .. } => (phases, EventKind::Phase, phase, f64::NAN),
        What::Press { reaction_secs, .. } => (presses, EventKind::Marker, "press", reaction_secs),
        What::Report { isa } => (reports, EventKind::Report, "isa", f64::from(isa)),
        _ => return None,
    };
    let event = Event { kind, label: label.to_owned(), value, duration_secs: f64::NAN };
    let (data, source_time) = (Data::Event(Arc::new(event)), Some(after(happening.at_secs)));
    Some(Reading { index: None, stream, device_time: None, source_time, data })
}

fn events(name: &str) -> Stream {
    let person = Subject { about: About::Person, id: "p1".into() };
    Stream::raw(format!("/humans/persons/p1/task/{name}"), person, Shape::Event)
}

/// The ends of the levels [s].
fn ends() -> BTreeMap<&'static str, f64> {
    (0..)
        .map_while(|number| plan().phase(number))
        .map(|phase| (phase.name, phase.to_secs))
        .collect()
}

/// The estimate at the end of each level, after that of the baseline, which is 0 by definition.
fn by_level(records: &[Record], (spans, channel): Which) -> Row {
    let name = format!("/humans/persons/p1/estimates/{spans}");
    let at = |secs: f64| {
        let is_it = |record: &&Record| {
            let off_secs = record.sample.measured.secs_since(after(secs));
            record.stream.name == name && off_secs.abs() < 0.01
        };
        let record = records.iter().find(is_it).unwrap();
        let Data::Feature(values) = &record.sample.data else { panic!("no feature") };
        let place = record.stream.place_of(channel).unwrap();
        values.values[place]
    };
    let [one, two, three] = LEVELS.map(|level| at(ends()[level]));
    [0.0, one, two, three]
}

/// The windows or phases, and the estimate.
type Which = (&'static str, &'static str);
/// The values of an estimate in the baseline and at each level.
type Row = [f64; 4];

const ESTIMATES: [Which; 5] = [
    ("phases", "workload"),
    ("phases", "workload_physiology"),
    ("phases", "arousal"),
    ("w30", "workload_physiology"),
    ("w30", "arousal"),
];

/// The estimates about all operators, on two threads.
fn everyone() -> Vec<Vec<(Which, Row)>> {
    let of_one = |seed| {
        let operating = Box::new(Operating::of_seed(seed));
        let records = heard(operating, |kind| FAMILIES.contains(&kind));
        ESTIMATES.map(|which| (which, by_level(&records, which))).to_vec()
    };
    std::thread::scope(|scope| {
        let halves = [0, 1].map(|half| {
            scope.spawn(move || (half..PEOPLE).step_by(2).map(of_one).collect::<Vec<_>>())
        });
        halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
    })
}

#[test]
fn estimates_order_the_levels_of_a_task_in_a_group_but_not_in_every_person() {
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
