//! A topic that is followed: its stream, and what takes its messages.

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
    /// Its publishers at the last look, and those that were reported.
    pub(super) publishers: Vec<Gid>,
    pub(super) published_by: Vec<String>,
    /// `None` when the bus would not have it; not tried again.
    _subscription: Option<Subscription>,
}

/// What takes the messages of a topic.
pub(super) enum Receivers {
    /// All as they came, in one stream.
    Verbatim {
        /// What is lost of them.
        losses: Arc<Mutex<LossCounter>>,
        /// Who stamps them.
        stamped: Stamped,
    },
    /// Decoded, and each publisher's apart.
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

    /// Whether its publishers are kept apart.
    pub(super) fn is_split(&self) -> bool {
        matches!(self.receivers, Receivers::Split(_))
    }

    /// Whether all its publishers are reliable.
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

    /// Nothing more comes: what waits is handed over. `present` still publish it.
    pub(super) fn close(&self, present: &BTreeSet<Gid>) {
        if let Receivers::Split(split) = &self.receivers {
            lock(split).close(present);
        }
    }
}
