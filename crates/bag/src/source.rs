//! The bag as a source: replays a recording.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::clock::Clock;
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::session_streams::CLOCKS;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Origin, Schema, Shape, Stream, StreamId};
use teampulse_core::time::Time;
use teampulse_messages::convert::{DecodeError, Decoded, decode, description};
use teampulse_messages::fields::header_stamp;

use crate::error::BagError;
use crate::pace::{Pace, Pacer};
use crate::read::messages::Message;
use crate::read::{Bag, described};
use teampulse_messages::convert::type_name;

/// The number of readings after which other tasks may run.
const TURN: usize = 256;

/// The longest silence that counts as part of a recording: an active session records a status at least twice a minute.
/// So a log time that is wrong by a day does not cause a day of silence.
const PAUSE: Duration = Duration::from_secs(600);

/// Replays a recording: each reading at its log time, in the recorded order.
///
/// A raw stream is declared when its description in the bag is reached, so that a replay learns of it when the session
/// did. Descriptions and statuses are not replayed: the new session generates its own.
#[derive(Debug)]
pub struct BagSource {
    bag: Arc<Bag>,
    selection: Selection,
    from: Option<Time>,
    pace: Option<Pace>,
    repeats: u64,
    stamps: OwnStamps,
    unread: Arc<Unread>,
    adapter: Option<Box<dyn Adapter>>,
}

/// Converts messages whose contents are known from their topics to samples, such as data of people's sensors that were
/// published as plain numbers.
pub trait Adapter: Debug + Send + Sync {
    /// Converts a message to a sample and its stream, if it knows the topic; messages are passed in order.
    fn adapt(&mut self, stream: &Stream, message: &Message) -> Option<(Stream, Data)>;
}

/// The timestamps with which samples of our own types are replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OwnStamps {
    /// The timestamps of their sources.
    Sent,
    /// The times that the recording assigned to them.
    Placed,
}

/// Which streams of a bag are replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// Raw streams only: the input of a replay.
    Raw,
    /// Derived streams as well.
    RawAndDerived,
}

/// The parts of a bag that could not be read during the replay.
#[derive(Debug, Default)]
pub struct Unread(Mutex<BTreeSet<(PathBuf, u64)>>);

impl BagSource {
    /// Replays all of a bag, once and as fast as possible.
    pub fn new(bag: Arc<Bag>, selection: Selection) -> BagSource {
        BagSource {
            bag,
            selection,
            from: None,
            pace: None,
            repeats: 1,
            stamps: OwnStamps::Sent,
            unread: Arc::default(),
            adapter: None,
        }
    }

    /// Also replays the samples to which an adapter converts messages of other recorders, each just after its message.
    #[must_use]
    pub fn adapted(mut self, adapter: Box<dyn Adapter>) -> BagSource {
        self.adapter = Some(adapter);
        self
    }

    /// Replays samples of our own types with the times that the recording assigned to them, instead of the timestamps
    /// of their sources.
    #[must_use]
    pub fn as_placed(mut self) -> BagSource {
        self.stamps = OwnStamps::Placed;
        self
    }

    /// Starts the replay at a log time.
    #[must_use]
    pub fn starting(mut self, from: Time) -> BagSource {
        self.from = Some(from);
        self
    }

    /// Lets the replay follow a pace.
    #[must_use]
    pub fn paced(mut self, pace: Pace) -> BagSource {
        self.pace = Some(pace);
        self
    }

    /// Replays the bag this many times in succession.
    #[must_use]
    pub fn repeated(mut self, times: u64) -> BagSource {
        self.repeats = times;
        self
    }

    /// Collects the unreadable parts that are skipped in `unread`, which other runs over the same bag share.
    #[must_use]
    pub fn noting(mut self, unread: &Arc<Unread>) -> BagSource {
        self.unread = Arc::clone(unread);
        self
    }

    /// The unreadable parts that were skipped; filled while the source runs.
    pub fn unread(&self) -> Arc<Unread> {
        Arc::clone(&self.unread)
    }

    /// The duration of the replay: from its first log time to just after the last.
    fn duration(&self) -> Duration {
        let (first, last) = self.bag.bounds().unwrap_or_default();
        let first = self.from.map_or(first, |from| from.max(first));
        let nanos = u64::try_from(last.nanos_since(first)).unwrap_or(0);
        Duration::from_nanos(nanos.saturating_add(1))
    }
}

