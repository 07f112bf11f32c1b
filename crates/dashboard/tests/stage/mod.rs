//! A dashboard on a port of its own, fed with records, and browsers that connect to it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::JoinHandle;

use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use teampulse_core::clock::Clock;
use teampulse_core::data::{Data, Event, EventKind};
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::session_streams::session_events;
use teampulse_core::sink::{Batch, Delivery, Post, Sink, SinkError, queue};
use teampulse_core::stream::Stream;
use teampulse_core::streams::Streams;
use teampulse_core::time::Time;
use teampulse_dashboard::{Addresses, Context, Dashboard, Settings};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// A running dashboard.
pub struct Stage {
    post: Option<Post>,
    running: Option<JoinHandle<Result<(), SinkError>>>,
    streams: Streams,
    clock: Clock,
    /// Its host and port.
    pub host: String,
}

impl Stage {
    /// A dashboard of a session of this name.
    pub fn new(session: &str) -> Stage {
        let clock = Clock::host();
        Stage::of(Context::new(session, clock.clone()), Settings::default())
    }

    /// A dashboard with these settings, on any port.
    pub fn of(context: Context, settings: Settings) -> Stage {
        let clock = context.clock.clone();
        let (announces, announced) = std::sync::mpsc::sync_channel(1);
        let announce = Arc::new(move |addresses: &Addresses| {
            announces.send(addresses.here.clone()).expect("a running dashboard");
        });
        let context = Context { announce, ..context };
        let settings = Settings { port: Some(0), ..settings };
        let streams = Streams::default();
        let (post, inbox) = queue(Delivery::Fresh, streams.clone());
        let dashboard = Box::new(Dashboard::new(context, settings));
        let running = std::thread::spawn(move || dashboard.run(inbox));
        let address = announced.recv().expect("a running dashboard");
        let host =
            address.trim_start_matches("http://").split('/').next().expect("a host").to_owned();
        Stage { post: Some(post), running: Some(running), streams, clock, host }
    }

    /// Passes the dashboard a sample of a stream.
    pub fn give(&self, stream: Stream, period_ns: f64, data: Data) {
        self.hand_over(stream, self.clock.now(), period_ns, data);
    }

    /// Hands it one that was measured at a time of the session's clock [s].
    pub fn give_at(&self, secs: f64, stream: Stream, data: Data) {
        self.hand_over(stream, Time::from_nanos((secs * 1e9) as i64), 0.0, data);
    }

    /// The session's time [s].
    pub fn now(&self) -> f64 {
        self.clock.now().nanos() as f64 / 1e9
    }

    fn hand_over(&self, stream: Stream, measured: Time, period_ns: f64, data: Data) {
        let id = self.streams.declare(stream).id;
        let now = self.clock.now();
        let sample = Sample {
            stream: id,
            measured,
            log_time: now,
            device_time: None,
            source_time: None,
            period_ns,
            index: 0,
            turn: Turn::OnTime,
            data,
        };
        let record = Record { stream: self.streams.get(id), sample, cdr: Bytes::default() };
        self.post.as_ref().expect("a running dashboard").deliver(&Batch::from([record]));
    }

    /// Passes it an event of the session.
    pub fn happen(&self, kind: EventKind, label: &str) {
        let event = Event { kind, label: label.into(), value: f64::NAN, duration_secs: 0.0 };
        self.give(session_events(), 0.0, Data::Event(Arc::new(event)));
    }

    /// A browser that has received everything known so far.
    pub async fn browser(&self) -> Browser {
        let mut browser = self.connect().await;
        browser.until("ready").await;
        browser
    }

    /// A browser that has just connected.
    pub async fn connect(&self) -> Browser {
        let (socket, _) =
            connect_async(format!("ws://{}/ws", self.host)).await.expect("a running dashboard");
        Browser { socket, seen: BTreeMap::new(), events: Vec::new() }
    }

    /// The answer to a request, from its first line on; `HOST` stands for the host and port.
    pub async fn request(&self, lines: &[&str], body: &str) -> String {
        let mut stream = TcpStream::connect(&self.host).await.expect("a running dashboard");
        let head = lines.join("\r\n").replace("HOST", &self.host);
        let length = body.len();
        let text = format!("{head}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}");
        stream.write_all(text.as_bytes()).await.expect("a running dashboard");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).await.expect("a running dashboard");
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// Ends the session; returns what the sink returned.
    pub fn end(mut self) -> Result<(), SinkError> {
        drop(self.post.take());
        self.running.take().expect("a running dashboard").join().expect("a running dashboard")
    }
}

/// A browser.
pub struct Browser {
    pub socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    /// The newest message of each type.
    pub seen: BTreeMap<String, Value>,
    /// All events.
    events: Vec<Value>,
}

/// What a browser receives.
#[derive(Debug)]
pub enum Received {
    Text(Value),
    Wave(Vec<u8>),
    /// The end, with its reason.
    Closed(String),
}

impl Browser {
    /// Sends a text.
    pub async fn say(&mut self, text: impl Into<String>) {
        self.socket.send(Message::Text(text.into().into())).await.expect("a running dashboard");
    }

    /// Sends a text, if the connection is still open.
    pub async fn socket_say(&mut self, text: &str) -> Result<(), Error> {
        self.socket.send(Message::Text(text.into())).await
    }

    /// The next message.
    pub async fn next(&mut self) -> Received {
        loop {
            match self.socket.next().await {
                Some(Ok(Message::Text(text))) => {
                    let value: Value = serde_json::from_str(&text).expect("a running dashboard");
                    let kind = value["type"].as_str().expect("a running dashboard").to_owned();
                    self.events.extend(value["events"].as_array().into_iter().flatten().cloned());
                    self.seen.insert(kind, value.clone());
                    return Received::Text(value);
                }
                Some(Ok(Message::Binary(bytes))) => return Received::Wave(bytes.to_vec()),
                Some(Ok(Message::Close(close))) => {
                    let reason = close.map(|close| close.reason.to_string());
                    return Received::Closed(reason.unwrap_or_default());
                }
                Some(Ok(_)) => {}
                Some(Err(error)) => return Received::Closed(error.to_string()),
                None => return Received::Closed(String::new()),
            }
        }
    }

    /// Reads up to a message of a type.
    pub async fn until(&mut self, kind: &str) -> Value {
        loop {
            match self.next().await {
                Received::Text(value) if value["type"] == kind => return value,
                Received::Closed(reason) => panic!("closed before {kind}: {reason}"),
                _ => {}
            }
        }
    }

    /// Reads until the connection ends; returns the reason.
    pub async fn ended(&mut self) -> String {
        loop {
            if let Received::Closed(reason) = self.next().await {
                return reason;
            }
        }
    }

    /// The event with this label; reads up to it.
    pub async fn event(&mut self, label: &str) -> Value {
        loop {
            if let Some(place) = self.events.iter().position(|event| event["label"] == label) {
                return self.events.drain(..=place).next_back().expect("a running dashboard");
            }
            self.until("events").await;
        }
    }
}
