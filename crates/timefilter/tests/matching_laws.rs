//! What holds of matching for any messages.

use proptest::collection::vec;
use proptest::prelude::*;
use teampulse_timefilter::matching::{
    ApproximateSettings, ApproximateTime, DropReason, ExactTime, Listener, Message, Set,
    TopicSettings,
};

/// What became of messages, each known by the number of its arrival.
#[derive(Default)]
struct Outcome {
    sets: Vec<Vec<usize>>,
    dropped: Vec<(usize, usize, DropReason)>,
    waiting: Vec<usize>,
}

impl Listener<usize> for Outcome {
    fn set(&mut self, set: Set<'_, usize>) {
        self.sets.push(set.map(|message| message.payload).collect());
    }

    fn dropped(&mut self, topic: usize, message: Message<usize>, reason: DropReason) {
        self.dropped.push((topic, message.payload, reason));
    }
}

fn approximate(settings: &ApproximateSettings, arrivals: &[(usize, i64)]) -> Outcome {
    let topics = settings.topics.len();
    let mut matching = ApproximateTime::new(settings);
    let mut outcome = Outcome::default();
    for (payload, &(topic, stamp)) in arrivals.iter().enumerate() {
        matching.push(topic, Message { stamp, payload }, &mut outcome);
        for (topic, settings) in settings.topics.iter().enumerate() {
            assert!(matching.waiting(topic) <= settings.queue_size.max(1), "memory is bounded");
        }
    }
    outcome.waiting = (0..topics).map(|topic| matching.waiting(topic)).collect();
    assert_counted(&outcome, topics, |topic, reason| matching.dropped(topic, reason));
    outcome
}

fn exact(topics: usize, queue_size: usize, arrivals: &[(usize, i64)]) -> Outcome {
    let mut matching = ExactTime::new(topics, queue_size);
    let mut outcome = Outcome::default();
    for (payload, &(topic, stamp)) in arrivals.iter().enumerate() {
        matching.push(topic, Message { stamp, payload }, &mut outcome);
        for topic in 0..topics {
            assert!(matching.waiting(topic) <= queue_size.max(1), "memory is bounded");
        }
    }
    outcome.waiting = (0..topics).map(|topic| matching.waiting(topic)).collect();
    assert_counted(&outcome, topics, |topic, reason| matching.dropped(topic, reason));
    outcome
}

/// Drops are counted as they are reported, by topic and reason.
fn assert_counted(outcome: &Outcome, topics: usize, count: impl Fn(usize, DropReason) -> u64) {
    for topic in 0..=topics {
        for reason in DropReason::ALL {
            let is_it = |drop: &&(usize, usize, DropReason)| {
                drop.0.min(topics) == topic && drop.2 == reason
            };
            let reported = outcome.dropped.iter().filter(is_it).count();
            assert_eq!(count(topic, reason), reported as u64, "topic {topic}, {reason}");
        }
    }
}

/// A message is in one set, or dropped once, or waits; and a set has one of each topic.
fn assert_accounted(outcome: &Outcome, topics: usize, arrivals: &[(usize, i64)]) {
    let mut seen = vec![0; arrivals.len()];
    for set in &outcome.sets {
        let of: Vec<usize> = set.iter().map(|&message| arrivals[message].0).collect();
        assert!(of.iter().copied().eq(0..topics), "a set of topics {of:?}");
        for &message in set {
            seen[message] += 1;
        }
    }
    for &(topic, message, reason) in &outcome.dropped {
        assert_eq!(arrivals[message].0, topic);
        assert_eq!(reason == DropReason::UnknownTopic, topic >= topics);
        seen[message] += 1;
    }
    assert!(seen.iter().all(|&times| times <= 1), "a message has two fates");
    for topic in 0..topics {
        let unseen =
            |(message, arrival): &(usize, &(usize, i64))| arrival.0 == topic && seen[*message] == 0;
        let waiting = arrivals.iter().enumerate().filter(unseen).count();
        assert_eq!(waiting, outcome.waiting[topic], "messages of topic {topic} got lost");
    }
}

