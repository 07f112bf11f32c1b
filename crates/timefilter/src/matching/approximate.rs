//! Sets of messages with approximately equal stamps.

use super::age_penalty::AgePenalty;
use super::drops::Drops;
use super::interval::Interval;
use super::queue::Queue;
use super::{DropReason, Listener, Message, Set};

/// The settings of [`ApproximateTime`].
#[derive(Clone, Debug, PartialEq)]
pub struct ApproximateSettings {
    /// The settings of each topic; their number is the number of topics.
    pub topics: Vec<TopicSettings>,
    /// The extra weight of a set's later end against its later start; 0.1 in ROS. Negative and NaN count as
    /// 0.
    pub age_penalty: f64,
    /// The longest interval from a set's oldest to its newest stamp [ns]; unlimited in ROS. Negative counts
    /// as 0. If stamps are out of order, a set may be longer: a search starts within the interval, and
    /// continues to sets that the age penalty makes better.
    pub max_interval_nanos: i64,
}

/// The settings of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicSettings {
    /// The most messages that may be queued; 0 counts as 1, and a queue below 2 drops many.
    pub queue_size: usize,
    /// The minimum time between consecutive stamps [ns], 0 in ROS. A known bound makes sets available sooner,
    /// since no better one can follow; a wrong one may change the sets.
    pub lower_bound_nanos: i64,
}

impl ApproximateSettings {
    /// The settings of ROS for a number of topics, each with a queue of `queue_size`.
    pub fn new(topics: usize, queue_size: usize) -> ApproximateSettings {
        ApproximateSettings {
            topics: vec![TopicSettings { queue_size, lower_bound_nanos: 0 }; topics],
            age_penalty: 0.1,
            max_interval_nanos: i64::MAX,
        }
    }
}

/// The sets of ROS's C++ `message_filters::sync_policies::ApproximateTime`, for any number of topics.
///
/// The newest of the topics' oldest messages is the *pivot*: the next set contains it, unless a queue overflows first.
/// Of all sets around the pivot the shortest is emitted, as soon as no future message can make a shorter one; an older
/// set is preferred to a slightly shorter one ([`ApproximateSettings::age_penalty`]). So there are at most as many sets
/// as the slowest topic has messages, and none while a topic is silent. Sets do not cross: a later set has a later
/// arrival of each topic.
///
/// The sets are identical to those of `message_filters` 1.15.15 for stamps that `ros::Time` can represent.
/// Stamps out of order are not corrected. Memory is bounded by the queue sizes, and nothing is allocated
/// once the queues have grown.
#[derive(Clone, Debug)]
pub struct ApproximateTime<T> {
    age_penalty: AgePenalty,
    max_interval_nanos: i64,
    queues: Vec<Queue<T>>,
    /// The stamp of each topic's oldest message that is not passed over; outdated if there is none.
    heads: Vec<i64>,
    /// The stamp of each topic's next message after that; outdated if there is none.
    seconds: Vec<i64>,
    /// The number of topics with a message that is not passed over.
    ready: usize,
    /// Whether each topic has lost a message that might have been better than its head.
    lossy: Vec<bool>,
    /// Whether any topic has lost such a message.
    is_lossy: bool,
    /// The best set so far: the oldest message of each queue.
    candidate: Option<Candidate>,
    /// The topics of the messages passed over in the search for a better set, in order.
    passed: Vec<usize>,
    ahead: Ahead,
    /// The set that is being emitted.
    set: Vec<Option<Message<T>>>,
    drops: Drops,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    pivot: usize,
    pivot_stamp: i64,
    start: i64,
    end: i64,
}

/// The state of the search ahead: for each topic the next message, or the earliest that can arrive.
#[derive(Clone, Debug)]
struct Ahead {
    stamps: Vec<i64>,
    /// The number of messages beyond each head.
    passed: Vec<usize>,
}