#[async_trait]
impl Source for BagSource {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let adapter = self.adapter.take();
        let mut playback = Playback::new(self, adapter, outlet);
        let mut shift = Duration::ZERO;
        for _ in 0..self.repeats {
            tokio::select! {
                played = playback.play(shift) => played?,
                () = outlet.closed() => return Ok(()),
            }
            shift = shift.saturating_add(self.duration());
        }
        Ok(())
    }
}

/// One run of the source.
struct Playback<'a> {
    source: &'a BagSource,
    outlet: &'a Outlet,
    pacer: Option<Pacer>,
    /// The declaration of each stream of the bag, once made.
    declared: Vec<Option<(StreamId, Stream)>>,
    adapter: Option<Box<dyn Adapter>>,
    /// The streams of the adapter, by name.
    adapted: BTreeMap<String, StreamId>,
}

impl<'a> Playback<'a> {
    fn new(
        source: &'a BagSource,
        adapter: Option<Box<dyn Adapter>>,
        outlet: &'a Outlet,
    ) -> Playback<'a> {
        let declared = vec![None; source.bag.streams().len()];
        let (pacer, adapted) = (None, BTreeMap::new());
        let mut playback = Playback { source, outlet, pacer, declared, adapter, adapted };
        if let Some(from) = source.from {
            playback.declare_all(from);
        }
        playback
    }

    /// Replays the bag once, shifted by `shift`.
    async fn play(&mut self, shift: Duration) -> Result<(), SourceError> {
        let source = self.source;
        let mut last = None;
        for (count, message) in source.bag.messages(source.from).enumerate() {
            let message = match message {
                Ok(message) => message,
                Err(error) => {
                    source.unread.pass_over(error)?;
                    continue;
                }
            };
            let at = message.log_time + shift;
            if last.replace(at).is_some_and(|last: Time| at > last + PAUSE) {
                self.outlet.pause(at);
            }
            if let Some(pace) = &source.pace {
                let begin = source.from.unwrap_or(at);
                let pacer = self.pacer.get_or_insert_with(|| pace.keep(Clock::host(), begin));
                pacer.reach(at).await;
            }
            let readings = [self.reading(&message)?, self.adapted(&message)];
            for reading in readings.into_iter().flatten() {
                if self.outlet.send(reading, at).await.is_err() {
                    return Ok(());
                }
            }
            if count % TURN == TURN - 1 {
                tokio::task::yield_now().await;
            }
        }
        // The features computed during silence at the end show how long the session lasted.
        if let Some(last) = last {
            self.outlet.pass(last);
        }
        Ok(())
    }

    /// The reading of a message; `None` if it is not replayed.
    fn reading(&mut self, message: &Message) -> Result<Option<Reading>, SourceError> {
        let bag_stream = &self.source.bag.streams()[message.stream];
        let known = &bag_stream.stream;
        match &known.shape {
            Shape::Description => {
                self.take_description(message);
                Ok(None)
            }
            _ if !self.selects(known) => Ok(None),
            Shape::Message(_) => {
                let stream = self.declare_as(message);
                let headed = bag_stream.has_unread_headers;
                let stamp = headed.then(|| header_stamp(&message.cdr)).flatten();
                let source_time = Some(stamp.unwrap_or(message.publish_time));
                let source_time = source_time.filter(|at| *at != message.log_time);
                let data = Data::Message(message.cdr.clone());
                Ok(Some(Reading { index: None, stream, device_time: None, source_time, data }))
            }
            shape => {
                let decoded = decode(type_name(shape), &message.cdr)
                    .map_err(|error| undecodable(known, message, &error))?;
                let stream = self.declare_as(message);
                let device_time = decoded.device_time;
                // With other writers, the publish time is when a message was sent, by an unknown clock.
                let source_time = match self.source.stamps {
                    OwnStamps::Sent if !bag_stream.is_foreign => Some(message.publish_time),
                    OwnStamps::Sent | OwnStamps::Placed => Some(decoded.stamp),
                };
                let Decoded { index, data, .. } = decoded;
                Ok(Some(Reading { stream, index, device_time, source_time, data }))
            }
        }
    }

    /// The sample to which the adapter converts a message of another recorder.
    fn adapted(&mut self, message: &Message) -> Option<Reading> {
        let known = &self.source.bag.streams()[message.stream];
        let adapter = self.adapter.as_mut().filter(|_| known.is_foreign)?;
        let (stream, data) = adapter.adapt(&known.stream, message)?;
        let at = message.log_time - Duration::from_nanos(1);
        let name = stream.name.clone();
        let declare = || self.outlet.declare_at(stream, at);
        let stream = *self.adapted.entry(name).or_insert_with(declare);
        Some(Reading { stream, index: None, device_time: None, source_time: None, data })
    }

    fn selects(&self, stream: &Stream) -> bool {
        let is_word = matches!(stream.shape, Shape::Status | Shape::Description)
            || (stream.origin == Origin::Derived && stream.name == CLOCKS);
        let is_wanted =
            stream.origin == Origin::Raw || self.source.selection == Selection::RawAndDerived;
        is_wanted && !is_word
    }

    /// Declares all streams at the start, as a replay from the middle misses their descriptions.
    fn declare_all(&mut self, at: Time) {
        for (place, known) in self.source.bag.streams().iter().enumerate() {
            if self.selects(&known.stream) {
                self.declare(place, Stream::clone(&known.stream), at);
            }
        }
    }

    /// Declares the stream of a description, at the description's time.
    fn take_description(&mut self, message: &Message) {
        let Ok(description) = description(&message.schema, &message.cdr) else { return };
        if !self.selects(&description) {
            return;
        }
        // Each file of a bag starts with the earlier descriptions, with their original stamps.
        let is_repeated = message.publish_time != message.log_time;
        let Some(place) = self.source.bag.place(&description) else {
            // Only the description of this stream was recorded, and no messages.
            self.outlet.declare_at(Stream::clone(&description), message.log_time);
            return;
        };
        if !is_repeated || self.declared[place].is_none() {
            let stream = self.described(place, &description);
            self.declare(place, stream, message.log_time);
        }
    }

    /// A stream of the bag with its current description. An unchanged description marks where the definition of the
    /// type became known.
    fn described(&self, place: usize, description: &Stream) -> Stream {
        let known = &self.source.bag.streams()[place];
        let so_far = self.declared[place].as_ref().map(|(_, stream)| stream);
        let stream = described(so_far.unwrap_or(&known.stream), description);
        let schema = match &stream.shape {
            Shape::Message(_) if so_far.is_none() => known.schemas.first(),
            Shape::Message(schema) if so_far == Some(&stream) => {
                known.schemas.iter().skip_while(|known| *known != schema).nth(1)
            }
            _ => None,
        };
        with_schema(stream, schema)
    }

    /// The id of a message's stream, which is first declared if it is new, or if the definition of its type
    /// has become known.
    fn declare_as(&mut self, message: &Message) -> StreamId {
        let place = message.stream;
        let stream = match &self.declared[place] {
            Some((id, stream)) => match &stream.shape {
                Shape::Message(known) if *known != message.schema => {
                    with_schema(stream.clone(), Some(&message.schema))
                }
                _ => return *id,
            },
            None => Stream::clone(&self.source.bag.streams()[place].stream),
        };
        // The declaration is just before the message, so that the message keeps its log time.
        self.declare(place, stream, message.log_time - Duration::from_nanos(1))
    }

    fn declare(&mut self, place: usize, stream: Stream, at: Time) -> StreamId {
        let id = self.outlet.declare_at(stream.clone(), at);
        self.declared[place] = Some((id, stream));
        id
    }
}

