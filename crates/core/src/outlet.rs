//! The path from a source to the pump: bounded, counted, in hand-over order.

mod queue;
mod supply;

use std::sync::Arc;

use tokio::sync::mpsc;

use crate::clock::Clock;
use crate::command::{Accepted, Command, Instruction, Sender};
use crate::commands::Refused;
use crate::computers::ClockReport;
use crate::data::{Data, Event, EventKind};
use crate::fault::passing;
use crate::loss::Loss;
use crate::publishers::PublishedBy;
use crate::session_streams::session_events;
use crate::source::Reading;
use crate::stopped::Stopped;
use crate::stream::{Stream, StreamId};
use crate::streams::{Declared, Streams};
use crate::time::Time;

pub(crate) use queue::Item;
pub use queue::Queue;
use queue::{Budget, declaration_bytes, reading_bytes};
pub use supply::Supply;

/// The most that one source may have waiting in front of the pump [bytes].
const BUDGET_BYTES: usize = 256 << 20;
/// The most that a recording may have waiting; it waits instead of dropping readings [bytes].
const RECORDED_BYTES: usize = 4 << 20;

/// A source's connection to the pump; clones share one budget.
#[derive(Clone, Debug)]
pub struct Outlet {
    queue: Queue,
    budget: Arc<Budget>,
    supply: Supply,
    clock: Clock,
    streams: Streams,
}

/// The outlet was closed: the session is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Closed;

impl Outlet {
    /// Declares a stream, before its first sample; again when it changes.
    pub fn declare(&self, stream: Stream) -> StreamId {
        self.declare_with(stream, None)
    }

    /// Declares a stream of a recording, at the time at which it was originally declared.
    pub fn declare_at(&self, stream: Stream, at: Time) -> StreamId {
        self.declare_with(stream, Some(at))
    }

    fn declare_with(&self, stream: Stream, at: Option<Time>) -> StreamId {
        // Inside the queue's lock, so that no reading of another source comes before the declaration.
        self.queue.push_with(|| {
            let Declared { id, is_new } = self.streams.declare(stream);
            self.supply.declared(id, &self.streams.get(id));
            let at = || at.unwrap_or_else(|| self.clock.now());
            let declared = || {
                let (stream, budget) = (self.streams.get(id), Arc::clone(&self.budget));
                budget.add(declaration_bytes(&stream));
                Item::Declared { id, stream, at: at(), budget }
            };
            (is_new.then(declared), id)
        })
    }

    /// Hands a reading over without ever waiting. When this source has too much waiting, the reading is dropped and
    /// counted. A wave that is not [valid](crate::data::Wave::is_valid) is dropped as well, since no reader of the
    /// recording could decode it; this is reported as a fault.
    pub fn offer(&self, reading: Reading) {
        if self.is_invalid(&reading) {
            return self.budget.drop_one(&reading);
        }
        if self.budget.waiting_bytes() + reading_bytes(&reading) > BUDGET_BYTES {
            return self.budget.drop_one(&reading);
        }
        self.push(reading, None);
    }

    /// Hands over readings that arrived together, each with its own device or source time: the intervals of one packet,
    /// or a chunk with a stamp for each sample. They are queued in order as one arrival, all or none. For regular
    /// samples use one [`Wave`](crate::data::Wave) instead.
    pub fn offer_together(&self, readings: Vec<Reading>) {
        let bytes: usize = readings.iter().map(reading_bytes).sum();
        if self.budget.waiting_bytes() + bytes > BUDGET_BYTES {
            return readings.iter().for_each(|reading| self.budget.drop_one(reading));
        }
        self.budget.add(bytes);
        for reading in &readings {
            self.supply.sent(reading.stream);
        }
        self.queue.push_with(|| {
            let arrival = self.clock.now();
            let item = |reading| {
                let budget = Arc::clone(&self.budget);
                Item::Arrived { reading, arrival, budget }
            };
            (readings.into_iter().map(item).collect::<Vec<_>>(), ())
        });
    }

    /// Hands a reading over, waiting while this source has too much waiting: for recordings, which
    /// can wait. `arrival` is when it originally arrived.
    pub async fn send(&self, reading: Reading, arrival: Time) -> Result<(), Closed> {
        let bytes = reading_bytes(&reading);
        loop {
            let drained = self.queue.drained();
            if self.queue.is_closed() {
                return Err(Closed);
            }
            let waiting = self.budget.waiting_bytes();
            if waiting == 0 || waiting + bytes <= RECORDED_BYTES {
                break;
            }
            drained.await;
        }
        self.push(reading, Some(arrival));
        Ok(())
    }

    /// States that a recording continues until a time, though no more readings are handed over.
    pub fn pass(&self, until: Time) {
        self.queue.push(|| Item::Passed { until });
    }

