//! Wearables over real links, with emulated devices at the other end.

mod keeper;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::{Data, EventKind};
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::stream::{About, Signal};
use teampulse_core::streams::Streams;
use teampulse_emulators::devices::{E4Fault, E4Incident, E4Server, Wearer};
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use teampulse_sources::wearables::empatica_e4::EmpaticaE4;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;

use keeper::Keeper;

type Kept = Arc<Mutex<Vec<Record>>>;

/// Skin whose conductance is the time [µS].
struct Skin;

impl Wearer for Skin {
    fn conductance_us(&mut self, secs: f64) -> f64 {
        secs
    }
}

/// A streaming server with one E4, whose time continues from connection to connection; the first one is cut off after
/// this many bytes. Keeps the requests that it receives.
async fn serve(listener: TcpListener, mut server: E4Server, cut: usize, asked: Arc<Mutex<String>>) {
    let began = Stopwatch::start();
    let mut sent = 0;
    let mut is_first = true;
    loop {
        let (mut link, _) = listener.accept().await.expect("a connection");
        let mut bytes = [0; 1024];
        loop {
            let out = server.until(began.elapsed().as_secs_f64(), &mut Skin);
            sent += out.len();
            if link.write_all(&out).await.is_err() || (is_first && sent > cut) {
                is_first = false;
                break;
            }
            let read = tokio::time::timeout(Duration::from_millis(10), link.read(&mut bytes)).await;
            match read {
                Ok(Ok(0) | Err(_)) => break,
                Ok(Ok(count)) => {
                    server.receive(&bytes[..count]);
                    let text = String::from_utf8_lossy(&bytes[..count]);
                    asked.lock().expect("nobody panicked").push_str(&text);
                }
                Err(_) => {}
            }
        }
    }
}

fn e4(settings: &str) -> Result<Box<dyn Source>, String> {
    e4_beside(Claims::default(), settings)
}

/// A source beside others with these claims.
fn e4_beside(claims: Claims, settings: &str) -> Result<Box<dyn Source>, String> {
    let buses = Arc::new(Buses::apart());
    let context =
        SourceContext { clock: Clock::host(), buses, claims, bluetooth: Bluetooth::default() };
    let settings: EmpaticaE4 = toml::from_str(settings).map_err(|error| error.to_string())?;
    settings.build(&context).map_err(|error| format!("{}: {error}", error.path))
}

/// Runs a session with a source until the records meet a condition, for 20 s at most.
async fn session(source: Box<dyn Source>, until: fn(&[Record]) -> bool) -> (Outcome, Vec<Record>) {
    let kept = Kept::default();
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("empatica_e4".into(), source)],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(&kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::new(CommandSettings::default()),
    };
    let looks = Arc::clone(&kept);
    let enough = async move {
        let began = Stopwatch::start();
        while began.elapsed() < Duration::from_secs(20)
            && !until(&looks.lock().expect("nobody panicked"))
        {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let outcome = session.run(enough).await;
    let kept = std::mem::take(&mut *kept.lock().expect("nobody panicked"));
    (outcome, kept)
}

fn of<'a>(records: &'a [Record], leaf: &str) -> Vec<&'a Record> {
    let name = format!("/humans/persons/p001/empatica_e4/{leaf}");
    records.iter().filter(|record| record.stream.name == name).collect()
}

fn value(record: &Record) -> f64 {
    let Data::Sample(values) = &record.sample.data else { panic!("{record:?}") };
    values[0]
}

