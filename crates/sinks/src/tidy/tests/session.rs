//! Parts shared by the tests of tidy files: a session, played second by second, and the files that it wrote.

use std::fs;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::clock::Clock;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_core::registry::Component;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::sink::{SinkError, queue};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, Subject, Window};
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use tempfile::{TempDir, tempdir};

use crate::tidy::Tidy;
use crate::{Ended, SinkContext};

pub const ECG: &str = "/humans/persons/p001/polar_h10/ecg";

/// A session that is written into a folder, second by second.
pub struct Session {
    pub folder: TempDir,
    pub streams: Streams,
    pub records: Vec<Record>,
    pub bag_ended: Ended,
    pub damage: Option<String>,
    pub is_imported: bool,
}

impl Session {
    pub fn new() -> Session {
        let (folder, streams) = (tempdir().unwrap(), Streams::default());
        let mut session = Session {
            folder,
            streams,
            records: Vec::new(),
            bag_ended: Ended::default(),
            damage: None,
            is_imported: false,
        };
        let of_session = Stream::raw("/teampulse/streams", Subject::session(), Shape::Description);
        let first = Arc::new(of_session.clone());
        session.report(0.0, &of_session, Data::Description(first));
        session
    }

    pub fn report(&mut self, secs: f64, stream: &Stream, data: Data) {
        self.take_at(secs, secs, stream, data);
    }

    /// Passes a sample that was measured before it arrived.
    pub fn take_at(&mut self, measured_secs: f64, log_secs: f64, stream: &Stream, data: Data) {
        let id = self.streams.declare(stream.clone()).id;
        let sample = Sample {
            stream: id,
            measured: time(measured_secs),
            log_time: time(log_secs),
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data,
        };
        self.records.push(Record { stream: Arc::new(stream.clone()), sample, cdr: Bytes::new() });
    }

    pub fn phase(&mut self, secs: f64, label: &str, duration_secs: f64) {
        let event = event(EventKind::Phase, label, f64::NAN, duration_secs);
        self.report(secs, &session_events(), event);
    }

    /// A beat every 0.8 s from `begin` on, the first without an interval.
    pub fn beats(&mut self, input: &str, signal: Signal, begin_secs: f64, count: u32) {
        let input = Stream {
            signal,
            device: input.split('/').nth(4).unwrap().into(),
            ..Stream::raw(input, person(), Shape::Wave)
        };
        self.streams.declare(input.clone());
        let stream = Stream::derived(&input, "beats", Shape::Event);
        for k in 0..count {
            let interval_ms = if k == 0 { f64::NAN } else { 800.0 + f64::from(k) };
            let beat = event(EventKind::Beat, "beat", interval_ms, 0.0);
            self.report(begin_secs + 0.8 * f64::from(k), &stream, beat);
        }
    }

    /// A window that ends at each of these seconds.
    pub fn windows(
        &mut self,
        leaf: &str,
        ends_secs: std::ops::RangeInclusive<u32>,
        window_secs: f64,
    ) {
        for secs in ends_secs {
            self.window(leaf, f64::from(secs), window(window_secs));
        }
    }

    /// A window of the electrocardiogram that ends at a second.
    pub fn window(&mut self, leaf: &str, end_secs: f64, window: Data) {
        let ecg = Stream::raw(ECG, person(), Shape::Wave);
        if self.streams.find(ECG).is_none() {
            self.streams.declare(ecg.clone());
        }
        let channels = [("ECG_Rate_Mean", "bpm"), ("HRV_LF", "ms^2")];
        let (family, window_name) = leaf.split_once('/').unwrap();
        let over = match window_name.strip_prefix('w') {
            Some(secs) => Window::of_secs(secs.parse().unwrap()),
            None => Window::Phases,
        };
        let stream = Stream::derived(&ecg, family, Shape::Feature);
        let stream = stream.over(over).with_channels(&channels);
        if self.streams.find(&stream.name).is_none() {
            self.report(end_secs, &session_streams(), described(&stream));
        }
        self.report(end_secs, &stream, window);
    }

    pub fn run(mut self) -> Files {
        let end = event(EventKind::Clock, END, f64::NAN, 0.0);
        let last = self.records.last().map_or(time(0.0), |last| last.sample.log_time);
        self.report(last.secs_since(time(0.0)) + 1.0, &session_events(), end);
        self.run_cut_off()
    }

    /// Writes the files of an imported recording.
    pub fn import(mut self) -> Files {
        self.is_imported = true;
        self.run_cut_off()
    }

