//! The messages of a bag in order, across all its files.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use bytes::Bytes;
use mcap::McapError;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;

use crate::error::BagError;
use crate::read::Bag;
use crate::read::block::{Block, Contents, Entry};
use crate::read::index::Index;
use crate::read::records::LIMIT_BYTES;
use crate::write::part::nanos;

/// The most bytes of chunks that may be open at the same time because they overlap in time.
const OPEN_BYTES: u64 = 4 * LIMIT_BYTES;

/// A recorded message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The index of the message's stream in [`Bag::streams`].
    pub stream: usize,
    /// When the message was received.
    pub log_time: Time,
    /// When the message was published; the log time if that is unknown.
    pub publish_time: Time,
    /// The message's type, as known at the time of recording.
    pub schema: Arc<Schema>,
    /// The message's sequence number.
    pub sequence: u32,
    /// The payload: CDR with its four-byte header.
    pub cdr: Bytes,
}

/// The messages of a bag by log time; messages with equal times are in file order, one file after the other.
///
/// An unreadable chunk yields one error and is skipped. Only chunks that overlap in time are in memory
/// together.
#[derive(Debug)]
pub struct Messages<'a> {
    bag: &'a Bag,
    from: u64,
    /// Blocks that are not open yet, the last one first.
    closed: Vec<Place>,
    open: BTreeMap<(usize, u64), Cursor>,
    open_bytes: u64,
    /// The next message of each open block.
    heads: BinaryHeap<Reverse<Head>>,
}

/// A block of a file.
#[derive(Clone, Copy, Debug)]
struct Place {
    part: usize,
    block: Block,
}

/// An open block and the read position in it.
#[derive(Debug)]
struct Cursor {
    contents: Contents,
    next: usize,
}

/// The sort key of the next message of an open block: by time, then by position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Head {
    log_time: u64,
    part: usize,
    offset: u64,
}

impl<'a> Messages<'a> {
    pub(crate) fn new(bag: &'a Bag, from: Option<Time>) -> Messages<'a> {
        let from = from.map_or(0, nanos);
        let places = bag.parts().iter().enumerate().flat_map(|(part, index)| {
            index.blocks.iter().map(move |block| Place { part, block: *block })
        });
        let mut closed: Vec<Place> = places.filter(|place| place.block.last >= from).collect();
        closed.sort_by_key(|place| Reverse((place.block.first, place.part, place.block.offset)));
        let heads = BinaryHeap::new();
        Messages { bag, from, closed, open: BTreeMap::new(), open_bytes: 0, heads }
    }

    /// The next closed block, if it may contain messages that are earlier than those of the open blocks.
    fn due(&mut self) -> Option<Place> {
        let next = self.closed.last()?;
        let is_due =
            self.heads.peek().is_none_or(|Reverse(head)| next.block.first <= head.log_time);
        if is_due { self.closed.pop() } else { None }
    }

    fn open(&mut self, place: Place) -> Result<(), BagError> {
        let index = &self.bag.parts()[place.part];
        let contents =
            place.block.load(&index.file).map_err(|error| damaged(index, place, &error))?;
        let next = contents.entries.partition_point(|entry| entry.log_time < self.from);
        let Some(first) = contents.entries.get(next) else { return Ok(()) };
        let bytes = contents.records.len() as u64;
        if self.open_bytes + bytes > OPEN_BYTES {
            return Err(damaged(index, place, &McapError::ChunkTooLarge(self.open_bytes + bytes)));
        }
        self.open_bytes += bytes;
        let (part, offset) = (place.part, place.block.offset);
        self.heads.push(Reverse(Head { log_time: first.log_time, part, offset }));
        self.open.insert((part, offset), Cursor { contents, next });
        Ok(())
    }

    /// Takes the message that a head refers to, and advances its block.
    fn take(&mut self, head: Head) -> Option<(Entry, Bytes)> {
        let key = (head.part, head.offset);
        let cursor = self.open.get_mut(&key)?;
        let entry = *cursor.contents.entries.get(cursor.next)?;
        let cdr = cursor.contents.records.slice(entry.start..entry.end);
        cursor.next += 1;
        if let Some(next) = cursor.contents.entries.get(cursor.next) {
            self.heads.push(Reverse(Head { log_time: next.log_time, ..head }));
        } else if let Some(done) = self.open.remove(&key) {
            self.open_bytes -= done.contents.records.len() as u64;
        }
        Some((entry, cdr))
    }

    fn message(&mut self, head: Head) -> Option<Result<Message, BagError>> {
        let (entry, cdr) = self.take(head)?;
        let Some(carried) = self.bag.carried(head.part, entry.channel) else {
            let reason = format!("a message of channel {}, which is not declared", entry.channel);
            let path = self.bag.parts()[head.part].path.clone();
            return Some(Err(BagError::Damaged { path, offset: head.offset, reason }));
        };
        Some(Ok(Message {
            stream: carried.stream,
            schema: Arc::clone(&carried.schema),
            log_time: Time::from_nanos(entry.log_time as i64),
            publish_time: Time::from_nanos(entry.publish_time as i64),
            sequence: entry.sequence,
            cdr,
        }))
    }
}

impl Iterator for Messages<'_> {
    type Item = Result<Message, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        while let Some(place) = self.due() {
            if let Err(error) = self.open(place) {
                return Some(Err(error));
            }
        }
        let Reverse(head) = self.heads.pop()?;
        self.message(head)
    }
}

fn damaged(index: &Index, place: Place, error: &McapError) -> BagError {
    BagError::Damaged {
        path: index.path.clone(),
        offset: place.block.offset,
        reason: error.to_string(),
    }
}