impl<T> ApproximateTime<T> {
    /// Creates a matcher with empty queues.
    pub fn new(settings: &ApproximateSettings) -> ApproximateTime<T> {
        let topics = settings.topics.len();
        ApproximateTime {
            age_penalty: AgePenalty::new(settings.age_penalty),
            max_interval_nanos: settings.max_interval_nanos.max(0),
            queues: settings.topics.iter().map(Queue::new).collect(),
            heads: vec![0; topics],
            seconds: vec![0; topics],
            ready: 0,
            lossy: vec![false; topics],
            is_lossy: false,
            candidate: None,
            passed: Vec::new(),
            ahead: Ahead { stamps: vec![0; topics], passed: vec![0; topics] },
            set: std::iter::repeat_with(|| None).take(topics).collect(),
            drops: Drops::of(topics),
        }
    }

    /// Takes the next message of a topic, in order of arrival, and reports the result to the listener.
    #[inline]
    pub fn push(&mut self, topic: usize, message: Message<T>, listener: &mut impl Listener<T>) {
        let Some(queue) = self.queues.get_mut(topic) else {
            self.drops.add(topic, DropReason::UnknownTopic);
            return listener.dropped(topic, message, DropReason::UnknownTopic);
        };
        let had_head = queue.has_head();
        let stamp = message.stamp;
        queue.push(message);
        self.seconds[topic] = queue.second_stamp();
        if !had_head {
            self.heads[topic] = stamp;
            self.ready += 1;
            if self.is_ready() {
                self.search(listener);
            }
        }
        if self.queues[topic].is_overfull() {
            self.shed(topic, listener);
        }
    }

    /// The number of queued messages of a topic; 0 for an unknown one.
    pub fn waiting(&self, topic: usize) -> usize {
        self.queues.get(topic).map_or(0, Queue::len)
    }

    /// The number of messages of a topic dropped for a reason; unknown topics are counted together.
    pub fn dropped(&self, topic: usize, reason: DropReason) -> u64 {
        self.drops.count(topic, reason)
    }

    /// Whether each topic has a message that is not passed over.
    #[inline]
    fn is_ready(&self) -> bool {
        self.ready == self.queues.len()
    }

    /// Examines successive intervals while there is a message of each topic.
    #[inline]
    fn search(&mut self, listener: &mut impl Listener<T>) {
        let mut interval = Interval::of(&self.heads);
        loop {
            if self.is_lossy {
                self.trust_all_but(interval.last);
            }
            let candidate = match self.candidate {
                Some(best) if !self.is_better(&interval, &best) => best,
                Some(best) => {
                    self.drop_passed(listener);
                    self.adopt(&interval, best.pivot, best.pivot_stamp)
                }
                None => match self.objection(&interval) {
                    None => self.adopt(&interval, interval.last, interval.end),
                    Some(reason) => {
                        self.drop_oldest(interval.first, reason, listener);
                        if !self.is_ready() {
                            return;
                        }
                        interval = interval.without_its_first(&self.heads);
                        continue;
                    }
                },
            };
            self.pass_over(interval.first);
            if interval.first == candidate.pivot
                || self.is_too_late(interval.end, &candidate)
                || !self.is_ready() && self.is_best_to_come(interval, &candidate)
            {
                self.publish(listener);
                if !self.is_ready() {
                    return;
                }
                interval = Interval::of(&self.heads);
            } else if self.is_ready() {
                interval = interval.without_its_first(&self.heads);
            } else {
                return;
            }
        }
    }

    /// Clears the loss flags of all topics but `last`: no lost message could have been better than their
    /// heads.
    fn trust_all_but(&mut self, last: usize) {
        self.is_lossy = self.lossy[last];
        self.lossy.fill(false);
        self.lossy[last] = self.is_lossy;
    }

    /// The reason why no search can start with this interval; `None` if one can.
    #[inline]
    fn objection(&self, interval: &Interval) -> Option<DropReason> {
        if interval.end.saturating_sub(interval.start) > self.max_interval_nanos {
            return Some(DropReason::NoPartner);
        }
        (self.is_lossy && self.lossy[interval.last]).then_some(DropReason::PartnerLost)
    }

