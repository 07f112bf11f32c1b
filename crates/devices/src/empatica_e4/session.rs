use std::collections::VecDeque;
use std::time::Duration;

use super::grid::{Before, Grid};
use super::line_buffer::LineBuffer;
use super::message::{Channels, Message, Sample};
use crate::outbox::Outbox;
use crate::watchdog::Watchdog;
use crate::{ByteSession, Channel, Error, Event, Output, Reading, Session, Stream};

const ANSWER_PATIENCE: Duration = Duration::from_secs(5);
const MOST_ATTEMPTS: u32 = 3;

/// The number of attempts to find an E4 that is off or out of range.
const MOST_SEARCHES: u32 = 12;

/// The time without a sample after which subscriptions are renewed.
const SILENCE: Duration = Duration::from_secs(4);
const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// Which E4 to read, and which of its signals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct E4Settings {
    /// The E4's ID, such as `9ff167`; `None` for the first one that the server lists.
    pub device: Option<String>,
    /// The signals to subscribe to: any of `acc`, `bvp`, `gsr`, `tmp`, `ibi`, `bat`, `tag`.
    pub subscriptions: Vec<&'static str>,
}

impl Default for E4Settings {
    fn default() -> Self {
        let subscriptions = vec!["bvp", "gsr", "acc", "tmp", "ibi", "bat", "tag"];
        Self { device: None, subscriptions }
    }
}

/// A session with one E4 through the streaming server.
///
/// ```
/// use std::time::Duration;
/// use teampulse_devices::empatica_e4::{E4Session, E4Settings};
/// use teampulse_devices::{ByteSession, Output, Session};
///
/// let mut e4 = E4Session::new(E4Settings::default());
/// e4.start(Duration::ZERO);
/// let mut asked = Vec::new();
/// e4.receive(b"R device_list 1 | 9ff167 Empatica_E4\r\n", Duration::ZERO);
/// while let Some(output) = e4.poll() {
///     if let Output::Request(line) = output {
///         asked.extend(line); // write it to the socket
///     }
/// }
/// assert_eq!(asked, b"device_list\r\ndevice_connect 9ff167\r\n");
/// ```
#[derive(Debug)]
pub struct E4Session {
    settings: E4Settings,
    out: Outbox<Vec<u8>>,
    lines: LineBuffer,
    requests: VecDeque<String>,
    pending: Option<Pending>,
    searches: u32,
    /// When to look for the E4 again.
    search_at: Option<Duration>,
    /// `Some` while samples are expected.
    watchdog: Option<Watchdog>,
    restarts: u32,
    is_stopping: bool,
    grids: [Grid; Channels::ALL.len()],
}

#[derive(Debug)]
struct Pending {
    request: String,
    deadline: Duration,
    attempts: u32,
}

impl E4Session {
    /// Creates a session that has not started.
    pub fn new(settings: E4Settings) -> Self {
        Self {
            settings,
            out: Outbox::default(),
            lines: LineBuffer::default(),
            requests: VecDeque::new(),
            pending: None,
            searches: 0,
            search_at: None,
            watchdog: None,
            restarts: 0,
            is_stopping: false,
            grids: Default::default(),
        }
    }

    fn receive_line(&mut self, line: &[u8], now: Duration) {
        let text = String::from_utf8_lossy(line);
        match Message::parse(&text) {
            Some(Message::Sample(sample)) => self.receive_sample(sample, now),
            Some(Message::Tag(time_ns)) => {
                self.out.event(Event::Marker { name: "tag", device_time_ns: Some(time_ns) });
            }
            Some(Message::Devices(devices)) => self.receive_devices(&devices, now),
            Some(Message::Answer(request, result)) => self.receive_answer(&request, result, now),
            Some(Message::Linked(connected)) => self.receive_link(connected, now),
            None if text.trim().is_empty() => {}
            None => self.out.discarded("streaming server", line.len()),
        }
    }

