use std::fs;
use std::sync::Arc;

use bytes::Bytes;
use teampulse_core::data::{Event, EventKind, Wave};
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{Channel, Schema, Subject};
use teampulse_core::time::Time;
use tempfile::{TempDir, tempdir};

use super::*;

struct Session {
    folder: TempDir,
    tables: Tables,
}

impl Session {
    fn new() -> Session {
        let folder = tempdir().unwrap();
        let tables = Tables::new(folder.path().to_owned());
        Session { folder, tables }
    }

    fn report(&mut self, id: u32, stream: &Stream, data: Data) {
        let cdr = match &data {
            Data::Message(cdr) => cdr.clone(),
            _ => Bytes::new(),
        };
        let sample = Sample {
            stream: StreamId(id),
            measured: Time::from_nanos(1_500_000_000),
            log_time: Time::from_nanos(2_000_000_000),
            device_time: None,
            source_time: None,
            period_ns: 1e7,
            index: 7,
            turn: Turn::OnTime,
            data,
        };
        let record = Record { stream: Arc::new(stream.clone()), sample, cdr };
        self.tables.write(&record).unwrap();
    }

    fn text(&mut self, name: &str) -> String {
        self.tables.finish().unwrap();
        fs::read_to_string(self.folder.path().join(name)).unwrap()
    }