    /// States that a recording paused until a time: the silence before it means nothing.
    pub fn pause(&self, until: Time) {
        self.queue.push(|| Item::Paused { until });
    }

    /// Reports that this many samples of a stream were lost in transit, before its next reading; 0 means that losses
    /// are known from now on. Each sample in a wave counts: a lost wave of four samples is 4. Report the sum for each
    /// burst once.
    ///
    /// The samples of a device without a clock are timed by their number: a wrong count moves all later times.
    pub fn lost(&self, stream: StreamId, samples: u64) {
        self.report_lost(stream, Some(samples));
    }

    /// Reports that losses of a stream can't be known, at least from now on.
    pub fn losses_are_unknown(&self, stream: StreamId) {
        self.report_lost(stream, None);
    }

    fn report_lost(&self, stream: StreamId, samples: Option<u64>) {
        let event = Loss::OnTheWay.event(&self.streams.get(stream).name, samples);
        let stream = self.declare(Loss::OnTheWay.stream());
        let reading =
            Reading { index: None, stream, device_time: None, source_time: None, data: event };
        self.push(reading, None);
    }

    /// States that another computer's clock stamps a stream: `computer` is its name, which is the same for all streams
    /// that it stamps.
    pub fn stamped_by(&self, stream: StreamId, computer: &str) {
        let stream = self.streams.get(stream).name.clone();
        self.report(&ClockReport::StampedBy { stream, computer: computer.to_owned() });
    }

    /// Reports a probe of the clock of another computer: how far it is ahead of the session's clock [s],
    /// and how long the exchange took, without the time spent on that computer [s].
    pub fn probed(&self, computer: &str, offset_secs: f64, round_trip_secs: f64) {
        self.report(&ClockReport::Probed {
            computer: computer.to_owned(),
            offset_secs,
            round_trip_secs,
        });
    }

    /// States who publishes the topic of a stream if there are several publishers, and when there is only one again.
    pub fn published_by(&self, stream: StreamId, publishers: &[String]) {
        let stream = self.streams.get(stream).name.clone();
        let published_by = PublishedBy { stream, publishers: publishers.to_vec() };
        self.hand_over(PublishedBy::stream(), published_by.event());
    }

    /// States that a stream was stopped on purpose, for example by a command: until it has [`started`](Outlet::started)
    /// again, its silence is no fault and its source is not missing. It stays stopped when the source is run again.
    pub fn stopped(&self, stream: StreamId) {
        self.supply.stopped();
        self.report_stopped(stream, true);
    }

    /// States that a stopped stream has resumed: from now on its silence is a fault again.
    pub fn started(&self, stream: StreamId) {
        self.report_stopped(stream, false);
    }

    fn report_stopped(&self, stream: StreamId, is_stopped: bool) {
        let stream = self.streams.get(stream).name.clone();
        self.hand_over(Stopped::stream(), Stopped { stream, is_stopped }.event());
    }

    /// Publishes an event of the session.
    pub fn happen(&self, event: Event) {
        self.happen_at(event, None);
    }

    /// Publishes an event that happened at a known time of the session's clock, such as a click in a browser: up to
    /// eleven minutes ago, if it was annotated afterwards or had to wait for a connection.
    pub fn happen_at(&self, event: Event, at: Option<Time>) {
        let stream = self.declare(session_events());
        let data = Data::Event(Arc::new(event));
        let device_time = at.map(Time::nanos);
        self.offer(Reading { index: None, stream, device_time, source_time: at, data });
    }

    fn report(&self, report: &ClockReport) {
        self.hand_over(report.stream(), report.event());
    }

    /// Sends a command to the session or to one of its components. Both accepted and refused commands are recorded as
    /// events of the session.
    pub fn command(&self, sender: &Sender, command: Command) -> Result<(), Refused> {
        self.command_at(sender, command, None)
    }

    /// Sends a command like [`command`](Outlet::command), but given at a known time of the session's clock.
    pub fn command_at(
        &self,
        sender: &Sender,
        command: Command,
        at: Option<Time>,
    ) -> Result<(), Refused> {
        self.carry_out(sender, command, at, 0.0)
    }

    /// Labels a span of time with a marker that begins at `begin` on the session's clock and lasts `duration_secs`. The
    /// sender must be allowed to `mark`.
    pub fn annotate(
        &self,
        sender: &Sender,
        label: String,
        begin: Time,
        duration_secs: f64,
    ) -> Result<(), Refused> {
        self.carry_out(sender, Command::Mark(label), Some(begin), duration_secs)
    }