    #[inline]
    fn is_better(&self, interval: &Interval, best: &Candidate) -> bool {
        !self.costs(interval.end, best, interval.start.saturating_sub(best.start))
    }

    /// Whether no set that ends at `end` or later can be better, since it must contain the pivot.
    #[inline]
    fn is_too_late(&self, end: i64, best: &Candidate) -> bool {
        self.costs(end, best, best.pivot_stamp.saturating_sub(best.start))
    }

    /// Whether starting later by `gain_nanos` does not make up for ending at `end`.
    #[inline]
    fn costs(&self, end: i64, best: &Candidate, gain_nanos: i64) -> bool {
        self.age_penalty.outweighs(end.saturating_sub(best.end), gain_nanos)
    }

    /// Makes the interval the best set.
    #[inline]
    fn adopt(&mut self, interval: &Interval, pivot: usize, pivot_stamp: i64) -> Candidate {
        let candidate = Candidate { pivot, pivot_stamp, start: interval.start, end: interval.end };
        *self.candidate.insert(candidate)
    }

    /// Drops the messages passed over before a better set was found.
    #[inline]
    fn drop_passed(&mut self, listener: &mut impl Listener<T>) {
        for topic in self.passed.drain(..) {
            if let Some(message) = self.queues[topic].take_oldest() {
                self.drops.add(topic, DropReason::Overtaken);
                listener.dropped(topic, message, DropReason::Overtaken);
            }
        }
    }

    #[inline]
    fn pass_over(&mut self, topic: usize) {
        self.passed.push(topic);
        self.queues[topic].pass_over();
        self.advance(topic);
    }

    /// Whether the candidate stays best for any future messages, which come neither before the pivot nor
    /// sooner after their predecessor than the lower bound. The interval's first topic has no message left.
    fn is_best_to_come(&mut self, mut interval: Interval, best: &Candidate) -> bool {
        let stamps = &mut self.ahead.stamps;
        stamps.copy_from_slice(&self.heads);
        stamps[interval.first] = self.queues[interval.first].stamp_ahead(0, best.pivot_stamp);
        self.ahead.passed.fill(0);
        loop {
            interval = interval.without_its_first(&self.ahead.stamps);
            if self.is_too_late(interval.end, best) {
                return true;
            }
            if self.is_better(&interval, best) {
                return false;
            }
            // Neither holds, so the start is before the pivot and belongs to a message that has arrived.
            let first = interval.first;
            let Ahead { stamps, passed } = &mut self.ahead;
            passed[first] += 1;
            stamps[first] = self.queues[first].stamp_ahead(passed[first], best.pivot_stamp);
        }
    }

    /// Emits the candidate; messages that were passed over become available again.
    #[inline]
    fn publish(&mut self, listener: &mut impl Listener<T>) {
        self.candidate = None;
        for (queue, place) in self.queues.iter_mut().zip(&mut self.set) {
            *place = queue.take_oldest();
        }
        self.rewind();
        listener.set(Set::of(&mut self.set));
    }

    /// Drops the oldest message of a full queue; the search restarts without it.
    fn shed(&mut self, topic: usize, listener: &mut impl Listener<T>) {
        let searching = self.candidate.take().is_some();
        if searching {
            self.rewind();
        }
        self.drop_oldest(topic, DropReason::QueueFull, listener);
        self.lossy[topic] = true;
        self.is_lossy = true;
        if searching && self.is_ready() {
            self.search(listener);
        }
    }

    /// Makes all messages that were passed over available again.
    #[inline]
    fn rewind(&mut self) {
        self.passed.clear();
        self.ready = 0;
        let stamps = self.heads.iter_mut().zip(&mut self.seconds);
        for (queue, (head, second)) in self.queues.iter_mut().zip(stamps) {
            queue.rewind();
            (*head, *second) = (queue.head_stamp(), queue.second_stamp());
            self.ready += usize::from(queue.has_head());
        }
    }

