//! A bag as a source: what was recorded, handed over again.

use std::collections::BTreeSet;
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

/// After so many readings other tasks have their turn.
const TURN: usize = 256;

/// Where nothing at all was recorded for longer than this, nothing was watched: a session that watches
/// anything records a status twice a minute. So a log time that is wrong by a day is no day of silence.
const PAUSE: Duration = Duration::from_secs(600);

/// Hands a recording over: each reading at the log time that it had, in the order that it had.
///
/// A raw stream is declared where its description stands in the bag, so that a replay learns of it
/// when the session did. Descriptions and statuses are not handed over: they are made anew.
#[derive(Debug)]
pub struct BagSource {
    bag: Arc<Bag>,
    selection: Selection,
    from: Option<Time>,
    pace: Option<Pace>,
    repeats: u64,
    stamps: OwnStamps,
    unread: Arc<Unread>,
}

/// Which stamps samples of our own shapes are handed over with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OwnStamps {
    /// Those that their sources put on them.
    Sent,
    /// Where the recording has placed them in time.
    Placed,
}

/// What of a bag is handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// What came from outside: what a replay starts from.
    Raw,
    /// What was computed from it as well.
    RawAndDerived,
}

/// The parts of a bag that could not be read while it was handed over.
#[derive(Debug, Default)]
pub struct Unread(Mutex<BTreeSet<(PathBuf, u64)>>);

impl BagSource {
    /// Hands over all of a bag, once and as fast as it is taken.
    pub fn new(bag: Arc<Bag>, selection: Selection) -> BagSource {
        BagSource {
            bag,
            selection,
            from: None,
            pace: None,
            repeats: 1,
            stamps: OwnStamps::Sent,
            unread: Arc::default(),
        }
    }

    /// Hands samples of our own shapes over with the times at which the recording has placed them, not
    /// with the stamps that their sources put on them.
    #[must_use]
    pub fn as_placed(mut self) -> BagSource {
        self.stamps = OwnStamps::Placed;
        self
    }

    /// Begins at a log time.
    #[must_use]
    pub fn starting(mut self, from: Time) -> BagSource {
        self.from = Some(from);
        self
    }

    /// Keeps a pace.
    #[must_use]
    pub fn paced(mut self, pace: Pace) -> BagSource {
        self.pace = Some(pace);
        self
    }

    /// Hands it over so many times, each behind the one before.
    #[must_use]
    pub fn repeated(mut self, times: u64) -> BagSource {
        self.repeats = times;
        self
    }

    /// What could not be read and was passed over; it is filled while the source runs.
    pub fn unread(&self) -> Arc<Unread> {
        Arc::clone(&self.unread)
    }

    /// From the first log time to just behind the last.
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
        let mut playback = Playback::new(self, outlet);
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

/// One run of a source.
struct Playback<'a> {
    source: &'a BagSource,
    outlet: &'a Outlet,
    pacer: Option<Pacer>,
    /// For each stream of the bag, what was declared of it.
    declared: Vec<Option<(StreamId, Stream)>>,
}

impl<'a> Playback<'a> {
    fn new(source: &'a BagSource, outlet: &'a Outlet) -> Playback<'a> {
        let declared = vec![None; source.bag.streams().len()];
        let mut playback = Playback { source, outlet, pacer: None, declared };
        if let Some(from) = source.from {
            playback.declare_all(from);
        }
        playback
    }

    /// Plays the bag once, `shift` later than it was recorded.
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
                let pacer = self.pacer.get_or_insert_with(|| pace.keep(Clock::host(), at));
                pacer.reach(at).await;
            }
            if let Some(reading) = self.reading(&message)?
                && self.outlet.send(reading, at).await.is_err()
            {
                return Ok(());
            }
            if count % TURN == TURN - 1 {
                tokio::task::yield_now().await;
            }
        }
        // Features computed in a silence at the end show how long the session lasted.
        if let Some(last) = last {
            self.outlet.pass(last);
        }
        Ok(())
    }

    /// The reading that a message is; `None` for one that is not handed over.
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
                // Others' publish time is when a message was sent, by whatever clock.
                let source_time = match self.source.stamps {
                    OwnStamps::Sent if !bag_stream.is_foreign => Some(message.publish_time),
                    OwnStamps::Sent | OwnStamps::Placed => Some(decoded.stamp),
                };
                let Decoded { index, data, .. } = decoded;
                Ok(Some(Reading { stream, index, device_time, source_time, data }))
            }
        }
    }

    fn selects(&self, stream: &Stream) -> bool {
        let is_word = matches!(stream.shape, Shape::Status | Shape::Description)
            || (stream.origin == Origin::Derived && stream.name == CLOCKS);
        let is_wanted =
            stream.origin == Origin::Raw || self.source.selection == Selection::RawAndDerived;
        is_wanted && !is_word
    }

    /// Declares all at the beginning, as a playback from the middle does not meet the descriptions.
    fn declare_all(&mut self, at: Time) {
        for (place, known) in self.source.bag.streams().iter().enumerate() {
            if self.selects(&known.stream) {
                self.declare(place, Stream::clone(&known.stream), at);
            }
        }
    }

    /// Declares the stream of a description, at its time.
    fn take_description(&mut self, message: &Message) {
        let Ok(description) = description(&message.schema, &message.cdr) else { return };
        if !self.selects(&description) {
            return;
        }
        // Each file of a bag begins with the descriptions of before, under their old stamps.
        let is_repeated = message.publish_time != message.log_time;
        let Some(place) = self.source.bag.place(&description) else {
            // Of this stream nothing but its description was recorded.
            self.outlet.declare_at(Stream::clone(&description), message.log_time);
            return;
        };
        if !is_repeated || self.declared[place].is_none() {
            let stream = self.described(place, &description);
            self.declare(place, stream, message.log_time);
        }
    }

    /// A stream of the bag with its current description. A description without news is placed where the
    /// definition of the type became known.
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

    /// The id of a message's stream, which is declared first where it is new, or where the
    /// definition of its type has become known.
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
        // Just before the message, so that this keeps its log time.
        self.declare(place, stream, message.log_time - Duration::from_nanos(1))
    }

    fn declare(&mut self, place: usize, stream: Stream, at: Time) -> StreamId {
        let id = self.outlet.declare_at(stream.clone(), at);
        self.declared[place] = Some((id, stream));
        id
    }
}

/// The stream with its type as it was known at some moment.
fn with_schema(stream: Stream, schema: Option<&Arc<Schema>>) -> Stream {
    match schema {
        Some(schema) => Stream { shape: Shape::Message(Arc::clone(schema)), ..stream },
        None => stream,
    }
}

impl Unread {
    /// Whether all that was asked for could be read.
    pub fn is_empty(&self) -> bool {
        self.places().is_empty()
    }

    /// Notes damage, and warns of it the first time; other errors end the source.
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
