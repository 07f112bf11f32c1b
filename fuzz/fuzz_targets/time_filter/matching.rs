//! Both policies of matching: any settings, any stamps. Every message is in a set, dropped or waits.

use teampulse_timefilter::matching::{
    ApproximateSettings, ApproximateTime, DropReason, ExactTime, Listener, Message, Set,
    TopicSettings,
};

use crate::bytes::Bytes;

pub fn drive(bytes: &mut Bytes<'_>) {
    let settings = settings(bytes);
    let topics = settings.topics.len();
    let mut approximate = ApproximateTime::new(&settings);
    let queue_size = bytes.below(20);
    let mut exact = ExactTime::new(topics, queue_size);
    let (mut of_approximate, mut of_exact) = (Counts::of(topics), Counts::of(topics));
    let mut pushed = 0;
    while !bytes.is_over() {
        let topic = bytes.below(topics + 1);
        let message = Message { stamp: bytes.time(), payload: pushed };
        approximate.push(topic, message, &mut of_approximate);
        exact.push(topic, message, &mut of_exact);
        pushed += 1;
    }
    let waiting: usize = (0..topics).map(|topic| approximate.waiting(topic)).sum();
    assert_eq!(of_approximate.messages + waiting, pushed);
    let waiting: usize = (0..topics).map(|topic| exact.waiting(topic)).sum();
    assert_eq!(of_exact.messages + waiting, pushed);
    assert!(waiting <= topics * queue_size.max(1));
    for (topic, settings) in settings.topics.iter().enumerate() {
        assert!(approximate.waiting(topic) <= settings.queue_size.max(1));
    }
}

fn settings(bytes: &mut Bytes<'_>) -> ApproximateSettings {
    let topics = bytes.below(10);
    let topic = |bytes: &mut Bytes<'_>| TopicSettings {
        queue_size: bytes.below(20),
        lower_bound_nanos: if bytes.flag() { bytes.time() } else { bytes.nanos() },
    };
    ApproximateSettings {
        topics: (0..topics).map(|_| topic(bytes)).collect(),
        age_penalty: bytes.number(),
        max_interval_nanos: if bytes.flag() { i64::MAX } else { bytes.nanos() },
    }
}

/// The messages that were reported to it.
struct Counts {
    topics: usize,
    messages: usize,
}

impl Counts {
    fn of(topics: usize) -> Counts {
        Counts { topics, messages: 0 }
    }
}

impl Listener<usize> for Counts {
    fn set(&mut self, set: Set<'_, usize>) {
        assert_eq!(set.len(), self.topics);
        self.messages += set.len();
    }

    fn dropped(&mut self, _topic: usize, _message: Message<usize>, _reason: DropReason) {
        self.messages += 1;
    }
}