    /// Drops the oldest message of a topic without passed-over messages.
    #[inline]
    fn drop_oldest(&mut self, topic: usize, reason: DropReason, listener: &mut impl Listener<T>) {
        let queue = &mut self.queues[topic];
        if let Some(message) = queue.take_oldest() {
            queue.rewind();
            self.advance(topic);
            self.drops.add(topic, reason);
            listener.dropped(topic, message, reason);
        }
    }

    /// Updates the stamps of a topic whose head has gone.
    #[inline]
    fn advance(&mut self, topic: usize) {
        self.heads[topic] = self.seconds[topic];
        let queue = &self.queues[topic];
        self.seconds[topic] = queue.second_stamp();
        self.ready -= usize::from(!queue.has_head());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;

    /// The stamps of all sets found in messages `(topic, stamp)`.
    fn sets(settings: &ApproximateSettings, messages: &[(usize, i64)]) -> Vec<Vec<i64>> {
        let mut matching = ApproximateTime::new(settings);
        let mut sets = Vec::new();
        for &(topic, stamp) in messages {
            let mut listener = |set: Set<'_, ()>| sets.push(set.map(|m| m.stamp).collect());
            matching.push(topic, Message { stamp, payload: () }, &mut listener);
        }
        sets
    }

    #[test]
    fn a_set_waits_until_nothing_better_can_come() {
        let settings = ApproximateSettings::new(2, 10);
        assert!(sets(&settings, &[(0, 0), (1, 3)]).is_empty());
        assert_eq!(sets(&settings, &[(0, 0), (1, 3), (0, 4)]), [[4, 3]]);
        assert_eq!(sets(&settings, &[(0, 0), (1, 3), (0, 9)]), [[0, 3]]);
    }

    #[test]
    fn a_lower_bound_proves_a_set_sooner() {
        let mut settings = ApproximateSettings::new(2, 10);
        settings.topics[0].lower_bound_nanos = 10;
        assert_eq!(sets(&settings, &[(0, 0), (1, 3)]), [[0, 3]]);
    }

    #[test]
    fn equal_stamps_are_a_set_at_once() {
        let settings = ApproximateSettings::new(3, 10);
        assert_eq!(sets(&settings, &[(2, 5), (0, 5), (1, 5)]), [[5, 5, 5]]);
    }

    #[test]
    fn an_older_set_is_preferred_to_a_slightly_shorter_one() {
        let mut settings = ApproximateSettings::new(2, 10);
        let messages = [(0, 0), (1, 10 * SEC), (0, 20 * SEC - 1), (0, 30 * SEC)];
        assert_eq!(sets(&settings, &messages)[0], [0, 10 * SEC]);
        settings.age_penalty = 0.0;
        assert_eq!(sets(&settings, &messages)[0], [20 * SEC - 1, 10 * SEC]);
    }

    #[test]
    fn a_set_is_never_longer_than_the_longest_interval() {
        let mut settings = ApproximateSettings::new(2, 10);
        settings.max_interval_nanos = 5;
        let messages = [(0, 0), (1, 6), (0, 12), (1, 13), (0, 30), (1, 60)];
        assert_eq!(sets(&settings, &messages), [[12, 13]]);
    }

    #[test]
    fn a_full_queue_drops_its_oldest_and_is_not_trusted_as_pivot() {
        let mut matching = ApproximateTime::new(&ApproximateSettings::new(2, 2));
        let mut listener = |_: Set<'_, ()>| panic!("a set without a proof");
        for (topic, stamp) in [(0, 1), (0, 2), (0, 3), (1, 0)] {
            matching.push(topic, Message { stamp, payload: () }, &mut listener);
        }
        assert_eq!(matching.dropped(0, DropReason::QueueFull), 1);
        assert_eq!(matching.dropped(1, DropReason::PartnerLost), 1);
        assert_eq!((matching.waiting(0), matching.waiting(1)), (2, 0));
    }

    #[test]
    fn sixty_four_topics_make_a_set() {
        let settings = ApproximateSettings::new(64, 2);
        let messages: Vec<(usize, i64)> = (0..64).map(|topic| (topic, 7)).collect();
        assert_eq!(sets(&settings, &messages), [[7; 64]]);
    }
}