    fn receive_sample(&mut self, sample: Sample, now: Duration) {
        let Sample { channels, time_ns, values } = sample;
        let Some(at) = Channels::ALL.iter().position(|one| one.stream == channels.stream) else {
            return;
        };
        let Some(grid) = self.grids.get_mut(at) else { return };
        let stream = channels.stream;
        let (index, before) = grid.place(time_ns, channels.rate_hz);
        match before {
            Before::Nothing => {}
            Before::Lost(lost) => self.out.event(Event::Gap { stream, samples: Some(lost) }),
            Before::StepBack => {
                self.out.event(Event::ClockSet { stream });
                self.out.event(Event::Gap { stream, samples: None });
            }
        }
        let period_ns = channels.rate_hz.map(|rate_hz| 1e9 / rate_hz);
        let device_time_ns = Some(time_ns);
        self.out.reading(Reading { stream, index, device_time_ns, period_ns, values });
        self.restarts = 0;
        if let Some(watchdog) = &mut self.watchdog {
            watchdog.feed(now);
        }
    }

    fn receive_devices(&mut self, devices: &[String], now: Duration) {
        if self.pending.take_if(|pending| pending.request == "device_list").is_none() {
            return;
        }
        let wanted = &self.settings.device;
        let found = devices.iter().find(|id| wanted.as_ref().is_none_or(|wanted| wanted == *id));
        match found {
            Some(id) => self.requests.push_back(format!("device_connect {id}")),
            None => self.search_later("the streaming server has no such E4", now),
        }
        self.send_next(now);
    }

    fn search_later(&mut self, failure: &'static str, now: Duration) {
        self.searches += 1;
        if self.searches == MOST_SEARCHES {
            return self.end(Err(Error::Refused(failure)));
        }
        self.search_at = Some(now.saturating_add(ANSWER_PATIENCE));
    }

    fn receive_answer(&mut self, answered: &str, result: Result<(), String>, now: Duration) {
        // `R bvp ERR …` answers `device_subscribe bvp ON`.
        let answers = |pending: &mut Pending| {
            let subscription = pending.request.strip_prefix("device_subscribe ");
            let begins = |request: &str| {
                request.split_once(' ').is_some_and(|(word, _)| word == answered)
                    || request
                        .strip_prefix(answered)
                        .is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
            };
            begins(&pending.request) || subscription.is_some_and(begins)
        };
        let Some(pending) = self.pending.take_if(answers) else {
            return; // of an earlier attempt
        };
        match (pending.request.split(' ').collect::<Vec<_>>().as_slice(), result) {
            (["device_connect", ..], Ok(())) => self.subscribe(now),
            (["device_connect", ..], Err(_)) => {
                self.search_later("the E4 is not available", now);
            }
            (["device_subscribe", word, ..], Err(reason)) => {
                let named = Channels::ALL.iter().find(|channels| channels.subscription == *word);
                let stream = named.map_or("tag", |channels| channels.stream);
                self.out.event(Event::Refused { stream, reason });
            }
            (["device_disconnect"], _) => self.end(Ok(())),
            _ => {}
        }
        self.send_next(now);
    }

    fn subscribe(&mut self, now: Duration) {
        self.watchdog = self.watched().map(|_| Watchdog::new(now, SILENCE));
        self.requests.push_back("pause ON".to_owned());
        for word in &self.settings.subscriptions {
            self.requests.push_back(format!("device_subscribe {word} ON"));
        }
        self.requests.push_back("pause OFF".to_owned());
    }

