//! The messages waiting for one client: events first, then states, then signals, pictures last. Beyond the limit of
//! their kind, messages are dropped and counted, or the client is disconnected.

mod pictures;

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes};
use tokio::sync::Notify;

use self::pictures::Pictures;
use crate::pictures::Picture;
use crate::wire::Missed;

/// The limit for messages that are never dropped [bytes]; a client that exceeds it does not read, and is disconnected.
const URGENT_BYTES: usize = 8 << 20;
/// The limit for waiting beats, breaths and similar events [bytes].
const MINOR_BYTES: usize = 256 << 10;
/// The limit for waiting waves and readings [bytes]: less than half a second at 5 Mbit/s.
const SIGNAL_BYTES: usize = 256 << 10;

/// A part of a JSON message, shared by all clients.
pub type Fragment = Arc<str>;

/// A kind of state; only the newest state of each kind waits for a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StateKind {
    /// The health of a stream.
    Status,
    /// The values of a feature.
    Feature,
    /// A reading.
    Sample,
}

/// A kind of message; only the newest of each kind waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slot {
    /// The state of the recording.
    Recording,
    /// The next phase.
    NextPhase,
    /// The unmet requirements of the study.
    Required,
    /// This program and its machine.
    Machine,
    /// Computers and buses.
    Network,
}

/// The messages waiting for one client.
#[derive(Debug, Default)]
pub struct Outbox {
    state: Mutex<State>,
    wake: Notify,
    overflowed: Notify,
}

#[derive(Debug, Default)]
struct State {
    urgent: VecDeque<Utf8Bytes>,
    minor: VecDeque<Utf8Bytes>,
    slots: BTreeMap<Slot, Utf8Bytes>,
    states: BTreeMap<(StateKind, u32), Fragment>,
    status_t: f64,
    signals: VecDeque<Signal>,
    pictures: Pictures,
    urgent_bytes: usize,
    minor_bytes: usize,
    signal_bytes: usize,
    missed: Missed,
    /// Whether missed messages are counted.
    is_settled: bool,
    reported: Missed,
    /// Why the connection ends, once it does.
    ended: Option<String>,
    /// Why the client is disconnected, once messages that must arrive no longer fit.
    overflow: Option<String>,
}

#[derive(Debug)]
enum Signal {
    Wave(Bytes),
    Sample(Fragment),
}

impl Signal {
    fn bytes(&self) -> usize {
        match self {
            Signal::Wave(bytes) => bytes.len(),
            Signal::Sample(text) => text.len(),
        }
    }
}

/// The next item to send.
#[derive(Debug)]
pub enum Next {
    /// A message to send.
    Message(Message),
    /// A picture to encode and send.
    Picture(Arc<Picture>),
    /// The connection ends, for this reason.
    End(String),
}

impl Outbox {
    /// Adds a message that must arrive: a marker, an alert, an answer.
    pub fn urgent(&self, text: impl Into<Utf8Bytes>) {
        let text = text.into();
        let mut state = self.lock();
        if state.overflow.is_some() {
            return;
        }
        state.urgent_bytes += text.len();
        state.urgent.push_back(text);
        if state.urgent_bytes > URGENT_BYTES {
            let reason = format!("the client read nothing while {} MiB waited", URGENT_BYTES >> 20);
            *state = State { overflow: Some(reason), ..State::default() };
            self.overflowed.notify_one();
        }
        self.wake.notify_one();
    }

    /// Adds `count` events of the body as one message, which is dropped if too much is waiting.
    pub fn minor(&self, text: impl Into<Utf8Bytes>, count: u64) {
        let text = text.into();
        let mut state = self.lock();
        if state.minor_bytes + text.len() > MINOR_BYTES {
            state.missed.events += count;
            return;
        }
        state.minor_bytes += text.len();
        state.minor.push_back(text);
        self.wake.notify_one();
    }

    /// Replaces a message of a kind for which only the newest is kept.
    pub fn replace(&self, slot: Slot, text: impl Into<Utf8Bytes>) {
        self.lock().slots.insert(slot, text.into());
        self.wake.notify_one();
    }

