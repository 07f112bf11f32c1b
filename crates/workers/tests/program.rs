//! Programs as workers, real ones, in sessions of their own.

#[path = "../../sources/tests/keeper/mod.rs"]
mod keeper;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::clocks::Clocks;
use teampulse_core::command::{Command, Sender};
use teampulse_core::commands::{CommandSettings, Commands, Refused};
use teampulse_core::data::{Data, EventKind, Wave};
use teampulse_core::outlet::Outlet;
use teampulse_core::registry::Settings;
use teampulse_core::sample::Record;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::sink::{Delivery, Inbox, Received, Sink, SinkError};
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Shape, Stream, Subject};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_core::worker::Worker;
use teampulse_messages::convert::encode;
use teampulse_workers::{WORKERS, WorkerContext};

use keeper::Keeper;

const ECG: &str = "/humans/persons/p001/strap/ecg";
const OWN: &str = "/humans/persons/p001/own/level";
const BEGIN_NS: i64 = 1_000_000_000_000;

type Kept = Arc<Mutex<Vec<Record>>>;

/// A worker with these settings.
fn worker(settings: &str) -> Result<Box<dyn Worker>, String> {
    let table = toml::de::DeTable::parse(settings).expect("it is TOML");
    let span = table.span();
    let table = toml::Spanned::new(span, toml::de::DeValue::Table(table.into_inner()));
    let built = (WORKERS[0].build)(Settings::new(table), &WorkerContext { clock: Clock::host() });
    built.map_err(|error| format!("{}: {error} ({})", error.path, error.hint))
}

/// A worker that runs a program in Python, and offers levels.
fn python(program: &str, more: &str) -> Box<dyn Worker> {
    let program = format!("import json, os, sys, time\n{program}");
    let settings = format!(
        "command = ['python3', '-c', '''{program}''']\nstreams = ['{ECG}']\n{more}\n\
         offers = [{{ name = '{OWN}', person = 'p001', channels = [{{ name = 'level', unit = 'mV' }}] }}]"
    );
    worker(&settings).expect("it can be built")
}

/// A wave of four samples, one by one, until enough levels, or faults, were kept.
struct Strap {
    kept: Kept,
    until: fn(&[Record]) -> bool,
}

#[async_trait]
impl Source for Strap {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let stream = Stream::raw(
            ECG,
            Subject { about: teampulse_core::stream::About::Person, id: "p001".into() },
            Shape::Wave,
        );
        let stream = outlet.declare(stream.with_channels(&[("ecg", "mV")]));
        for k in 0.. {
            let at = Time::from_nanos(BEGIN_NS + k * 1_000_000_000);
            outlet.clock().set(at);
            let samples = Arc::new([k as f64, 1.0, 2.0, f64::NAN]);
            let wave = Wave { period_ns: 1e6, channels: 1, samples };
            let (source_time, data) = (Some(at), Data::Wave(wave));
            outlet.offer(Reading { index: None, stream, device_time: None, source_time, data });
            tokio::time::sleep(Duration::from_millis(10)).await;
            if (self.until)(&self.kept.lock().expect("nobody panicked")) {
                break;
            }
        }
        Ok(())
    }
}

/// Runs a session with a worker until the records are as asked, and a minute at most.
async fn session(worker: Box<dyn Worker>, until: fn(&[Record]) -> bool) -> (Outcome, Vec<Record>) {
    let kept = Kept::default();
    let strap = Strap { kept: Arc::clone(&kept), until };
    let session = session_with(worker, strap, Vec::new(), CommandSettings::default());
    let outcome = session.run(tokio::time::sleep(Duration::from_secs(60))).await;
    let kept = std::mem::take(&mut *kept.lock().expect("nobody panicked"));
    (outcome, kept)
}