    /// Returns a stream that must not fall silent; those of pulses, presses and the battery may.
    fn watched(&self) -> Option<&'static str> {
        let watched = |one: &&Channels| {
            one.rate_hz.is_some() && self.settings.subscriptions.contains(&one.subscription)
        };
        Channels::ALL.iter().find(watched).map(|channels| channels.stream)
    }

    fn receive_link(&mut self, connected: bool, now: Duration) {
        self.out.event(Event::Wearable { connected });
        // Samples resume by themselves, however long that takes.
        let watched = self.watched().filter(|_| connected);
        self.watchdog = watched.map(|_| Watchdog::new(now, SILENCE));
    }

    fn send_next(&mut self, now: Duration) {
        if self.pending.is_some() || self.out.is_done() {
            return;
        }
        if let Some(request) = self.requests.pop_front() {
            self.send(request, 1, now);
        }
    }

    fn send(&mut self, request: String, attempts: u32, now: Duration) {
        self.out.request(format!("{request}\r\n").into_bytes());
        let patience = if self.is_stopping { STOP_PATIENCE } else { ANSWER_PATIENCE };
        self.pending = Some(Pending { request, deadline: now.saturating_add(patience), attempts });
    }

    fn repeat(&mut self, now: Duration) {
        let Some(pending) = self.pending.take_if(|pending| pending.deadline <= now) else { return };
        if self.is_stopping {
            self.end(Ok(()));
        } else if pending.attempts == MOST_ATTEMPTS {
            self.end(Err(Error::NoAnswer("requests")));
        } else {
            self.send(pending.request, pending.attempts + 1, now);
        }
    }

    fn subscribe_again(&mut self, now: Duration) {
        let Some(watchdog) = self.watchdog.filter(|watchdog| watchdog.has_expired(now)) else {
            return;
        };
        if let Some(stream) = self.watched() {
            self.out.event(Event::Stalled { stream, quiet: watchdog.quiet(now) });
        }
        self.restarts += 1;
        if self.restarts > MOST_ATTEMPTS {
            return self.end(Err(Error::Silent("samples")));
        }
        self.requests.clear();
        self.subscribe(now);
    }

    fn end(&mut self, result: Result<(), Error>) {
        self.reset();
        self.out.done(result);
    }

    fn reset(&mut self) {
        self.requests.clear();
        self.pending = None;
        self.search_at = None;
        self.watchdog = None;
        self.is_stopping = false;
        self.lines.clear();
    }
}

impl Session for E4Session {
    type Request = Vec<u8>;

    fn start(&mut self, now: Duration) {
        self.out.reopen();
        self.reset();
        self.searches = 0;
        self.restarts = 0;
        let subscribed = |one: &&Channels| self.settings.subscriptions.contains(&one.subscription);
        for channels in Channels::ALL.iter().filter(subscribed) {
            if channels.word != "Temp" {
                self.out.stream(described(channels));
            }
        }
        self.send("device_list".to_owned(), 1, now);
    }

    fn tick(&mut self, now: Duration) {
        if self.out.is_done() {
            return;
        }
        self.repeat(now);
        if self.search_at.take_if(|at| *at <= now).is_some() {
            self.requests.push_back("device_list".to_owned());
        }
        self.subscribe_again(now);
        self.send_next(now);
    }

    fn next_tick(&self) -> Option<Duration> {
        let answer = self.pending.as_ref().map(|pending| pending.deadline);
        let samples = self.watchdog.map(|watchdog| watchdog.deadline());
        [answer, self.search_at, samples].into_iter().flatten().min()
    }

    fn stop(&mut self, now: Duration) {
        if self.out.is_done() || self.is_stopping {
            return;
        }
        self.requests.clear();
        self.watchdog = None;
        self.search_at = None;
        self.is_stopping = true;
        self.send("device_disconnect".to_owned(), 1, now);
    }

    fn poll(&mut self) -> Option<Output<Vec<u8>>> {
        self.out.next()
    }
}

impl ByteSession for E4Session {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        let mut rest = bytes;
        while !rest.is_empty() && !self.out.is_done() {
            match self.lines.next(&mut rest) {
                Some(Ok(line)) => self.receive_line(&line, now),
                Some(Err(bytes)) => self.out.discarded("streaming server", bytes),
                None => {}
            }
        }
    }
}

fn described(channels: &Channels) -> Stream {
    let channel = |name: &&'static str| Channel::new(name, channels.unit).scaled(channels.scale);
    let names = channels.names.iter().map(channel).collect();
    Stream { rate_hz: channels.rate_hz, ..Stream::irregular(channels.stream, names) }
}