/// The stream with another version of its type; unchanged if there is none.
fn with_schema(stream: Stream, schema: Option<&Arc<Schema>>) -> Stream {
    match schema {
        Some(schema) => Stream { shape: Shape::Message(Arc::clone(schema)), ..stream },
        None => stream,
    }
}

impl Unread {
    /// Whether everything that was requested could be read.
    pub fn is_empty(&self) -> bool {
        self.places().is_empty()
    }

    /// Records a damaged part, with a warning the first time; other errors end the source.
    fn pass_over(&self, error: BagError) -> Result<(), SourceError> {
        let BagError::Damaged { path, offset, reason } = error else { return Err(fatal(&error)) };
        let shown = path.display().to_string();
        if self.places().insert((path, offset)) {
            tracing::warn!("damaged: {shown}: at byte {offset}: {reason}; skipped");
        }
        Ok(())
    }

    fn places(&self) -> MutexGuard<'_, BTreeSet<(PathBuf, u64)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn fatal(error: &BagError) -> SourceError {
    SourceError::Fatal { message: error.to_string(), hint: error.hint().to_owned() }
}

fn undecodable(stream: &Stream, message: &Message, error: &DecodeError) -> SourceError {
    let message = format!("read {} at {}: {error}", stream.name, message.log_time);
    SourceError::Fatal { message, hint: String::new() }
}
