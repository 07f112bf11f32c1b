//! The computer whose clock stamps a topic's messages.

use std::sync::Arc;

use teampulse_core::clocks::SIMULATED_TIME;
use teampulse_core::outlet::Outlet;
use teampulse_core::stream::StreamId;
use teampulse_ros::graph::{Gid, Graph};
use tokio::sync::watch;

/// Tracks which computer stamps a stream, and reports it in band before the stream's first message and before each
/// message from a different computer than the previous one. If several computers publish a topic, each message is
/// stamped by the clock of the computer that sent it.
#[derive(Debug)]
pub(super) struct Stamping {
    stream: StreamId,
    graph: watch::Receiver<Arc<Graph>>,
    publisher: Option<Gid>,
    reported: String,
}

impl Stamping {
    pub(super) fn new(stream: StreamId, graph: watch::Receiver<Arc<Graph>>) -> Stamping {
        Stamping { stream, graph, publisher: None, reported: String::new() }
    }

    /// Reports the computer that publishes the next message, if it is a different one.
    pub(super) fn hear(&mut self, publisher: Gid, outlet: &Outlet) {
        // Computers announce their names some time after they appear.
        let is_named_anew = self.graph.has_changed().unwrap_or(false);
        if self.publisher == Some(publisher) && !is_named_anew {
            return;
        }
        let is_same = self.publisher.replace(publisher) == Some(publisher);
        let computer = if outlet.clock().is_settable() {
            SIMULATED_TIME.to_owned()
        } else {
            let graph = self.graph.borrow_and_update();
            // After an outage, a publisher's last messages may arrive when it already counts as gone.
            if is_same && graph.named_computer(publisher).is_none() && !self.reported.is_empty() {
                return;
            }
            graph.computer(publisher)
        };
        if computer != self.reported {
            outlet.stamped_by(self.stream, &computer);
            self.reported = computer;
        }
    }
}