/// Of each topic, a later set has a later arrival.
fn assert_uncrossed(sets: &[Vec<usize>]) {
    for pair in sets.windows(2) {
        assert!(pair[0].iter().zip(&pair[1]).all(|(earlier, later)| earlier < later));
    }
}

fn any_stamp() -> impl Strategy<Value = i64> {
    prop_oneof![
        8 => 0..200_i64,
        2 => any::<i64>(),
        1 => prop_oneof![Just(i64::MIN), Just(i64::MAX), Just(0), Just(-1)],
    ]
}

fn any_arrivals(topics: usize) -> impl Strategy<Value = Vec<(usize, i64)>> {
    let topic = prop_oneof![40 => 0..topics.max(1), 1 => topics..topics + 2, 1 => Just(usize::MAX)];
    vec((topic, any_stamp()), 0..300)
}

fn any_settings() -> impl Strategy<Value = ApproximateSettings> {
    let lower_bound = prop_oneof![3 => Just(0), 3 => 0..20_i64, 1 => any::<i64>()];
    let topic = (0..12_usize, lower_bound).prop_map(|(queue_size, lower_bound_nanos)| {
        TopicSettings { queue_size, lower_bound_nanos }
    });
    let penalty = prop_oneof![4 => 0.0..1.0, 1 => any::<f64>()];
    let interval = prop_oneof![2 => Just(i64::MAX), 2 => 0..100_i64, 1 => any::<i64>()];
    (vec(topic, 0..6), penalty, interval).prop_map(|(topics, age_penalty, max_interval_nanos)| {
        ApproximateSettings { topics, age_penalty, max_interval_nanos }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn every_message_is_in_a_set_or_dropped_for_a_reason_or_waits(
        (settings, arrivals) in any_settings()
            .prop_flat_map(|settings| (any_arrivals(settings.topics.len()), Just(settings)))
            .prop_map(|(arrivals, settings)| (settings, arrivals)),
    ) {
        let outcome = approximate(&settings, &arrivals);
        assert_accounted(&outcome, settings.topics.len(), &arrivals);
        assert_uncrossed(&outcome.sets);
    }

    #[test]
    fn every_message_of_an_exact_set_is_accounted_for_too(
        (topics, arrivals) in (0..5_usize)
            .prop_flat_map(|topics| (Just(topics), any_arrivals(topics))),
        queue_size in 0..12_usize,
    ) {
        let outcome = exact(topics, queue_size, &arrivals);
        assert_accounted(&outcome, topics, &arrivals);
        for set in &outcome.sets {
            prop_assert!(set.iter().all(|&message| arrivals[message].1 == arrivals[set[0]].1));
        }
    }

    #[test]
    fn no_set_is_longer_than_the_longest_interval(
        arrivals in any_arrivals(3),
        max_interval_nanos in 0..100_i64,
    ) {
        let mut sorted = arrivals;
        sorted.sort_by_key(|arrival| arrival.1);
        let settings =
            ApproximateSettings { max_interval_nanos, ..ApproximateSettings::new(3, 10) };
        for set in approximate(&settings, &sorted).sets {
            let stamps = || set.iter().map(|&message| sorted[message].1);
            let length = stamps().max().unwrap().saturating_sub(stamps().min().unwrap());
            prop_assert!(length <= max_interval_nanos);
        }
    }

    #[test]
    fn many_topics_are_matched_as_few_are(period_nanos in 2..1_000_i64, sets in 1..5_usize) {
        let settings = ApproximateSettings::new(100, 3);
        let arrivals: Vec<(usize, i64)> = (0..=sets)
            .flat_map(|set| (0..100).map(move |topic| (topic, set as i64 * period_nanos)))
            .collect();
        let outcome = approximate(&settings, &arrivals);
        prop_assert_eq!(outcome.sets.len(), sets + 1);
        prop_assert!(outcome.dropped.is_empty());
    }
}