    fn carry_out(
        &self,
        sender: &Sender,
        command: Command,
        at: Option<Time>,
        duration_secs: f64,
    ) -> Result<(), Refused> {
        let commands = self.queue.commands();
        if let Err(refused) = commands.check(sender, &command) {
            let label = format!("the command `{command}` from {sender} was refused: {refused}");
            if commands.is_new(&label) {
                self.happen(passing(label));
            }
            return Err(refused);
        }
        let accepted = Accepted { sender: sender.clone(), command };
        self.happen_at(accepted.event(), at);
        let Accepted { sender, command } = accepted;
        if let Command::Mark(label) = &command {
            let (kind, label) = (EventKind::Marker, label.clone());
            self.happen_at(Event { kind, label, value: f64::NAN, duration_secs }, at);
        }
        let at = at.unwrap_or_else(|| self.clock.now());
        commands.dispatch(&Instruction { sender, command, at });
        Ok(())
    }

    /// Receives the commands for which `accepts` returns true, until the returned value is dropped.
    pub fn commands(
        &self,
        accepts: impl Fn(&Command) -> bool + Send + 'static,
    ) -> mpsc::Receiver<Instruction> {
        self.queue.commands().receive(accepts)
    }

    /// Receives the requests that [`Command::Do`] sends to this component, until the returned value is dropped.
    pub fn requests(&self, component: impl Into<String>) -> mpsc::Receiver<Instruction> {
        let component = component.into();
        self.commands(move |command| matches!(command, Command::Do { component: asked, .. } if *asked == component))
    }

    /// Whether a reading can't be recorded, which is reported once for each stream.
    fn is_invalid(&self, reading: &Reading) -> bool {
        let Data::Wave(wave) = &reading.data else { return false };
        let is_invalid = !wave.is_valid();
        if is_invalid {
            let name = &self.streams.get(reading.stream).name;
            let label = format!(
                "{name}: a wave without a valid period or with an incomplete sample was dropped"
            );
            if self.queue.commands().is_new(&label) {
                self.happen(passing(label));
            }
        }
        is_invalid
    }

    fn hand_over(&self, stream: Stream, data: Data) {
        let stream = self.declare(stream);
        self.offer(Reading { index: None, stream, device_time: None, source_time: None, data });
    }

    /// Resolves when the session is over.
    pub async fn closed(&self) {
        self.queue.closed().await;
    }

    /// Whether the session is over.
    pub fn is_closed(&self) -> bool {
        self.queue.is_closed()
    }

    /// The session's clock.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The streams of the session.
    pub fn streams(&self) -> &Streams {
        &self.streams
    }

    /// The supply of this outlet and its clones: what they have declared and handed over so far.
    pub fn supply(&self) -> Supply {
        self.supply.clone()
    }

