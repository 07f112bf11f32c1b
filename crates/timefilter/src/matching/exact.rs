//! Sets of messages with equal stamps.

use std::collections::VecDeque;

use super::drops::Drops;
use super::{DropReason, Listener, Message, Set};

/// The sets of ROS's C++ `message_filters::sync_policies::ExactTime`, for any number of topics.
///
/// A set is emitted as soon as all topics have a message with its stamp; all older messages are dropped
/// with it. Memory is bounded by the queue size, and nothing is allocated once the queue has been full.
#[derive(Clone, Debug)]
pub struct ExactTime<T> {
    topics: usize,
    queue_size: usize,
    /// The queued messages: rows with a slot for each topic.
    messages: Vec<Option<Message<T>>>,
    /// The stamp and occupancy of each row.
    rows: Vec<Row>,
    free_rows: Vec<usize>,
    /// The queued rows, oldest stamp first.
    waiting: VecDeque<Waiting>,
    /// The row where a stamp was last found, by its [`shelf`].
    recent: [usize; 1 << SHELF_BITS],
    drops: Drops,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    stamp: i64,
    /// The number of topics without a message of this stamp; all of them in a free row.
    missing: usize,
}

#[derive(Clone, Copy, Debug)]
struct Waiting {
    stamp: i64,
    row: usize,
}

const SHELF_BITS: u32 = 6;

/// The cache index of a stamp; stamps at regular intervals are spread well.
#[inline]
fn shelf(stamp: i64) -> usize {
    (stamp.wrapping_mul(0x9e37_79b9_7f4a_7c15_u64.cast_signed()).cast_unsigned()
        >> (u64::BITS - SHELF_BITS)) as usize
}

impl<T> ExactTime<T> {
    /// Creates a matcher with an empty queue. `queue_size` is the most stamps that may wait for messages; 0
    /// counts as 1 (in ROS it means no limit).
    pub fn new(topics: usize, queue_size: usize) -> ExactTime<T> {
        ExactTime {
            topics,
            queue_size: queue_size.max(1),
            messages: Vec::new(),
            rows: Vec::new(),
            free_rows: Vec::new(),
            waiting: VecDeque::new(),
            recent: [0; 1 << SHELF_BITS],
            drops: Drops::of(topics),
        }
    }

    /// Takes the next message of a topic, in order of arrival, and reports the result to the listener.
    #[inline]
    pub fn push(&mut self, topic: usize, message: Message<T>, listener: &mut impl Listener<T>) {
        if topic >= self.topics {
            self.drops.add(topic, DropReason::UnknownTopic);
            return listener.dropped(topic, message, DropReason::UnknownTopic);
        }
        let row = self.row_of(message.stamp);
        let place = &mut self.messages[row * self.topics + topic];
        if let Some(message) = place.replace(message) {
            self.drops.add(topic, DropReason::Replaced);
            return listener.dropped(topic, message, DropReason::Replaced);
        }
        self.rows[row].missing -= 1;
        if self.rows[row].missing == 0 {
            self.publish(row, listener);
        } else if self.waiting.len() > self.queue_size {
            self.drop_oldest(DropReason::QueueFull, listener);
        }
    }

    /// The number of queued messages of a topic; 0 for an unknown one.
    pub fn waiting(&self, topic: usize) -> usize {
        let is_here = |waiting: &&Waiting| {
            topic < self.topics && self.messages[waiting.row * self.topics + topic].is_some()
        };
        self.waiting.iter().filter(is_here).count()
    }

    /// The number of messages of a topic dropped for a reason; unknown topics are counted together.
    pub fn dropped(&self, topic: usize, reason: DropReason) -> u64 {
        self.drops.count(topic, reason)
    }

    /// The row of a stamp; a new one if there is none.
    #[inline]
    fn row_of(&mut self, stamp: i64) -> usize {
        let shelf = shelf(stamp);
        let row = self.recent[shelf];
        match self.rows.get(row) {
            Some(there) if there.stamp == stamp && there.missing < self.topics => row,
            _ => {
                let row = self.find_or_begin(stamp);
                self.recent[shelf] = row;
                row
            }
        }
    }

