//! The queue of one topic's messages.

use super::{Message, TopicSettings};

/// A ring buffer of messages; some of the oldest may be passed over.
///
/// Positions count all messages of the topic, so that a message keeps its position; they wrap around.
#[derive(Clone, Debug)]
pub(super) struct Queue<T> {
    settings: TopicSettings,
    /// As many entries as there are payloads: a power of two.
    stamps: Vec<i64>,
    payloads: Vec<Option<T>>,
    /// The position of the oldest message.
    oldest: usize,
    /// The position of the oldest message that is not passed over.
    head: usize,
    /// The position of the next message to arrive.
    next: usize,
}

/// The initial size of the ring.
const SMALLEST: usize = 16;

impl<T> Queue<T> {
    pub fn new(settings: &TopicSettings) -> Queue<T> {
        Queue {
            settings: TopicSettings {
                queue_size: settings.queue_size.max(1),
                lower_bound_nanos: settings.lower_bound_nanos.max(0),
            },
            stamps: vec![0; SMALLEST],
            payloads: std::iter::repeat_with(|| None).take(SMALLEST).collect(),
            oldest: 0,
            head: 0,
            next: 0,
        }
    }

    #[inline]
    pub fn len(&self) -> usize {
        self.next.wrapping_sub(self.oldest)
    }

    #[inline]
    pub fn is_overfull(&self) -> bool {
        self.len() > self.settings.queue_size
    }

    #[inline]
    pub fn push(&mut self, message: Message<T>) {
        if self.len() == self.stamps.len() {
            self.grow();
        }
        let slot = self.slot(self.next);
        self.stamps[slot] = message.stamp;
        self.payloads[slot] = Some(message.payload);
        self.next = self.next.wrapping_add(1);
    }

    /// Removes the oldest message.
    #[inline]
    pub fn take_oldest(&mut self) -> Option<Message<T>> {
        let slot = self.slot(self.oldest);
        let payload = self.payloads[slot].take()?;
        self.oldest = self.oldest.wrapping_add(1);
        Some(Message { stamp: self.stamps[slot], payload })
    }

    #[inline]
    pub fn has_head(&self) -> bool {
        self.head != self.next
    }

    /// The stamp of the oldest message that is not passed over; any value if there is none.
    #[inline]
    pub fn head_stamp(&self) -> i64 {
        self.stamps[self.slot(self.head)]
    }

    /// The stamp of the message after the head; any value if there is none.
    #[inline]
    pub fn second_stamp(&self) -> i64 {
        self.stamps[self.slot(self.head.wrapping_add(1))]
    }

    #[inline]
    pub fn pass_over(&mut self) {
        self.head = self.head.wrapping_add(1);
    }

    /// Makes all messages that were passed over available again.
    #[inline]
    pub fn rewind(&mut self) {
        self.head = self.oldest;
    }

    /// The stamp of the message `passed` after the head, or the earliest that can arrive there.
    #[inline]
    pub fn stamp_ahead(&self, passed: usize, pivot_stamp: i64) -> i64 {
        let place = self.head.wrapping_add(passed);
        if place != self.next {
            return self.stamps[self.slot(place)];
        }
        let newest = match self.len() {
            0 => pivot_stamp,
            _ => self.stamps[self.slot(self.next.wrapping_sub(1))],
        };
        newest.saturating_add(self.settings.lower_bound_nanos).max(pivot_stamp)
    }

    #[inline]
    fn slot(&self, place: usize) -> usize {
        place & (self.stamps.len() - 1)
    }

    #[cold]
    fn grow(&mut self) {
        let places = self.stamps.len();
        let oldest = self.slot(self.oldest);
        self.stamps.rotate_left(oldest);
        self.payloads.rotate_left(oldest);
        self.stamps.resize(2 * places, 0);
        self.payloads.resize_with(2 * places, || None);
        self.head = self.head.wrapping_sub(self.oldest);
        self.next = self.next.wrapping_sub(self.oldest);
        self.oldest = 0;
    }
}