    fn push(&self, reading: Reading, arrival: Option<Time>) {
        self.budget.add(reading_bytes(&reading));
        self.supply.sent(reading.stream);
        let budget = Arc::clone(&self.budget);
        // The arrival is read inside the queue's lock, so that arrival times never go back along the queue.
        self.queue.push(|| {
            let arrival = arrival.unwrap_or_else(|| self.clock.now());
            Item::Arrived { reading, arrival, budget }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::time::Duration;

    use super::*;
    use crate::data::Wave;
    use crate::stream::{Shape, Subject};
    use crate::text::LONGEST_PROSE;
    use bytes::Bytes;

    fn reading(stream: StreamId, bytes: usize) -> Reading {
        let data = Data::Message(Bytes::from(vec![0; bytes]));
        Reading { index: None, stream, device_time: None, source_time: None, data }
    }

    fn outlet(queue: &Queue) -> (Outlet, StreamId) {
        let outlet = queue.outlet(Clock::settable(), Streams::default());
        let id = outlet.declare(Stream::raw("/r1/x", Subject::robot("r1"), Shape::Sample));
        (outlet, id)
    }

    #[test]
    fn a_wave_that_no_reader_could_decode_is_counted_and_a_fault() {
        let queue = Queue::new();
        let (outlet, id) = outlet(&queue);
        let offer = |period_ns, count: usize| {
            let samples = vec![0.0; count].into();
            let data = Data::Wave(Wave { period_ns, channels: 2, samples });
            outlet.offer(Reading {
                index: None,
                stream: id,
                device_time: None,
                source_time: None,
                data,
            });
        };
        for (period_ns, count) in [(1e6, 4), (f64::NAN, 4), (-1.0, 4), (1e6, 3), (0.0, 2)] {
            offer(period_ns, count);
        }
        let mut taken = VecDeque::new();
        queue.take(&mut taken, Duration::ZERO);
        let waves = |item: &&Item| matches!(item, Item::Arrived { reading, .. } if matches!(reading.data, Data::Wave(_)));
        assert_eq!(taken.iter().filter(waves).count(), 2);
        let faults = |item: &&Item| matches!(item, Item::Arrived { reading, .. } if matches!(reading.data, Data::Event(_)));
        assert_eq!(taken.iter().filter(faults).count(), 1);
        // Two of two, and one and a half.
        assert!(taken.iter().any(|item| matches!(item, Item::Dropped { samples: 5, .. })));
    }

    #[test]
    fn what_does_not_fit_is_dropped_and_counted() {
        let queue = Queue::new();
        let (outlet, id) = outlet(&queue);
        for _ in 0..5 {
            outlet.offer(reading(id, BUDGET_BYTES / 3));
        }
        let mut taken = VecDeque::new();
        queue.take(&mut taken, Duration::ZERO);
        let arrived = taken.iter().filter(|item| matches!(item, Item::Arrived { .. })).count();
        assert_eq!(arrived, 2);
        assert!(matches!(taken.back(), Some(Item::Dropped { samples: 3, .. })));

        outlet.offer(reading(id, 1));
        taken.clear();
        queue.take(&mut taken, Duration::ZERO);
        assert_eq!(
            taken.len(),
            1,
            "a drained budget is whole again, and its losses are reported once"
        );
    }

    #[test]
    fn of_readings_that_came_at_once_all_fit_or_none() {
        let queue = Queue::new();
        let (outlet, id) = outlet(&queue);
        let both = |bytes| vec![reading(id, bytes), reading(id, bytes)];
        outlet.offer_together(both(BUDGET_BYTES / 3));
        outlet.offer_together(both(BUDGET_BYTES / 6));
        let mut taken = VecDeque::new();
        queue.take(&mut taken, Duration::ZERO);
        let arrived = taken.iter().filter(|item| matches!(item, Item::Arrived { .. })).count();
        assert_eq!(arrived, 2);
        assert!(matches!(taken.back(), Some(Item::Dropped { samples: 2, .. })));
        assert_eq!(outlet.budget.waiting_bytes(), 0);
    }

    #[test]
    fn what_is_said_of_streams_counts_for_what_it_holds() {
        let queue = Queue::new();
        let outlet = queue.outlet(Clock::settable(), Streams::default());
        let doc = "x".repeat(LONGEST_PROSE);
        let stream = Stream::raw("/r1/y", Subject::session(), Shape::Description);
        let stream = Stream { doc: doc.clone(), ..stream };
        let id = outlet.declare(stream.clone());
        assert!(outlet.budget.waiting_bytes() > doc.len());
        let description = Arc::new(stream);
        for _ in 0..BUDGET_BYTES / doc.len() {
            let data = Data::Description(Arc::clone(&description));
            let stream = id;
            outlet.offer(Reading {
                index: None,
                stream,
                device_time: None,
                source_time: None,
                data,
            });
        }
        assert!(outlet.budget.waiting_bytes() <= BUDGET_BYTES);
        let mut taken = VecDeque::new();
        queue.take(&mut taken, Duration::ZERO);
        assert!(matches!(taken.back(), Some(Item::Dropped { samples: 1.., .. })));
        assert_eq!(outlet.budget.waiting_bytes(), 0);
    }

    #[test]
    fn whoever_declares_it_a_stream_is_declared_before_its_readings() {
        for _ in 0..200 {
            let (queue, streams) = (Queue::new(), Streams::default());
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    let outlet = queue.outlet(Clock::settable(), streams.clone());
                    scope.spawn(move || {
                        let subject = Subject::robot("r1");
                        let id = outlet.declare(Stream::raw("/r1/x", subject, Shape::Sample));
                        outlet.offer(reading(id, 1));
                    });
                }
            });
            let mut taken = VecDeque::new();
            queue.take(&mut taken, Duration::ZERO);
            assert!(matches!(taken.front(), Some(Item::Declared { .. })));
            assert_eq!(taken.len(), 5);
        }
    }

    #[tokio::test]
    async fn a_recording_waits_until_the_pump_has_room() {
        let queue = Queue::new();
        let (outlet, id) = outlet(&queue);
        queue.take(&mut VecDeque::new(), Duration::ZERO);
        let first = outlet.send(reading(id, RECORDED_BYTES), Time::from_nanos(1)).await;
        assert_eq!(first, Ok(()));
        let waiting = outlet.send(reading(id, 1), Time::from_nanos(2));
        let drain = async {
            tokio::task::yield_now().await;
            queue.take(&mut VecDeque::new(), Duration::ZERO);
        };
        assert_eq!(tokio::join!(waiting, drain).0, Ok(()));
        queue.close();
        assert_eq!(outlet.send(reading(id, 1), Time::from_nanos(3)).await, Err(Closed));
    }
}
