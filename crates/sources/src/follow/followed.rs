//! A followed topic: its stream and the receivers of its messages.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use teampulse_core::outlet::Outlet;
use teampulse_core::qos::{Qos, Reliability};
use teampulse_core::stream::{Stream, StreamId};
use teampulse_ros::bus::Subscription;
use teampulse_ros::graph::Gid;

use super::lock;
use super::loss_counter::LossCounter;
use super::publisher_split::PublisherSplit;
use super::stamped::Stamped;

/// A topic with its stream.
pub(super) struct Followed {
    pub(super) id: StreamId,
    pub(super) stream: Stream,
    pub(super) receivers: Receivers,
    /// The publishers at the last check, and the names of those that were reported.
    pub(super) publishers: Vec<Gid>,
    pub(super) published_by: Vec<String>,
    /// `None` if the bus rejected the subscription, which is not retried.
    _subscription: Option<Subscription>,
}

/// The receivers of a topic's messages.
pub(super) enum Receivers {
    /// All messages as received, in one stream.
    Verbatim {
        /// The counter of losses.
        losses: Arc<Mutex<LossCounter>>,
        /// Whether the messages are stamped by their header or by the bus.
        stamped: Stamped,
    },
    /// Decoded messages, with a stream per publisher.
    Split(Arc<Mutex<PublisherSplit>>),
}

impl Followed {
    pub(super) fn new(
        id: StreamId,
        stream: Stream,
        receivers: Receivers,
        subscription: Option<Subscription>,
    ) -> Followed {
        let (publishers, published_by) = (Vec::new(), Vec::new());
        Followed { id, stream, receivers, publishers, published_by, _subscription: subscription }
    }

    /// Whether the topic has a stream per publisher.
    pub(super) fn is_split(&self) -> bool {
        matches!(self.receivers, Receivers::Split(_))
    }

    /// Whether all publishers of the topic are reliable.
    pub(super) fn is_reliable(&self) -> bool {
        self.stream.qos.iter().all(|qos: &Qos| qos.reliability == Reliability::Reliable)
    }

    /// Reports the losses since the previous call, and returns their number.
    pub(super) fn report_losses(&self, outlet: &Outlet) -> u64 {
        match &self.receivers {
            Receivers::Verbatim { losses, .. } => lock(losses).report(outlet),
            Receivers::Split(split) => lock(split).report_losses(),
        }
    }

    /// Stops following the topic and offers waiting messages; `present` are the publishers that still exist.
    pub(super) fn close(&self, present: &BTreeSet<Gid>) {
        if let Receivers::Split(split) = &self.receivers {
            lock(split).close(present);
        }
    }
}
