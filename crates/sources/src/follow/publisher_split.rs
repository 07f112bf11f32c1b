//! A person's topic with a stream per publisher: two people's heartbeats must not be mixed.

use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex};

use teampulse_core::clock::Clock;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::stream::{Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_ros::bus::{Arrival, Deliver};
use teampulse_ros::graph::{Gid, Graph};
use tokio::sync::watch;

use super::decoding::{self, ObservedChannels, Reading};
use super::lock;
use super::loss_counter::LossCounter;
use super::publishers::{Change, MOST_BESIDE, Place, Publishers};
use super::publishing::{names_of, who};

/// The largest number of messages that wait until their publisher is known; more are counted as lost.
const MOST_WAITING: usize = 10_000;

/// The streams of a topic: one for the primary publisher, and one for each secondary.
///
/// Messages of a secondary publisher are recorded on a separate stream, which no feature reads; see [`Stream::beside`].
pub(super) struct PublisherSplit {
    outlet: Outlet,
    graph: watch::Receiver<Arc<Graph>>,
    host: Clock,
    id: StreamId,
    stream: Stream,
    reading: Reading,
    publishers: Publishers,
    waiting: VecDeque<Arrival>,
    primary: StreamReceiver,
    beside: Vec<Beside>,
    /// The publishers last reported.
    reported: Vec<String>,
    has_refused: bool,
}

/// The stream of a secondary publisher, reused by its successors.
struct Beside {
    receiver: StreamReceiver,
    /// The first publisher of the stream.
    publisher: String,
}

/// The receiver of one stream's messages.
pub(super) struct StreamReceiver {
    deliver: Deliver,
    pub(super) losses: Arc<Mutex<LossCounter>>,
    /// The channels observed in the messages.
    pub(super) observed: Arc<Mutex<ObservedChannels>>,
}

impl StreamReceiver {
    /// Creates the receiver of a declared stream.
    fn of(
        outlet: &Outlet,
        graph: &watch::Receiver<Arc<Graph>>,
        (id, stream): (StreamId, &Stream),
        reading: &Reading,
    ) -> StreamReceiver {
        let losses = if reading.is_stamped {
            LossCounter::new(id, graph.clone())
        } else {
            LossCounter::of_unstamped(id)
        };
        let losses = Arc::new(Mutex::new(losses));
        let observed = Arc::<Mutex<ObservedChannels>>::default();
        StreamReceiver {
            deliver: decoding::deliver(outlet, (id, stream), reading, &losses, &observed),
            losses,
            observed,
        }
    }
}

impl PublisherSplit {
    /// Creates the streams of a topic on a bus; `id` and `stream` are the declared stream of the primary publisher.
    pub(super) fn new(
        outlet: &Outlet,
        graph: watch::Receiver<Arc<Graph>>,
        (id, stream): (StreamId, &Stream),
        reading: Reading,
    ) -> PublisherSplit {
        PublisherSplit {
            primary: StreamReceiver::of(outlet, &graph, (id, stream), &reading),
            outlet: outlet.clone(),
            graph,
            host: Clock::host(),
            id,
            stream: stream.clone(),
            reading,
            publishers: Publishers::default(),
            waiting: VecDeque::new(),
            beside: Vec::new(),
            reported: Vec::new(),
            has_refused: false,
        }
    }

    /// The stream of the primary publisher.
    pub(super) fn primary(&self) -> &StreamReceiver {
        &self.primary
    }

    /// Handles a message.
    pub(super) fn take(&mut self, arrival: Arrival) {
        self.waiting.push_back(arrival);
        self.hand_over(self.host.now());
    }

    /// Updates the description of the stream.
    pub(super) fn describe(&mut self, stream: &Stream) {
        self.stream = stream.clone();
        for (place, Beside { publisher, .. }) in self.beside.iter().enumerate() {
            self.outlet.declare(self.stream_beside(place, publisher.clone()));
        }
    }

    /// Checks which publishers are present now; reports the publishers of the topic if they have changed.
    pub(super) fn look(&mut self, present: &BTreeSet<Gid>) {
        let now = self.host.now();
        self.publishers.show(present, now);
        self.hand_over(now);
        self.report_publishers();
    }

    /// Ends the streams: offers waiting messages.
    pub(super) fn close(&mut self, present: &BTreeSet<Gid>) {
        self.look(present);
        self.publishers.decide();
        self.hand_over(self.host.now());
    }

    /// Reports the losses since the previous call, and returns their number.
    pub(super) fn report_losses(&self) -> u64 {
        let receivers =
            std::iter::once(&self.primary).chain(self.beside.iter().map(|each| &each.receiver));
        let report = |receiver: &StreamReceiver| lock(&receiver.losses).report(&self.outlet);
        receivers.map(report).sum()
    }

    /// Offers the waiting messages whose publisher is known.
    fn hand_over(&mut self, now: Time) {
        let mut waiting = std::mem::take(&mut self.waiting);
        while let Some(arrival) = waiting.pop_front() {
            let place = self.publishers.place(arrival.publisher, now);
            for change in self.publishers.take_changes() {
                self.report(change, arrival.publisher);
            }
            match place {
                Place::Heard => (self.primary.deliver)(arrival),
                Place::Beside(place) => (self.beside[place].receiver.deliver)(arrival),
                Place::Unknown if self.waiting.len() < MOST_WAITING => {
                    self.waiting.push_back(arrival);
                }
                Place::Unknown | Place::Refused => self.refuse(),
            }
        }
    }

    fn report_publishers(&mut self) {
        let names = names_of(&self.graph.borrow(), &self.publishers.speaking().collect::<Vec<_>>());
        if names != self.reported && (names.len() > 1 || self.reported.len() > 1) {
            self.outlet.published_by(self.id, &names);
            self.reported = names;
        }
    }

    fn report(&mut self, change: Change, publisher: Gid) {
        let mut both: Vec<Gid> = self.publishers.speaking().take(1).collect();
        both.push(publisher);
        let names = names_of(&self.graph.borrow(), &both);
        let [first, other] = [names.first(), names.last()].map(|name| name.map_or("", |name| name));
        let topic = self.stream.name.clone();
        let label = match change {
            Change::Beside(place) => {
                let beside = self.open_beside(place, publisher);
                format!(
                    "{topic}: a second publisher, {other}, beside {first}; its messages are kept separately as {beside}"
                )
            }
            Change::TookOver => {
                format!(
                    "{topic}: messages come from {other} from now on; the previous publisher was silent"
                )
            }
        };
        self.outlet.happen(passing(label));
        self.report_publishers();
    }

    /// Opens the stream of a secondary publisher, unless it is open; returns its name.
    fn open_beside(&mut self, place: usize, publisher: Gid) -> String {
        if place == self.beside.len() {
            let publisher = who(&self.graph.borrow(), publisher);
            let stream = self.stream_beside(place, publisher.clone());
            let id = self.outlet.declare(stream.clone());
            let receiver =
                StreamReceiver::of(&self.outlet, &self.graph, (id, &stream), &self.reading);
            self.beside.push(Beside { receiver, publisher });
        }
        self.stream.beside(place + 2).name
    }

    fn stream_beside(&self, place: usize, publisher: String) -> Stream {
        let topic = &self.stream.name;
        let doc = format!("messages of a second publisher on {topic}");
        Stream { publisher, doc, ..self.stream.beside(place + 2) }
    }

    fn refuse(&mut self) {
        lock(&self.primary.losses).refuse();
        if !std::mem::replace(&mut self.has_refused, true) {
            let (topic, most) = (&self.stream.name, MOST_BESIDE + 1);
            self.outlet.happen(passing(format!(
                "{topic}: more than {most} publishers; messages of the others are counted as lost"
            )));
        }
    }
}