    #[inline]
    fn find_or_begin(&mut self, stamp: i64) -> usize {
        if self.waiting.back().is_none_or(|newest| newest.stamp < stamp) {
            let row = self.begin(stamp);
            self.waiting.push_back(Waiting { stamp, row });
            return row;
        }
        match self.waiting.binary_search_by_key(&stamp, |waiting| waiting.stamp) {
            Ok(place) => self.waiting[place].row,
            Err(place) => {
                let row = self.begin(stamp);
                self.waiting.insert(place, Waiting { stamp, row });
                row
            }
        }
    }

    /// Takes a free row for a stamp.
    #[inline]
    fn begin(&mut self, stamp: i64) -> usize {
        let row = self.free_rows.pop().unwrap_or_else(|| self.add_row());
        self.rows[row].stamp = stamp;
        row
    }

    #[cold]
    fn add_row(&mut self) -> usize {
        let row = self.rows.len();
        self.rows.push(Row { stamp: 0, missing: self.topics });
        self.messages.resize_with(self.messages.len() + self.topics, || None);
        row
    }

    #[inline]
    fn free(&mut self, row: usize) {
        self.rows[row].missing = self.topics;
        self.free_rows.push(row);
    }

    /// Emits a complete set, and drops all older ones.
    #[inline]
    fn publish(&mut self, row: usize, listener: &mut impl Listener<T>) {
        self.free(row);
        listener.set(Set::of(&mut self.messages[row * self.topics..][..self.topics]));
        while let Some(oldest) = self.waiting.pop_front()
            && oldest.row != row
        {
            self.drop_row(oldest.row, DropReason::Overtaken, listener);
        }
    }

    fn drop_oldest(&mut self, reason: DropReason, listener: &mut impl Listener<T>) {
        if let Some(oldest) = self.waiting.pop_front() {
            self.drop_row(oldest.row, reason, listener);
        }
    }

    fn drop_row(&mut self, row: usize, reason: DropReason, listener: &mut impl Listener<T>) {
        self.free(row);
        for topic in 0..self.topics {
            if let Some(message) = self.messages[row * self.topics + topic].take() {
                self.drops.add(topic, reason);
                listener.dropped(topic, message, reason);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stamps of all sets found in messages `(topic, stamp)`.
    fn sets(matching: &mut ExactTime<()>, messages: &[(usize, i64)]) -> Vec<i64> {
        let mut stamps = Vec::new();
        for &(topic, stamp) in messages {
            let mut listener = |mut set: Set<'_, ()>| stamps.extend(set.next().map(|m| m.stamp));
            matching.push(topic, Message { stamp, payload: () }, &mut listener);
        }
        stamps
    }

    #[test]
    fn a_set_is_out_when_all_have_its_stamp() {
        let mut matching = ExactTime::new(3, 10);
        assert_eq!(sets(&mut matching, &[(0, 1), (2, 1), (0, 2), (1, 1), (1, 2), (2, 2)]), [1, 2]);
    }

    #[test]
    fn a_set_drops_what_is_older() {
        let mut matching = ExactTime::new(2, 10);
        assert_eq!(sets(&mut matching, &[(0, 1), (1, 2), (0, 3), (1, 3), (1, 1)]), [3]);
        assert_eq!(matching.dropped(0, DropReason::Overtaken), 1);
        assert_eq!(matching.dropped(1, DropReason::Overtaken), 1);
        assert_eq!((matching.waiting(0), matching.waiting(1)), (0, 1));
    }

    #[test]
    fn a_full_queue_drops_the_oldest_stamp() {
        let mut matching = ExactTime::new(2, 2);
        assert_eq!(sets(&mut matching, &[(0, 1), (1, 2), (0, 3), (1, 1), (0, 2)]), [2]);
        assert_eq!(matching.dropped(0, DropReason::QueueFull), 1);
        assert_eq!(matching.dropped(1, DropReason::QueueFull), 1);
    }

    #[test]
    fn the_last_of_equal_messages_counts() {
        let mut matching = ExactTime::new(2, 2);
        assert_eq!(sets(&mut matching, &[(0, 1), (0, 1), (1, 1)]), [1]);
        assert_eq!(matching.dropped(0, DropReason::Replaced), 1);
    }
}
