//! Sets of messages with equal stamps.

use std::collections::VecDeque;

use super::drops::Drops;
use super::{DropReason, Listener, Message};

/// The sets of ROS's C++ `message_filters::sync_policies::ExactTime`, for any number of topics.
///
/// A set is given out as soon as all topics have a message with its stamp; whatever is older is
/// dropped with it. Memory is bounded by the queue size, and nothing is allocated once the queue
/// has been full.
#[derive(Clone, Debug)]
pub struct ExactTime<T> {
    topics: usize,
    queue_size: usize,
    /// The sets that wait for messages, oldest stamp first.
    incomplete: VecDeque<Incomplete>,
    /// Their payloads: rows with a place for each topic.
    payloads: Vec<Option<T>>,
    free_rows: Vec<usize>,
    /// The set that is given out.
    set: Vec<Message<T>>,
    drops: Drops,
}

#[derive(Clone, Copy, Debug)]
struct Incomplete {
    stamp: i64,
    row: usize,
    missing: usize,
}

impl<T> ExactTime<T> {
    /// Nothing waits. `queue_size` is how many stamps may wait for messages; 0 counts as 1 (ROS has
    /// no bound then).
    pub fn new(topics: usize, queue_size: usize) -> ExactTime<T> {
        ExactTime {
            topics,
            queue_size: queue_size.max(1),
            incomplete: VecDeque::new(),
            payloads: Vec::new(),
            free_rows: Vec::new(),
            set: Vec::with_capacity(topics),
            drops: Drops::of(topics),
        }
    }

    /// Takes the next message of a topic, in order of arrival, and reports the result to the listener.
    pub fn push(&mut self, topic: usize, message: Message<T>, listener: &mut impl Listener<T>) {
        if topic >= self.topics {
            self.drops.add(topic, DropReason::UnknownTopic);
            return listener.dropped(topic, message, DropReason::UnknownTopic);
        }
        let Message { stamp, payload } = message;
        let place = self.place_of(stamp);
        let incomplete = &mut self.incomplete[place];
        match self.payloads[incomplete.row * self.topics + topic].replace(payload) {
            Some(payload) => {
                self.drops.add(topic, DropReason::Replaced);
                listener.dropped(topic, Message { stamp, payload }, DropReason::Replaced);
            }
            None => incomplete.missing -= 1,
        }
        if incomplete.missing == 0 {
            self.publish(place, listener);
        }
        if self.incomplete.len() > self.queue_size {
            self.drop_oldest(DropReason::QueueFull, listener);
        }
    }

    /// How many messages of a topic wait for a set; 0 for an unknown one.
    pub fn waiting(&self, topic: usize) -> usize {
        let is_here = |set: &&Incomplete| {
            topic < self.topics && self.payloads[set.row * self.topics + topic].is_some()
        };
        self.incomplete.iter().filter(is_here).count()
    }

    /// How many messages of a topic were dropped for a reason; unknown topics are counted together.
    pub fn dropped(&self, topic: usize, reason: DropReason) -> u64 {
        self.drops.count(topic, reason)
    }

    /// The place of the stamp's set, which begins if there is none.
    fn place_of(&mut self, stamp: i64) -> usize {
        match self.incomplete.binary_search_by_key(&stamp, |set| set.stamp) {
            Ok(place) => place,
            Err(place) => {
                let row = self.free_row();
                self.incomplete.insert(place, Incomplete { stamp, row, missing: self.topics });
                place
            }
        }
    }

    fn free_row(&mut self) -> usize {
        self.free_rows.pop().unwrap_or_else(|| {
            let row = self.payloads.len() / self.topics;
            self.payloads.resize_with(self.payloads.len() + self.topics, || None);
            row
        })
    }

    /// Gives a complete set out, and drops all older ones.
    fn publish(&mut self, place: usize, listener: &mut impl Listener<T>) {
        if let Some(Incomplete { stamp, row, .. }) = self.incomplete.remove(place) {
            let payloads = &mut self.payloads[row * self.topics..][..self.topics];
            let payloads = payloads.iter_mut().filter_map(Option::take);
            self.set.extend(payloads.map(|payload| Message { stamp, payload }));
            self.free_rows.push(row);
            listener.set(self.set.drain(..));
        }
        for _ in 0..place {
            self.drop_oldest(DropReason::Overtaken, listener);
        }
    }

    fn drop_oldest(&mut self, reason: DropReason, listener: &mut impl Listener<T>) {
        let Some(Incomplete { stamp, row, .. }) = self.incomplete.pop_front() else { return };
        self.free_rows.push(row);
        for topic in 0..self.topics {
            if let Some(payload) = self.payloads[row * self.topics + topic].take() {
                self.drops.add(topic, reason);
                listener.dropped(topic, Message { stamp, payload }, reason);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::Set;

    /// The stamps of all sets that come of messages `(topic, stamp)`.
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
