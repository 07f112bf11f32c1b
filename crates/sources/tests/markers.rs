//! Markers over a TCP connection and over a serial line.

mod keeper;

use std::net::{SocketAddr, TcpListener};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use teampulse_core::clock::{Clock, Stopwatch};
use teampulse_core::clocks::Clocks;
use teampulse_core::commands::{CommandSettings, Commands};
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::registry::Component;
use teampulse_core::sample::Record;
use teampulse_core::session::{Outcome, Pace, Session};
use teampulse_core::source::Source;
use teampulse_core::streams::Streams;
use teampulse_messages::convert::encode;
use teampulse_ros::buses::Buses;
use teampulse_sources::SourceContext;
use teampulse_sources::claims::Claims;
use teampulse_sources::markers::lines::MarkerLines;
use teampulse_sources::markers::ttl::Ttl;
use teampulse_sources::serial::Pty;
use teampulse_sources::wearables::bluetooth::Bluetooth;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;

use keeper::Keeper;

type Kept = Arc<Mutex<Vec<Record>>>;

const TOKEN: &str = "0123456789abcdef";

fn built<S>(settings: &str) -> Result<Box<dyn Source>, String>
where
    S: Component<dyn Source, SourceContext>,
{
    let context = SourceContext {
        clock: Clock::host(),
        buses: Arc::new(Buses::apart()),
        claims: Claims::default(),
        bluetooth: Bluetooth::default(),
    };
    let settings: S = toml::from_str(settings).map_err(|error| error.to_string())?;
    settings.build(&context).map_err(|error| format!("{}: {error}", error.path))
}

fn events(kept: &Kept) -> Vec<Event> {
    let event = |record: &Record| match &record.sample.data {
        Data::Event(event) => Some(Event::clone(event)),
        _ => None,
    };
    kept.lock().expect("nobody panicked").iter().filter_map(event).collect()
}

fn markers(kept: &Kept) -> Vec<String> {
    let markers = events(kept).into_iter().filter(|event| event.kind == EventKind::Marker);
    markers.map(|event| event.label).collect()
}

fn faults(kept: &Kept) -> Vec<String> {
    let faults = events(kept).into_iter().filter(|event| event.kind == EventKind::Fault);
    faults.map(|event| event.label).collect()
}

/// Waits until a condition holds, for a minute at most.
async fn until(mut is_so: impl FnMut() -> bool) {
    let began = Stopwatch::start();
    while began.elapsed() < Duration::from_secs(60) && !is_so() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Runs a session with a source until this is over.
async fn session(source: Box<dyn Source>, kept: &Kept, over: impl Future<Output = ()>) -> Outcome {
    let session = Session {
        clock: Clock::host(),
        pace: Pace::Live,
        clocks: Clocks::default(),
        streams: Streams::default(),
        sources: vec![("markers".into(), source)],
        features: Vec::new(),
        sinks: vec![Box::new(Keeper(Arc::clone(kept)))],
        workers: Vec::new(),
        encode,
        commands: Commands::new(CommandSettings::default()),
    };
    session.run(over).await
}

/// A free address on loopback.
fn free() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("its address")
}