    /// Replaces the state of a stream, as of a time [s].
    pub fn state(&self, kind: StateKind, stream: u32, t: f64, fragment: Fragment) {
        let mut state = self.lock();
        let missed = state.states.insert((kind, stream), fragment).is_some();
        // For readings that are not drawn, only the newest is promised.
        if kind != StateKind::Sample {
            state.missed.states += u64::from(missed);
        }
        if kind == StateKind::Status {
            state.status_t = t;
        }
        self.wake.notify_one();
    }

    /// Adds a wave.
    pub fn wave(&self, bytes: Bytes) {
        self.signal(Signal::Wave(bytes));
    }

    /// Adds a reading that the client draws.
    pub fn sample(&self, fragment: Fragment) {
        self.signal(Signal::Sample(fragment));
    }

    fn signal(&self, signal: Signal) {
        let mut state = self.lock();
        state.signal_bytes += signal.bytes();
        state.signals.push_back(signal);
        while state.signal_bytes > SIGNAL_BYTES {
            let Some(oldest) = state.signals.pop_front() else { break };
            state.signal_bytes -= oldest.bytes();
            state.missed.signals += 1;
        }
        self.wake.notify_one();
    }

    /// Adds a picture of a stream that is shown at a rate of at most `most_per_sec`; 0 for no limit.
    pub fn picture(&self, picture: Arc<Picture>, most_per_sec: f64) {
        let mut state = self.lock();
        let skipped = state.pictures.put(picture, most_per_sec);
        state.missed.pictures += skipped;
        self.wake.notify_one();
    }

    /// Notes that the client has shown a picture of a stream, so that the next one may be sent.
    pub fn shown(&self, stream: u32) {
        self.lock().pictures.shown(stream);
        self.wake.notify_one();
    }

    /// Drops waiting states, signals and pictures, to show another time of a recording.
    pub fn forget(&self) {
        let mut state = self.lock();
        state.states.clear();
        state.signals.clear();
        state.minor.clear();
        state.pictures.forget();
        (state.signal_bytes, state.minor_bytes) = (0, 0);
    }

    /// Ends the connection; the first reason counts.
    pub fn end(&self, reason: &str) {
        self.lock().end(reason.to_owned());
        self.wake.notify_one();
    }

    /// Waits until messages that must arrive no longer fit; returns the reason for disconnecting the client.
    pub async fn overflow(&self) -> String {
        loop {
            let overflowed = self.overflowed.notified();
            if let Some(reason) = self.lock().overflow.clone() {
                return reason;
            }
            overflowed.await;
        }
    }

    /// Returns the counts of missed messages, if they have grown since the last call. Messages that were replaced
    /// before the first call are not counted: a client that joins is sent the newest of everything at once.
    pub fn missed(&self) -> Option<Missed> {
        let mut state = self.lock();
        if !std::mem::replace(&mut state.is_settled, true) {
            state.missed = Missed::default();
        }
        let missed = state.missed;
        (std::mem::replace(&mut state.reported, missed) != missed).then_some(missed)
    }

    /// The size of the waiting messages [bytes].
    pub fn waiting_bytes(&self) -> u64 {
        let state = self.lock();
        let states: usize = state.states.values().map(|fragment| fragment.len()).sum();
        (state.urgent_bytes + state.minor_bytes + state.signal_bytes + states) as u64
    }

