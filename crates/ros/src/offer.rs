//! Offered and requested QoS: whether they match, and a request that matches all offers.

use std::time::Duration;

use teampulse_core::qos::{Durability, History, Liveliness, Qos, Reliability};

/// The first policy on which a publisher offers less than a subscription requests; `None` when they
/// match. DDS 1.4, section 2.2.3.
pub fn incompatible(offered: &Qos, requested: &Qos) -> Option<&'static str> {
    let longest = |period: Option<Duration>| period.unwrap_or(Duration::MAX);
    let lacks = [
        ("reliability", reliability(offered) < reliability(requested)),
        ("durability", durability(offered) < durability(requested)),
        ("deadline", longest(offered.deadline) > longest(requested.deadline)),
        (
            "liveliness",
            liveliness(offered) < liveliness(requested)
                || longest(offered.liveliness_lease) > longest(requested.liveliness_lease),
        ),
    ];
    lacks.into_iter().find(|(_, lacking)| *lacking).map(|(policy, _)| policy)
}

/// Returns a request that matches all offers: reliable only if all are, transient local only if all are, with the
/// longest deadline if all have one. Without any offer it is best effort.
pub fn suiting_all<'a>(offered: impl IntoIterator<Item = &'a Qos>, depth: u32) -> Qos {
    let suited = offered.into_iter().fold(None, |suited: Option<Qos>, offer| {
        let suited = suited.unwrap_or_else(|| offer.clone());
        Some(Qos {
            reliability: weaker(&suited, offer, reliability).reliability,
            durability: weaker(&suited, offer, durability).durability,
            deadline: suited.deadline.zip(offer.deadline).map(|(one, other)| one.max(other)),
            ..suited
        })
    });
    let kept = Qos::best_effort(depth);
    suited.map_or(kept.clone(), |suited| Qos {
        reliability: suited.reliability,
        durability: suited.durability,
        deadline: suited.deadline,
        history: History::KeepLast(depth),
        ..kept
    })
}

fn weaker<'a>(one: &'a Qos, other: &'a Qos, strength: fn(&Qos) -> u8) -> &'a Qos {
    if strength(other) < strength(one) { other } else { one }
}

fn reliability(qos: &Qos) -> u8 {
    u8::from(qos.reliability == Reliability::Reliable)
}

fn durability(qos: &Qos) -> u8 {
    u8::from(qos.durability == Durability::TransientLocal)
}

fn liveliness(qos: &Qos) -> u8 {
    u8::from(qos.liveliness == Liveliness::ManualByTopic)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offers() -> Vec<Qos> {
        let within = |millis| Some(Duration::from_millis(millis));
        let mut offers = vec![Qos::reliable(10), Qos::best_effort(5), Qos::latched(1)];
        offers.push(Qos { deadline: within(100), ..Qos::reliable(1) });
        offers.push(Qos { deadline: within(300), ..Qos::latched(1) });
        offers
    }

    #[test]
    fn what_suits_all_matches_each() {
        for one in offers() {
            for other in offers() {
                let suiting = suiting_all([&one, &other], 7);
                assert_eq!(incompatible(&one, &suiting), None, "{one:?} {other:?}");
                assert_eq!(incompatible(&other, &suiting), None, "{one:?} {other:?}");
                assert_eq!(suiting.history, History::KeepLast(7));
            }
        }
    }

    #[test]
    fn what_suits_one_asks_for_all_that_it_offers() {
        let latched = suiting_all([&Qos::latched(1)], 3);
        assert_eq!(latched, Qos::latched(3));
        assert_eq!(suiting_all([], 3), Qos::best_effort(3));
    }

    #[test]
    fn the_policy_that_differs_is_named() {
        let within = |millis| Some(Duration::from_millis(millis));
        let (reliable, best_effort) = (Qos::reliable(1), Qos::best_effort(1));
        assert_eq!(incompatible(&best_effort, &reliable), Some("reliability"));
        assert_eq!(incompatible(&reliable, &best_effort), None);
        assert_eq!(incompatible(&reliable, &Qos::latched(1)), Some("durability"));
        let slow = Qos { deadline: within(200), ..reliable.clone() };
        let fast = Qos { deadline: within(100), ..reliable.clone() };
        assert_eq!(incompatible(&slow, &fast), Some("deadline"));
        assert_eq!(incompatible(&fast, &slow), None);
        let manual = Qos { liveliness: Liveliness::ManualByTopic, ..reliable.clone() };
        assert_eq!(incompatible(&reliable, &manual), Some("liveliness"));
    }
}
