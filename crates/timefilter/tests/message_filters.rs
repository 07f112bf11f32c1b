//! Matching makes the sets of ROS's C++ `message_filters`.
//!
//! The expected hashes are what Debian's `libmessage-filters-dev` 1.15.15 gave. To have them again:
//! these tests leave the messages of each case in `target/tmp`, and
//! `bench/timefilter/message_filters.cpp` (built as `measure_matching` does it) is called with what
//! the file `calls` beside them says.

use std::fmt::Write as _;

use teampulse_timefilter::matching::{
    ApproximateSettings, ApproximateTime, ExactTime, Listener, Message, Set,
};

const MESSAGES: usize = 20_000;
const BEGIN: i64 = 1_700_000_000_000_000_000;
const MILLI: i64 = 1_000_000;

/// A name, how to match, the queue size, what arrives, and the hash and number of the sets.
struct Case(&'static str, Policy, usize, Input, (u64, u64));

#[derive(Clone, Copy)]
enum Policy {
    Approximate { age_penalty: f64, max_interval_millis: i64, lower_bounds_millis: &'static [i64] },
    Exact,
}

use Policy::Exact;

/// The period of each topic [ms]; how late stamps are at most [ms], in no order where that is longer
/// than the period; what they are whole multiples of [ns]; and how many messages get lost [%].
struct Input(&'static [i64], i64, i64, u64);

const DEFAULT: Policy = approximate(0.1, 0, &[]);
const MIXED: &[i64] = &[8, 16, 250, 33, 100];
const NINE: &[i64] = &[2, 4, 8, 16, 250, 33, 33, 100, 1000];

#[rustfmt::skip]
const CASES: &[Case] = &[
    Case("two_equal", DEFAULT, 10, Input(&[10; 2], 4, 1, 0), (0xfdc4_64ca_32d9_7162, 9_999)),
    Case("two_with_losses", DEFAULT, 10, Input(&[10; 2], 4, 1, 20), (0x59e9_c989_cf03_2788, 8_428)),
    Case("two_mixed", DEFAULT, 100, Input(&[8, 33], 2, 1, 0), (0x251f_bc52_285b_e7f0, 3_903)),
    Case("two_out_of_order", DEFAULT, 20, Input(&[10; 2], 45, 1, 5), (0x1eaa_9633_8fc9_fbb3, 6_282)),
    Case("two_with_equal_stamps", DEFAULT, 10, Input(&[10; 2], 30, 5 * MILLI, 5), (0xe5b7_35af_952c_9aad, 7_121)),
    Case("two_with_queues_of_one", DEFAULT, 1, Input(&[10, 30], 9, 1, 0), (0x9df7_aca1_3308_eb14, 3_036)),
    Case("three_with_a_silent_gap", DEFAULT, 5, Input(&[10, 20, 700], 5, 1, 30), (0xbf04_5270_f914_6509, 200)),
    Case("five_equal", DEFAULT, 10, Input(&[33; 5], 20, 1, 0), (0xbfe1_8b3b_0c54_444c, 3_991)),
    Case("five_mixed_in_short_queues", DEFAULT, 10, Input(MIXED, 5, 1, 0), (0x9929_63f8_8202_3bbf, 332)),
    Case("five_mixed_in_long_queues", DEFAULT, 200, Input(MIXED, 5, 1, 0), (0xd622_c941_7d7d_08ea, 345)),
    Case("five_mixed_out_of_order", DEFAULT, 100, Input(MIXED, 60, MILLI, 10), (0xf58b_35d0_4cd1_0d9f, 349)),
    Case("five_with_no_age_penalty", approximate(0.0, 0, &[]), 200, Input(MIXED, 20, 1, 5), (0x1e57_b4e6_44f5_4adb, 350)),
    Case("five_with_an_age_penalty_of_one_third", approximate(0.333, 0, &[]), 100, Input(MIXED, 20, 1, 5), (0xbaa2_9adb_188f_2a73, 350)),
    Case("five_of_at_most_10_ms", approximate(0.1, 10, &[]), 200, Input(MIXED, 5, 1, 5), (0x202d_2249_1225_2dca, 61)),
    Case("five_with_lower_bounds", approximate(0.1, 0, &[7, 14, 240, 30, 90]), 200, Input(MIXED, 2, 1, 0), (0x1d98_eded_a181_4856, 345)),
    Case("five_with_wrong_lower_bounds", approximate(0.1, 0, &[20, 20, 20, 20, 20]), 50, Input(MIXED, 40, 1, 5), (0xa84d_24c1_bc17_c505, 350)),
    Case("five_with_everything", approximate(0.5, 40, &[5, 5, 5, 5, 5]), 20, Input(&[20; 5], 25, MILLI, 10), (0x4472_cf9d_2e61_68af, 2_761)),
    Case("nine_equal", DEFAULT, 10, Input(&[33; 9], 30, 1, 0), (0x567d_32fe_89a8_f43a, 1_847)),
    Case("nine_mixed_in_short_queues", DEFAULT, 100, Input(NINE, 5, 1, 0), (0xa6a3_6c7c_f9a6_4c0d, 13)),
    Case("nine_mixed_in_long_queues", DEFAULT, 1000, Input(NINE, 5, 1, 0), (0x7d82_8793_5787_e0b8, 20)),
    Case("nine_out_of_order", DEFAULT, 60, Input(&[20; 9], 70, MILLI, 15), (0xd20b_3f18_b874_1597, 947)),
    Case("exact_two", Exact, 10, Input(&[10; 2], 12, 4 * MILLI, 5), (0xd9a4_20d3_45b6_b92d, 3_465)),
    Case("exact_five_out_of_order", Exact, 20, Input(&[20; 5], 60, 20 * MILLI, 20), (0xa023_5be3_2a72_32ad, 394)),
    Case("exact_nine", Exact, 50, Input(&[20; 9], 5, 20 * MILLI, 3), (0x813d_0f14_3afa_a59f, 1_737)),
];

const fn approximate(
    age_penalty: f64,
    max_interval_millis: i64,
    lower_bounds_millis: &'static [i64],
) -> Policy {
    Policy::Approximate { age_penalty, max_interval_millis, lower_bounds_millis }
}

/// Steele, Lea and Flood's `SplitMix64`.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}

impl Input {
    /// The topic and stamp of each message, in order of arrival.
    fn arrivals(&self) -> Vec<(usize, i64)> {
        let Input(periods_millis, jitter_millis, grain, loss_percent) = *self;
        let mut random = Random(1);
        let mut arrivals = Vec::new();
        let mut due: Vec<i64> = (0..periods_millis.len() as i64).map(|k| k * MILLI).collect();
        while arrivals.len() < MESSAGES {
            let topic = (0..due.len()).min_by_key(|&topic| due[topic]).expect("there are topics");
            let jitter = random.below((jitter_millis * MILLI) as u64 + 1) as i64;
            let stamp = (BEGIN + due[topic] + jitter) / grain * grain;
            due[topic] += periods_millis[topic] * MILLI;
            if random.below(100) >= loss_percent {
                arrivals.push((topic, stamp));
            }
        }
        arrivals
    }
}

impl Case {
    fn digest(&self) -> Digest {
        let Case(_, policy, queue_size, ref input, _) = *self;
        let topics = input.0.len();
        let mut digest = Digest { hash: 14_695_981_039_346_656_037, sets: 0 };
        match policy {
            Policy::Approximate { age_penalty, max_interval_millis, lower_bounds_millis } => {
                let mut settings = ApproximateSettings::new(topics, queue_size);
                settings.age_penalty = age_penalty;
                if max_interval_millis > 0 {
                    settings.max_interval_nanos = max_interval_millis * MILLI;
                }
                for (topic, bound) in settings.topics.iter_mut().zip(lower_bounds_millis) {
                    topic.lower_bound_nanos = bound * MILLI;
                }
                let mut matching = ApproximateTime::new(&settings);
                for (topic, stamp) in input.arrivals() {
                    matching.push(topic, Message { stamp, payload: () }, &mut digest);
                }
            }
            Exact => {
                let mut matching = ExactTime::new(topics, queue_size);
                for (topic, stamp) in input.arrivals() {
                    matching.push(topic, Message { stamp, payload: () }, &mut digest);
                }
            }
        }
        digest
    }

    /// What `message_filters.cpp` is to be called with.
    fn arguments(&self) -> String {
        let Case(_, policy, queue_size, ref input, _) = *self;
        let topics = input.0.len();
        match policy {
            Policy::Approximate { age_penalty, max_interval_millis, lower_bounds_millis } => {
                let max_interval = max_interval_millis * MILLI;
                let mut arguments =
                    format!("approximate {topics} {queue_size} {age_penalty} {max_interval}");
                for bound in lower_bounds_millis {
                    write!(arguments, " {}", bound * MILLI).expect("text takes text");
                }
                arguments
            }
            Exact => format!("exact {topics} {queue_size} 0 0"),
        }
    }
}

/// The digest of all sets: the same as in `message_filters.cpp`.
struct Digest {
    hash: u64,
    sets: u64,
}

impl Listener<()> for Digest {
    fn set(&mut self, set: Set<'_, ()>) {
        self.sets += 1;
        for message in set {
            self.hash = (self.hash ^ message.stamp as u64).wrapping_mul(1_099_511_628_211);
        }
    }
}

#[test]
fn sets_are_those_of_message_filters() {
    for case @ Case(name, .., expected) in CASES {
        let Digest { hash, sets } = case.digest();
        assert_eq!((hash, sets), *expected, "{name}: {hash:x}");
    }
}

#[test]
fn the_messages_of_each_case_are_written() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut calls = String::new();
    for case @ Case(name, _, _, input, _) in CASES {
        let path = folder.join(name);
        let line = |(topic, stamp): (usize, i64)| format!("{topic} {stamp}\n");
        let lines: String = input.arrivals().into_iter().map(line).collect();
        std::fs::write(&path, lines).unwrap();
        writeln!(calls, "message_filters {} {}", path.display(), case.arguments()).unwrap();
    }
    std::fs::write(folder.join("calls"), calls).unwrap();
}