    fn names(&mut self) -> Vec<String> {
        self.tables.finish().unwrap();
        let names = fs::read_dir(self.folder.path()).unwrap();
        let names = names.map(|each| each.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }
}

fn wave(channels: u32, samples: &[f64]) -> Data {
    Data::Wave(Wave { period_ns: 1e7, channels, samples: samples.into() })
}

fn messages(name: &str, schema: Option<Arc<Schema>>) -> Stream {
    let unknown = Schema {
        name: "std_msgs/msg/Header".into(),
        encoding: "ros2msg".into(),
        text: String::new(),
        hash: String::new(),
    };
    let schema = schema.unwrap_or_else(|| Arc::new(unknown));
    Stream::raw(name, Subject::robot("r1"), Shape::Message(schema))
}

#[test]
fn a_wave_has_a_row_for_each_of_its_samples() {
    let mut session = Session::new();
    let stream = Stream::raw("/p1/strap/ecg", Subject::robot("r1"), Shape::Wave);
    let channel = |name| Channel { scale: 0.5, ..Channel::new(name, "mV") };
    let stream = Stream { channels: vec![channel("ecg"), channel("lead2")], ..stream };
    session.report(0, &stream, wave(2, &[1.0, 2.0, -0.0, 4.0]));
    assert_eq!(
        session.text("p1__strap__ecg.csv"),
        "measured_secs,log_time_secs,index,ecg [mV],lead2 [mV]\n\
         1.500000000,2.000000000,7,0.5,1\n\
         1.510000000,2.000000000,7,0,2\n"
    );
}

#[test]
fn what_comes_before_its_channels_are_known_waits_for_them() {
    let mut session = Session::new();
    let unknown = Stream::raw("/p1/strap/ecg", Subject::robot("r1"), Shape::Wave);
    session.report(0, &unknown, wave(1, &[1.0]));
    session.report(0, &unknown.clone().with_channels(&[("ecg", "mV")]), wave(1, &[2.0]));
    let text = session.text("p1__strap__ecg.csv");
    assert_eq!(text.lines().next(), Some("measured_secs,log_time_secs,index,ecg [mV]"));
    assert_eq!(text.lines().count(), 3);
}

#[test]
fn what_nobody_described_is_numbered() {
    let mut session = Session::new();
    let unknown = Stream::raw("/p1/strap/ecg", Subject::robot("r1"), Shape::Wave);
    session.report(0, &unknown, wave(2, &[1.0, 2.0]));
    let text = session.text("p1__strap__ecg.csv");
    assert_eq!(text.lines().next(), Some("measured_secs,log_time_secs,index,value1,value2"));
}

#[test]
fn two_types_on_one_topic_have_a_table_each() {
    let mut session = Session::new();
    let schema = |name: &str| {
        let schema = Schema {
            name: name.into(),
            encoding: "ros2msg".into(),
            text: "float64 x".into(),
            hash: String::new(),
        };
        Some(Arc::new(schema))
    };
    let cdr = || Data::Message(Bytes::from_static(&[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]));
    session.report(0, &messages("/r1/x", schema("a_msgs/msg/A")), cdr());
    session.report(1, &messages("/r1/x", schema("b_msgs/msg/B")), cdr());
    session.report(2, &messages("/r1/X", schema("a_msgs/msg/A")), cdr());
    assert_eq!(
        session.names(),
        ["r1__X__a_msgs_msg_A.csv", "r1__x.csv", "r1__x__b_msgs_msg_B.csv"]
    );
}

#[test]
fn messages_wait_for_their_definition() {
    let mut session = Session::new();
    let unknown = |text: &str| {
        let schema = Schema {
            name: "own_msgs/msg/Own".into(),
            encoding: "ros2msg".into(),
            text: text.into(),
            hash: String::new(),
        };
        messages("/r1/own", Some(Arc::new(schema)))
    };
    let cdr = Bytes::from_static(&[0, 1, 0, 0, 5, 0, 0, 0]);
    session.report(0, &unknown(""), Data::Message(cdr.clone()));
    session.report(0, &unknown("uint32 count"), Data::Message(cdr));
    assert_eq!(
        session.text("r1__own.csv"),
        "measured_secs,log_time_secs,index,count\n\
         1.500000000,2.000000000,7,5\n1.500000000,2.000000000,7,5\n"
    );
}

/// A message of `string s` and `float64[] xs`, with its stamp.
fn list(text: &str, numbers: &[f64]) -> Data {
    let mut cdr = vec![0, 1, 0, 0];
    cdr.extend((text.len() as u32 + 1).to_le_bytes());
    cdr.extend(text.bytes().chain([0]));
    cdr.resize((cdr.len() - 4).next_multiple_of(4) + 4, 0);
    cdr.extend((numbers.len() as u32).to_le_bytes());
    if !numbers.is_empty() {
        cdr.resize((cdr.len() - 4).next_multiple_of(8) + 4, 0);
    }
    cdr.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    cdr.extend([7]);
    Data::Message(cdr.into())
}

#[test]
fn an_array_that_grows_keeps_all_of_its_values() {
    let mut session = Session::new();
    let schema = Schema {
        name: "own_msgs/msg/List".into(),
        encoding: "ros2msg".into(),
        text: "string s\nfloat64[] xs\nuint8 end".into(),
        hash: String::new(),
    };
    let stream = messages("/r1/list", Some(Arc::new(schema)));
    session.report(0, &stream, list("a, \"b\"\nc", &[]));
    session.report(0, &stream, list("", &[1.0]));
    session.report(0, &stream, list("", &[2.0, 3.0]));
    session.report(0, &stream, list("", &[4.0]));
    let text = session.text("r1__list.csv");
    let times = "1.500000000,2.000000000,7";
    let rows = ["\"a, \"\"b\"\"\nc\",,,7", ",1,,7", ",2,3,7", ",4,,7"];
    let rows = rows.map(|row| format!("{times},{row}\n")).concat();
    assert_eq!(text, format!("measured_secs,log_time_secs,index,s,xs[0],xs[1],end\n{rows}"));
    assert_eq!(session.names(), ["r1__list.csv"]);
}

#[test]
fn what_cannot_be_decoded_is_named() {
    let lacks = |text: &str, cdr: &'static [u8]| {
        let schema = Schema {
            name: "own_msgs/msg/Own".into(),
            encoding: "ros2msg".into(),
            text: text.into(),
            hash: String::new(),
        };
        let stream = messages("/r1/own", Some(Arc::new(schema)));
        let mut session = Session::new();
        session.report(0, &stream, Data::Message(Bytes::from_static(cdr)));
        session.report(0, &stream, Data::Message(Bytes::from_static(cdr)));
        let table = session.tables.by_stream.get_mut(&StreamId(0)).unwrap();
        table.conclude().unwrap();
        let lacks = table.lacks();
        session.tables.finish().unwrap();
        (lacks, session.tables.undecoded.load(Ordering::Acquire))
    };
    let (lack, undecoded) = lacks("float64 x", &[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!((lack.len(), undecoded), (0, 0));
    let (lack, undecoded) = lacks("float64 x", &[0, 1, 0, 0, 0, 0]);
    assert_eq!(
        lack,
        ["2 messages have no values in its table: failed to read 8 bytes at byte 0 of a message: \
          2 are left"]
    );
    assert_eq!(undecoded, 2);
    let (lack, _) = lacks("", &[0, 1, 0, 0, 0, 0]);
    assert_eq!(
        lack,
        ["its table has only the sizes of the messages: failed to read the definition of \
          own_msgs/msg/Own: it is not known"]
    );
}

#[test]
fn a_sample_that_is_wider_than_its_first_keeps_all_of_its_numbers() {
    let mut session = Session::new();
    let stream = Stream::raw("/p1/own", Subject::robot("r1"), Shape::Sample);
    let stream = stream.with_channels(&[("x", "m")]);
    session.report(0, &stream, Data::Sample([1.0].into()));
    session.report(0, &stream, Data::Sample([2.0, 3.0].into()));
    let text = session.text("p1__own.csv");
    let lines: Vec<&str> = text
        .lines()
        .map(|line| line.rsplit_once("index,").map_or(line, |(_, names)| names))
        .collect();
    assert_eq!(
        lines,
        ["x [m],value2", "1.500000000,2.000000000,7,1,", "1.500000000,2.000000000,7,2,3"]
    );
}

fn health() -> StreamStatus {
    StreamStatus {
        name: "/r1/x".into(),
        state: State::Ok,
        reason: String::new(),
        rate_hz: 1.0,
        age_secs: 0.0,
        received: 1,
        lost_source: None,
        lost_queue: 0,
        late: 0,
        duplicates: 0,
        clock: 0,
        epoch: 0,
        offset_secs: 0.0,
        skew_ppm: 0.0,
        jitter_secs: 0.0,
        sigma_secs: 0.0,
        latency_secs: 0.0,
    }
}

#[test]
fn the_health_of_streams_is_left_out_where_a_recording_has_none() {
    for (has_health, names) in [(true, vec!["teampulse__status.csv"]), (false, vec![])] {
        let mut session = Session::new();
        session.tables.has_health = has_health;
        let stream = Stream::raw("/teampulse/status", Subject::session(), Shape::Status);
        session.report(0, &stream, Data::Status(Arc::new(health())));
        assert_eq!(session.names(), names);
    }
}

#[test]
fn a_thousand_tables_need_few_open_files() {
    let mut session = Session::new();
    let name = |number: u32| format!("/r1/number{number}");
    for _ in 0..2 {
        for number in 0..1000 {
            let stream = Stream::raw(name(number), Subject::robot("r1"), Shape::Sample);
            let stream = stream.with_channels(&[("x", "m")]);
            session.report(number, &stream, Data::Sample(Arc::new([1.0])));
            let open = session.tables.open.len();
            assert!(open <= MOST_OPEN, "{open}");
        }
    }
    assert_eq!(session.text("r1__number3.csv").lines().count(), 3);
    assert_eq!(session.names().len(), 1000);
}

#[test]
fn no_name_leads_out_of_the_folder_and_no_label_is_a_formula() {
    let mut session = Session::new();
    let stream = Stream::raw("/../\u{1b}[2J\n=x", Subject::session(), Shape::Event);
    let label = "=cmd|' /C calc'!A0, and".to_owned();
    let event = Event { kind: EventKind::Marker, label, value: f64::NAN, duration_secs: 0.0 };
    session.report(0, &stream, Data::Event(Arc::new(event)));
    let names = session.names();
    let is_plain = |each: char| each.is_alphanumeric() || "_-.".contains(each);
    assert!(names[0].starts_with("_..____2J__x") && names[0].chars().all(is_plain), "{names:?}");
    let text = session.text(&names[0]);
    assert!(text.contains("marker,\"'=cmd|' /C calc'!A0, and\",,0"), "{text}");
}