    /// Runs as if there had been a crash: the end of the session is not recorded.
    pub fn run_cut_off(self) -> Files {
        write(&self).unwrap();
        let names = fs::read_dir(self.folder.path()).unwrap();
        let names = names.map(|each| each.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        Files { folder: self.folder, names }
    }
}

/// Whether a file has intervals for Kubios.
pub fn is_of_intervals(name: &str) -> bool {
    name.strip_suffix(".txt").is_some_and(|name| name.starts_with("intervals"))
}

/// Writes the files of a session.
pub fn write(session: &Session) -> Result<(), SinkError> {
    let context = SinkContext {
        bag_ended: session.bag_ended.clone(),
        damage: session.damage.clone(),
        is_imported: session.is_imported,
        ..SinkContext::new(session.folder.path(), "trial", Clock::settable())
    };
    let sink = Tidy::default().build(&context).unwrap();
    let (post, inbox) = queue(sink.delivery(), session.streams.clone());
    post.deliver(&session.records.clone().into());
    drop(post);
    sink.run(inbox)
}

/// The files that a session wrote.
pub struct Files {
    folder: TempDir,
    pub names: Vec<String>,
}

impl Files {
    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.folder.path().join(name)).unwrap()
    }

    /// The files of intervals for Kubios.
    pub fn intervals(&self) -> Vec<&str> {
        let names = self.names.iter().map(String::as_str);
        names.filter(|name| is_of_intervals(name)).collect()
    }

    /// The permissions of a file.
    pub fn mode(&self, name: &str) -> u32 {
        let metadata = fs::metadata(self.folder.path().join(name)).unwrap();
        std::os::unix::fs::MetadataExt::mode(&metadata)
    }

    /// Some columns of `features.csv`.
    pub fn columns(&self, columns: &[usize]) -> Vec<String> {
        let text = self.text("features.csv");
        let pick = |line: &str| {
            let cells: Vec<&str> = line.split(',').collect();
            columns.iter().map(|k| cells[*k]).collect::<Vec<_>>().join(" ")
        };
        let mut rows: Vec<String> = text.lines().skip(1).map(pick).collect();
        rows.dedup();
        rows
    }
}

pub fn time(secs: f64) -> Time {
    Time::from_nanos(1_795_000_000_000_000_000 + (secs * 1e9).round() as i64)
}

pub fn person() -> Subject {
    Subject { about: About::Person, id: "p001".into() }
}

pub fn session_streams() -> Stream {
    Stream::raw("/teampulse/streams", Subject::session(), Shape::Description)
}

pub fn described(stream: &Stream) -> Data {
    Data::Description(Arc::new(stream.clone()))
}

pub fn event(kind: EventKind, label: &str, value: f64, duration_secs: f64) -> Data {
    Data::Event(Arc::new(Event { kind, label: label.into(), value, duration_secs }))
}

pub fn window(window_secs: f64) -> Data {
    covered(window_secs, 1.0)
}

/// A window in which only a share has data.
pub fn covered(window_secs: f64, coverage: f32) -> Data {
    Data::Feature(Arc::new(FeatureValues {
        window_secs,
        coverage,
        quality: 0.75,
        values: vec![71.5, f64::NAN],
        sigmas: Vec::new(),
        reasons: vec![Reason::Ok, Reason::Short],
    }))
}

/// A window without values.
pub fn empty(window_secs: f64) -> Data {
    Data::Feature(Arc::new(FeatureValues {
        window_secs,
        coverage: 1.0,
        quality: 0.0,
        values: vec![f64::NAN; 2],
        sigmas: Vec::new(),
        reasons: vec![Reason::Short; 2],
    }))
}

pub fn status(name: &str, state: State, lost_source: Option<u64>) -> Data {
    Data::Status(Arc::new(StreamStatus {
        name: name.into(),
        state,
        reason: if state == State::Ok { String::new() } else { "silent for 9.0 s".into() },
        rate_hz: 20.0,
        age_secs: 0.05,
        received: 100,
        lost_source,
        lost_queue: 0,
        late: 0,
        duplicates: 0,
        clock: 0,
        epoch: 0,
        offset_secs: f64::NAN,
        skew_ppm: f64::NAN,
        jitter_secs: f64::NAN,
        sigma_secs: 0.0005,
        latency_secs: f64::NAN,
    }))
}

pub fn status_stream() -> Stream {
    let stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
    Stream { origin: Origin::Derived, ..stream }
}
