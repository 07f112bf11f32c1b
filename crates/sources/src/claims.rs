//! Which source of a session takes a topic, so that each is subscribed to once.

use std::sync::{Arc, Mutex, PoisonError};

use teampulse_core::session_streams::SESSION_EVENTS;
use teampulse_ros::bus::Bus;
use teampulse_ros::graph::Endpoint;

use crate::wearables::uses::Uses;

/// The topics and devices that the sources of a session claim, collected before any source runs, so that the order of
/// discovery or startup does not matter.
#[derive(Clone, Default)]
pub struct Claims {
    topics: Arc<Mutex<Vec<Claim>>>,
    /// The ports, servers and stream names that the session's wearables use.
    pub(crate) uses: Uses,
}

/// The claim of one source.
struct Claim {
    /// The address of the bus, which identifies it.
    bus: usize,
    rank: Rank,
    wants: Arc<Wants>,
}

type Wants = dyn Fn(&Endpoint) -> bool + Send + Sync;

/// The precedence of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rank {
    /// People's signals.
    People,
    /// Robots' topics.
    Robots,
    /// Topics named in the study.
    Named,
}

/// Whether a topic carries what teampulse sessions publish about themselves; a wildcard does not match these.
pub(crate) fn is_of_sessions(topic: &str) -> bool {
    topic == SESSION_EVENTS || topic.starts_with("/teampulse/")
}

/// A source's registered claim.
#[derive(Clone)]
pub(crate) struct Claimed {
    claims: Claims,
    index: usize,
}

impl Claims {
    /// Registers a source's claim on a bus.
    pub(crate) fn lay(
        &self,
        bus: &Arc<dyn Bus>,
        rank: Rank,
        wants: impl Fn(&Endpoint) -> bool + Send + Sync + 'static,
    ) -> Claimed {
        let mut claims = self.topics.lock().unwrap_or_else(PoisonError::into_inner);
        let bus = Arc::as_ptr(bus).cast::<()>() as usize;
        claims.push(Claim { bus, rank, wants: Arc::new(wants) });
        Claimed { claims: self.clone(), index: claims.len() - 1 }
    }
}

impl Claimed {
    /// Whether a topic belongs to this source: no source with precedence wants it. Within a rank, the first source in
    /// the study wins.
    pub(crate) fn is_ours(&self, endpoint: &Endpoint) -> bool {
        let claims = self.claims.topics.lock().unwrap_or_else(PoisonError::into_inner);
        let ours = &claims[self.index];
        let before = claims.iter().enumerate().filter(|(index, claim)| {
            claim.bus == ours.bus && (claim.rank, *index) < (ours.rank, self.index)
        });
        !before.into_iter().any(|(_, claim)| (claim.wants)(endpoint))
    }
}

#[cfg(test)]
mod tests {
    use teampulse_core::qos::Qos;
    use teampulse_ros::graph::{EndpointKind, Gid};
    use teampulse_ros::memory::MemoryBus;

    use super::*;

    fn endpoint(topic: &str) -> Endpoint {
        Endpoint {
            kind: EndpointKind::Publisher,
            topic: topic.into(),
            type_name: "a/msg/X".into(),
            type_hash: String::new(),
            qos: Qos::reliable(1),
            gid: Gid::default(),
            node: None,
            own: false,
        }
    }

    #[test]
    fn a_topic_belongs_to_who_knows_it_whoever_comes_first() {
        let bus: Arc<dyn Bus> = MemoryBus::new("/teampulse");
        let elsewhere: Arc<dyn Bus> = MemoryBus::new("/teampulse");
        let claims = Claims::default();
        let all = claims.lay(&bus, Rank::Named, |_| true);
        let again = claims.lay(&bus, Rank::Named, |_| true);
        let robots = claims.lay(&bus, Rank::Robots, |each| each.topic.starts_with("/r"));
        let other_bus = claims.lay(&elsewhere, Rank::Named, |_| true);
        let ours =
            |topic| [&all, &again, &robots, &other_bus].map(|each| each.is_ours(&endpoint(topic)));
        assert_eq!(ours("/r1/odom"), [false, false, true, true]);
        assert_eq!(ours("/tf"), [true, false, true, true], "`robots` does not want it");
    }
}