/// A session of a strap and a worker, whose records are kept, with more sinks.
fn session_with(
    worker: Box<dyn Worker>,
    strap: Strap,
    mut sinks: Vec<Box<dyn Sink>>,
    commands: CommandSettings,
) -> Session {
    sinks.push(Box::new(Keeper(Arc::clone(&strap.kept))));
    Session {
        clock: Clock::settable(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("strap".into(), Box::new(strap))],
        features: Vec::new(),
        sinks,
        workers: vec![("program".into(), worker)],
        encode,
        commands: Commands::new(commands),
    }
}

fn levels(records: &[Record]) -> Vec<(Time, f64)> {
    firsts(records, OWN)
}

fn waves(records: &[Record]) -> Vec<(Time, f64)> {
    firsts(records, ECG)
}

/// The times of a stream's records, with the first number of each.
fn firsts(records: &[Record], stream: &str) -> Vec<(Time, f64)> {
    let first = |record: &Record| match &record.sample.data {
        Data::Sample(values) => values[0],
        Data::Wave(wave) => wave.samples[0],
        _ => f64::NAN,
    };
    let records = records.iter().filter(|record| record.stream.name == stream);
    records.map(|record| (record.sample.measured, first(record))).collect()
}

/// Whether a fault has a reason at its end, and then what can be done about it.
fn gives_reason_and_hint(fault: &str, reason: &str) -> bool {
    fault.split_once(reason).is_some_and(|(_, hint)| hint.starts_with("; ") && hint.len() > 10)
}

fn faults(records: &[Record]) -> Vec<String> {
    let label = |record: &Record| match &record.sample.data {
        Data::Event(event) if event.kind == EventKind::Fault => Some(event.label.clone()),
        _ => None,
    };
    records.iter().filter_map(label).collect()
}

const FIRST_VALUE: &str = "
for line in sys.stdin:
    waves = [record for record in json.loads(line) if record['channels'] == ['ecg']]
    assert waves[0]['samples'][1:] == [[1.0], [2.0], [None]] and waves[0]['id'] == 'p001', line
    print(json.dumps([{'stream': '/humans/persons/p001/own/level', 'time_ns': wave['time_ns'],
                       'values': wave['samples'][0]} for wave in waves]), flush=True)
";

#[tokio::test]
async fn what_a_program_answers_is_a_stream_with_the_times_of_what_it_looked_at() {
    let (outcome, records) =
        session(python(FIRST_VALUE, ""), |records| levels(records).len() >= 5).await;
    let levels = levels(&records);
    assert!(levels.len() >= 5, "{levels:?} {:?}", faults(&records));
    let waves = waves(&records);
    assert!(levels.iter().all(|level| waves.contains(level)), "{levels:?} {waves:?}");
    let own = records.iter().find(|record| record.stream.name == OWN).unwrap();
    assert_eq!(own.stream.inputs, [ECG]);
    assert_eq!(outcome.workers[0].error, None);
}

/// A page on which somebody clicks as soon as there is anything to see.
struct Page;

impl Sink for Page {
    fn name(&self) -> &'static str {
        "page"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Fresh
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let tablet = Sender::through("page", "the tablet");
        let start: Command = "do nback start 2".parse().expect("a command");
        let at = Some(Time::from_nanos(BEGIN_NS + 7));
        let Received::Batch(_) = inbox.receive(Duration::from_secs(9)) else { return Ok(()) };
        if let Some(outlet) = inbox.outlet() {
            while outlet.command_at(&tablet, start.clone(), at) == Err(Refused::NoReceiver) {
                std::thread::sleep(Duration::from_millis(1));
            }
            assert!(outlet.command(&tablet, Command::Stop).is_err(), "it is not allowed");
        }
        while !matches!(inbox.receive(Duration::from_secs(9)), Received::Closed) {}
        Ok(())
    }
}