#[tokio::test]
async fn an_e4_is_read_over_tcp_and_again_after_its_connection_was_cut() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = listener.local_addr().expect("an address");
    let asked = Arc::<Mutex<String>>::default();
    let incidents = vec![E4Incident { at_secs: 0.5, fault: E4Fault::Press }];
    let server = serve(listener, E4Server::new(incidents), 6_000, Arc::clone(&asked));
    let server = tokio::spawn(server);
    let source = e4(&format!("person = \"p001\"\nserver = \"{address}\"")).expect("it is built");
    let (outcome, records) = session(source, |records| {
        let eda = of(records, "eda");
        // After the cut: some seconds later than the first.
        eda.len() > 8 && value(eda[eda.len() - 1]) > value(eda[0]) + 3.0
    })
    .await;
    server.abort();
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");

    let eda = of(&records, "eda");
    let stream = &eda.last().expect("some").stream;
    assert_eq!(
        (stream.signal, stream.about, stream.id.as_str()),
        (Signal::Eda, About::Person, "p001")
    );
    assert_eq!((stream.channels[0].unit.as_str(), stream.rate_hz), ("uS", 4.0));
    // What is missing between two numbers is missing in the signal, too: 0.25 s each.
    for pair in eda.windows(2) {
        let missing = (pair[1].sample.index - pair[0].sample.index) as f64 * 0.25;
        let passed = value(pair[1]) - value(pair[0]);
        assert!((passed - missing).abs() < 1e-9, "{missing} s by numbers, {passed} s by the skin");
    }
    let all: BTreeMap<_, usize> = records.iter().fold(BTreeMap::new(), |mut all, record| {
        *all.entry(record.stream.name.as_str()).or_default() += 1;
        all
    });
    for leaf in ["ppg", "acceleration", "temperature", "markers"] {
        assert!(!of(&records, leaf).is_empty(), "no {leaf}: {all:?}");
    }
    let cut = records.iter().any(|record| match &record.sample.data {
        Data::Event(event) => {
            event.kind == EventKind::Fault && event.label.contains("the connection was closed")
        }
        _ => false,
    });
    assert!(cut, "{all:?}");
    // It is left as it is to be left.
    let asked = asked.lock().expect("nobody panicked").clone();
    assert!(asked.contains("device_subscribe gsr ON"), "{asked}");
    assert!(asked.trim_end().ends_with("device_disconnect"), "{asked}");
}

#[tokio::test]
async fn a_server_that_is_not_there_is_said_and_tried_again() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let address = listener.local_addr().expect("an address");
    drop(listener);
    let source = e4(&format!("person = \"p001\"\nserver = \"{address}\"")).expect("it is built");
    let faults = |records: &[Record]| {
        let is_fault = |record: &&Record| match &record.sample.data {
            Data::Event(event) => event.label.contains("failed to reach the E4 streaming server"),
            _ => false,
        };
        records.iter().filter(is_fault).count()
    };
    let (outcome, records) = session(source, |records| {
        records.iter().filter(|record| matches!(&record.sample.data, Data::Event(_))).count() >= 2
    })
    .await;
    assert!(faults(&records) >= 2);
    assert!(outcome.sources.is_empty(), "{outcome:?}");
}

#[test]
fn mistakes_in_settings_are_named_at_their_place() {
    for (settings, wrong) in [
        ("person = \"P 1\"", "person: `P 1` can't be the id of a person"),
        ("person = \"\"", "person: `` can't be the id of a person"),
        ("person = \"p1\"\nserver = \"here\"", "server: `here` is not an address"),
    ] {
        assert_eq!(e4(settings).map(drop), Err(wrong.to_owned()));
    }
}

#[test]
fn one_e4_is_worn_by_one_person() {
    let claims = Claims::default();
    let beside = |settings: &str| e4_beside(claims.clone(), settings);
    let first = beside("person = \"p1\"\ndevice = \"9ff167\"");
    assert!(first.is_ok());
    let twice = "device: two sources read the same E4 of 127.0.0.1:28000";
    for settings in ["person = \"p2\"", "person = \"p2\"\ndevice = \"9ff167\""] {
        assert_eq!(beside(settings).map(drop), Err(twice.to_owned()));
    }
    assert!(beside("person = \"p2\"\ndevice = \"9ff168\"").is_ok());
}