/// Connects as soon as something is listening.
async fn connected(to: SocketAddr) -> TcpStream {
    for _ in 0..2000 {
        if let Ok(link) = TcpStream::connect(to).await {
            return link;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("nobody listens on {to}")
}

#[tokio::test]
async fn each_line_is_a_marker_however_it_is_cut() {
    let (at, kept) = (free(), Kept::default());
    let source = built::<MarkerLines>(&format!("listen = \"{at}\"")).expect("settings");
    let writing = async {
        let mut link = connected(at).await;
        for piece in ["trial 1\r\ntr", "ial", " 2\n\n \t\n", "µ\nthe end has no line's end"] {
            link.write_all(piece.as_bytes()).await.expect("is open");
            link.flush().await.expect("is open");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        drop(link);
        until(|| markers(&kept).len() == 4).await;
    };
    let outcome = session(source, &kept, writing).await;
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    assert_eq!(markers(&kept), ["trial 1", "trial 2", "µ", "the end has no line's end"]);
}

#[tokio::test]
async fn of_a_flood_of_connections_the_first_is_reported_and_then_their_number() {
    let (at, kept) = (free(), Kept::default());
    let source = built::<MarkerLines>(&format!("listen = \"{at}\"")).expect("settings");
    let writing = async {
        let mut links = Vec::new();
        for _ in 0..100 {
            links.push(connected(at).await);
        }
        until(|| !faults(&kept).is_empty()).await;
        drop(links);
        // One that finds a place again: the refused ones are closed by then.
        until_marked(at, &kept).await;
    };
    let outcome = session(source, &kept, writing).await;
    assert!(outcome.sources.is_empty() && outcome.undone.is_empty(), "{outcome:?}");
    let faults = faults(&kept);
    assert!(faults[0].starts_with("markers: more than 32 connections"), "{faults:?}");
    let refused = |fault: &String| fault.ends_with("connections were refused");
    assert!(faults.len() <= 8 && faults.iter().any(refused), "{faults:?}");
}

/// Connects until a marker is taken.
async fn until_marked(at: SocketAddr, kept: &Kept) {
    let began = Stopwatch::start();
    while markers(kept).is_empty() && began.elapsed() < Duration::from_secs(60) {
        let mut link = connected(at).await;
        // It fails where the connection is refused.
        drop(link.write_all(b"here\n").await);
        drop(link);
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn nothing_is_marked_without_the_token() {
    let (at, kept) = (free(), Kept::default());
    let settings = format!("listen = \"{at}\"\ntoken = \"{TOKEN}\"");
    let source = built::<MarkerLines>(&settings).expect("settings");
    let writing = async {
        for (number, first) in
            ["", "token ", "token 0123456789abcdee\n", "forged\n"].into_iter().enumerate()
        {
            let mut link = connected(at).await;
            link.write_all(format!("{first}forged\n").as_bytes()).await.expect("is open");
            until(|| faults(&kept).len() > number).await;
        }
        let mut link = connected(at).await;
        link.write_all(format!("token {TOKEN}\nmine\n").as_bytes()).await.expect("is open");
        until(|| !markers(&kept).is_empty()).await;
    };
    session(source, &kept, writing).await;
    assert_eq!(markers(&kept), ["mine"]);
    assert!(faults(&kept).iter().all(|fault| fault.contains("the token is missing or wrong")));
}

#[tokio::test]
async fn an_endless_line_ends_its_connection_alone() {
    let (at, kept) = (free(), Kept::default());
    let source = built::<MarkerLines>(&format!("listen = \"{at}\"")).expect("settings");
    let writing = async {
        let mut endless = connected(at).await;
        // It is cut off in the middle.
        endless.write_all(&vec![b'x'; 100_000]).await.ok();
        until(|| !faults(&kept).is_empty()).await;
        connected(at).await.write_all(b"\xff\xfe\nfine\n").await.expect("is open");
        until(|| markers(&kept).len() == 2).await;
    };
    session(source, &kept, writing).await;
    assert_eq!(markers(&kept), ["\u{fffd}\u{fffd}", "fine"]);
    assert!(faults(&kept)[0].contains("a line is longer than 4096 bytes"));
}

#[tokio::test]
async fn each_byte_of_a_serial_line_is_a_code() {
    let (pty, kept) = (Pty::open(None).expect("a pseudoterminal"), Kept::default());
    let settings = format!("port = \"{}\"\nlabels = {{ 1 = \"stimulus\" }}", pty.path());
    let source = built::<Ttl>(&settings).expect("settings");
    let codes: Vec<u8> = (0..=255).collect();
    let writing = async {
        // What is written before the port is open is discarded.
        until(|| pty.read(&mut Vec::new()).expect("is there")).await;
        until(|| {
            if markers(&kept).is_empty() {
                pty.write(&[9]).expect("is open");
            }
            !markers(&kept).is_empty()
        })
        .await;
        assert_eq!(pty.write(&codes).expect("is open"), 256);
        until(|| markers(&kept).iter().any(|label| label == "ttl 255")).await;
    };
    session(source, &kept, writing).await;
    let found = events(&kept);
    let numbers =
        found.iter().filter(|event| event.kind == EventKind::Marker).map(|event| event.value);
    let numbers: Vec<f64> = numbers.skip_while(|number| *number > 8.5).collect();
    assert_eq!(numbers, (1..=255).map(f64::from).collect::<Vec<_>>(), "0 resets the line");
    assert!(markers(&kept).contains(&"stimulus".to_owned()));
}

#[test]
fn mistakes_in_settings_are_named_at_their_place() {
    for (settings, wrong) in [
        ("listen = \"0.0.0.0:5006\"", "token: other computers can connect, but no token is set"),
        ("listen = \"0.0.0.0:5006\"\ntoken = \"short\"", "token: the token is too short"),
    ] {
        assert_eq!(built::<MarkerLines>(settings).map(drop), Err(wrong.to_owned()));
    }
    let wrong = built::<Ttl>("port = \"/dev/ttyUSB0\"\nlabels = { 300 = \"x\" }").map(drop);
    assert_eq!(wrong, Err("labels: `300` is not a code".to_owned()));
}