#[tokio::test]
async fn a_click_on_a_page_commands_a_program_where_the_study_allows_it() {
    let program = "
for line in sys.stdin:
    asked = [each for each in json.loads(line) if 'command' in each]
    print(json.dumps([{'stream': '/humans/persons/p001/own/level', 'time_ns': each['time_ns'],
                       'values': [int(each['command'].split()[1])]} for each in asked]), flush=True)
";
    let kept = Kept::default();
    let until = |records: &[Record]| !levels(records).is_empty();
    let allowed = BTreeMap::from([("page".into(), vec!["do nback".into()])]);
    let settings = CommandSettings { components: allowed, ..CommandSettings::default() };
    let page: Vec<Box<dyn Sink>> = vec![Box::new(Page)];
    let worker = python(program, "name = 'nback'");
    let session = session_with(worker, Strap { kept: Arc::clone(&kept), until }, page, settings);
    session.run(tokio::time::sleep(Duration::from_secs(60))).await;
    let records = std::mem::take(&mut *kept.lock().expect("nobody panicked"));
    let level = levels(&records);
    assert!(!level.is_empty(), "{:?}", faults(&records));
    assert_eq!(level.iter().map(|(_, level)| *level).collect::<Vec<_>>(), [2.0]);
    let labels = |kind| {
        let event = move |record: &Record| match &record.sample.data {
            Data::Event(event) if event.kind == kind => {
                Some((event.label.clone(), record.sample.measured.nanos() - BEGIN_NS))
            }
            _ => None,
        };
        records.iter().filter_map(event).collect::<Vec<_>>()
    };
    let asked = ("page:the_tablet do nback start 2".to_owned(), 7);
    assert_eq!(labels(EventKind::Command), [asked]);
    assert!(labels(EventKind::Fault)[0].0.contains("add `stop` to `page` below [commands]"));
}

#[tokio::test]
async fn a_program_that_ends_is_started_again_and_why_it_ended_is_said() {
    let program = "
line = sys.stdin.readline()
print(json.dumps([{'stream': '/humans/persons/p001/own/level', 'values': [1]}]), flush=True)
sys.exit('no memory for the model')
";
    let (outcome, records) =
        session(python(program, ""), |records| levels(records).len() >= 2).await;
    let faults = faults(&records);
    assert!(faults.len() <= 2, "{faults:?}");
    let end = "ended with code 1: no memory for the model";
    assert!(faults[0].starts_with("program: failed to continue: `python3 -c"), "{faults:?}");
    assert!(gives_reason_and_hint(&faults[0], end), "{faults:?}");
    assert!(levels(&records).len() >= 2);
    assert_eq!(outcome.workers[0].error, None);
}

#[tokio::test]
async fn a_program_that_does_not_answer_is_ended_with_all_that_it_started() {
    // The program and its own child hold a file each, which names them.
    let file = std::env::temp_dir().join(format!("teampulse-workers-{}", std::process::id()));
    let program = format!(
        "
import subprocess
other = subprocess.Popen(['sleep', '600'])
open('{}', 'w').write(f'{{os.getpid()}} {{other.pid}}')
time.sleep(600)
",
        file.display()
    );
    let worker = python(&program, "patience_secs = 2.0");
    let (_, records) = session(worker, |records| !faults(records).is_empty()).await;
    let faults = faults(&records);
    assert!(gives_reason_and_hint(&faults[0], "within 2 s"), "{faults:?}");
    let processes = std::fs::read_to_string(&file).unwrap();
    for process in processes.split(' ') {
        // What was killed may wait for its parent to look at it.
        let status = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        assert!(status.is_empty() || status.contains(") Z"), "{status}");
    }
    std::fs::remove_file(file).unwrap();
}

#[tokio::test]
async fn an_answer_that_is_none_is_a_fault_that_says_so() {
    let worker = python("print('loading…', flush=True)\ntime.sleep(600)", "");
    let (_, records) = session(worker, |records| !faults(records).is_empty()).await;
    let faults = faults(&records);
    assert!(faults[0].contains("failed to understand the answer from `python3 -c"), "{faults:?}");
    assert!(gives_reason_and_hint(&faults[0], "expected value at line 1 column 1"), "{faults:?}");
}