    /// Waits for the next item to send.
    pub async fn next(&self) -> Next {
        loop {
            let woken = self.wake.notified();
            if let Some(next) = self.lock().take() {
                return next;
            }
            woken.await;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn end(&mut self, reason: String) {
        self.ended.get_or_insert(reason);
    }

    fn take(&mut self) -> Option<Next> {
        if let Some(text) = self.urgent.pop_front() {
            self.urgent_bytes -= text.len();
            return Some(Next::Message(Message::Text(text)));
        }
        if let Some(reason) = &self.ended {
            return Some(Next::End(reason.clone()));
        }
        if let Some(text) = self.minor.pop_front() {
            self.minor_bytes -= text.len();
            return Some(Next::Message(Message::Text(text)));
        }
        let slot = self.slots.pop_first().map(|(_, text)| Message::Text(text));
        let message = slot.or_else(|| self.take_states()).or_else(|| self.take_signal());
        message.map(Next::Message).or_else(|| self.pictures.take().map(Next::Picture))
    }

    /// Takes all states of one kind, as one message.
    fn take_states(&mut self) -> Option<Message> {
        let ((kind, _), _) = self.states.first_key_value()?;
        let kind = *kind;
        let others = self.states.split_off(&(kind, u32::MAX));
        let fragments = std::mem::replace(&mut self.states, others);
        let fragments: Vec<&str> = fragments.values().map(|fragment| &**fragment).collect();
        let all = fragments.join(",");
        let text = match kind {
            StateKind::Status => {
                format!(r#"{{"type":"status","t":{},"streams":[{all}]}}"#, self.status_t)
            }
            StateKind::Feature => format!(r#"{{"type":"features","features":[{all}]}}"#),
            StateKind::Sample => samples(&all),
        };
        Some(Message::Text(text.into()))
    }

    /// Takes the oldest wave, or all readings up to the next wave.
    fn take_signal(&mut self) -> Option<Message> {
        let mut readings: Vec<Fragment> = Vec::new();
        while let Some(oldest) = self.signals.front() {
            if matches!(oldest, Signal::Wave(_)) && !readings.is_empty() {
                break;
            }
            self.signal_bytes -= oldest.bytes();
            match self.signals.pop_front()? {
                Signal::Wave(bytes) => return Some(Message::Binary(bytes)),
                Signal::Sample(fragment) => readings.push(fragment),
            }
        }
        (!readings.is_empty()).then(|| Message::Text(samples(&readings.join(",")).into()))
    }
}

fn samples(fragments: &str) -> String {
    format!(r#"{{"type":"samples","samples":[{fragments}]}}"#)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::tests::picture;

    async fn sent(outbox: &Outbox) -> String {
        match outbox.next().await {
            Next::Message(Message::Text(text)) => text.as_str().to_owned(),
            Next::Message(Message::Binary(bytes)) => format!("wave of {}", bytes.len()),
            Next::Message(other) => panic!("{other:?}"),
            Next::Picture(picture) => format!("picture of {}", picture.stream),
            Next::End(reason) => format!("end: {reason}"),
        }
    }

    #[tokio::test]
    async fn events_come_before_states_and_states_before_signals() {
        let outbox = Outbox::default();
        assert_eq!(outbox.missed(), None);
        outbox.picture(Arc::new(picture(9, 0.0, 10)), 0.0);
        outbox.wave(Bytes::from_static(&[0; 10]));
        outbox.state(StateKind::Feature, 1, 0.0, "1".into());
        outbox.state(StateKind::Feature, 2, 0.0, "2".into());
        outbox.state(StateKind::Feature, 1, 0.0, "3".into());
        outbox.minor("beat", 1);
        outbox.urgent("marker");
        let mut order = Vec::new();
        for _ in 0..5 {
            order.push(sent(&outbox).await);
        }
        let features = r#"{"type":"features","features":[3,2]}"#;
        assert_eq!(order, ["marker", "beat", features, "wave of 10", "picture of 9"]);
        assert_eq!(outbox.missed(), Some(Missed { states: 1, ..Missed::default() }));
        assert_eq!((outbox.missed(), outbox.waiting_bytes()), (None, 0));
    }

    #[tokio::test]
    async fn of_signals_the_newest_wait_and_the_rest_is_counted() {
        let outbox = Outbox::default();
        assert_eq!(outbox.missed(), None);
        for place in 0..100_u8 {
            outbox.wave(vec![place; 16 << 10].into());
        }
        assert!(outbox.waiting_bytes() <= SIGNAL_BYTES as u64);
        assert_eq!(outbox.missed().unwrap().signals, 84);
        let Next::Message(Message::Binary(first)) = outbox.next().await else { panic!() };
        assert_eq!(first[0], 84);
    }

    #[tokio::test]
    async fn no_marker_is_lost_and_one_who_never_reads_is_cut_off() {
        let outbox = Outbox::default();
        let marker = "m".repeat(1000);
        for _ in 0..8000 {
            outbox.urgent(marker.clone());
        }
        assert_eq!(sent(&outbox).await, marker);
        for _ in 0..1000 {
            outbox.urgent(marker.clone());
        }
        assert_eq!(outbox.overflow().await, "the client read nothing while 8 MiB waited");
        assert_eq!(outbox.waiting_bytes(), 0);
    }
}