#[tokio::test]
async fn an_answer_that_is_too_long_is_named_as_that() {
    let worker = python("print('[' + ' ' * (17 << 20) + ']', flush=True)\ntime.sleep(600)", "");
    let (_, records) = session(worker, |records| !faults(records).is_empty()).await;
    let faults = faults(&records);
    assert!(gives_reason_and_hint(&faults[0], "it is longer than 16 MiB"), "{faults:?}");
}

#[tokio::test]
async fn a_line_too_many_is_a_fault_and_shifts_no_answer() {
    let program = "
for line in sys.stdin:
    print('[]\\n[]', flush=True)
";
    let (_, records) = session(python(program, ""), |records| !faults(records).is_empty()).await;
    let faults = faults(&records);
    assert!(
        gives_reason_and_hint(&faults[0], "it wrote more lines than it read, beginning with: []"),
        "{faults:?}"
    );
}

#[tokio::test]
async fn a_stream_that_the_session_has_already_is_not_offered() {
    let settings = format!(
        "command = ['sh', '-c', 'while read -r line; do echo []; done']\nstreams = ['{ECG}']\n\
         offers = [{{ name = '{ECG}', channels = [{{ name = 'ecg', unit = 'mV' }}] }}]"
    );
    let settings = settings.replace(&format!("streams = ['{ECG}']"), "streams = ['/humans/**']");
    let worker = worker(&settings).expect("it can be built");
    let (_, records) = session(worker, |records| !faults(records).is_empty()).await;
    let wrong =
        format!("program: failed to offer {ECG}: the session already has a stream with that name");
    assert!(gives_reason_and_hint(&faults(&records)[0], &wrong));
}

#[tokio::test]
async fn a_session_ends_while_a_program_thinks_and_what_it_did_not_see_is_counted() {
    let program = "
sys.stdin.readline()
time.sleep(600)
";
    let enough = |records: &[Record]| waves(records).len() > 20;
    let (outcome, _) = session(python(program, ""), enough).await;
    assert!(outcome.undone.is_empty(), "{:?}", outcome.undone);
    let end = &outcome.workers[0];
    assert_eq!(end.error, None);
    assert!(end.counts.taken >= 1 && end.counts.skipped >= 5, "{:?}", end.counts);
}

#[test]
fn mistakes_in_settings_are_named_at_their_place() {
    let offer = "command = ['sh']\nstreams = ['/x']\noffers = ";
    for (settings, wrong) in [
        ("command = []\nstreams = ['/x']".to_owned(), "command: the command is empty"),
        (
            "command = ['no-such-program']\nstreams = ['/x']".into(),
            "command: the program `no-such-program` was not found (install it, or give its path)",
        ),
        (
            "command = ['/etc/passwd']\nstreams = ['/x']".into(),
            "command: the program `/etc/passwd` was not found",
        ),
        ("command = ['sh']\nstreams = []".into(), "streams: no stream is selected"),
        (
            "command = ['sh']\nstreams = ['/x']\npatience_secs = nan".into(),
            "patience_secs: a time limit of NaN s is invalid",
        ),
        (
            format!("{offer}[{{ name = '/x' }}]"),
            "streams.0: it reads /x, which it offers itself (name the streams that it computes from)",
        ),
        (format!("{offer}[{{ name = 'x' }}]"), "offers.0.name: `x` is not a valid topic name"),
        (
            format!("{offer}[{{ name = '/x/1y' }}]"),
            "offers.0.name: `/x/1y` is not a valid topic name",
        ),
        (
            format!("{offer}[{{ name = '/y', person = 'p', robot = 'r' }}]"),
            "offers.0.robot: it is about both a person and a robot",
        ),
        (
            format!("{offer}[{{ name = '/y' }}, {{ name = '/y' }}]"),
            "offers.1.name: /y is offered twice",
        ),
    ] {
        let error = worker(&settings).map(drop).unwrap_err();
        assert!(error.starts_with(wrong), "{error}\nfor\n{settings}");
    }
    assert!(worker(WORKERS[0].example).is_ok());
}
