//! Losses of one stream: how many of its messages were lost in transit, and which computer's clock stamps them.

use std::sync::Arc;

use teampulse_core::outlet::Outlet;
use teampulse_core::stream::StreamId;
use teampulse_messages::convert::Decoded;
use teampulse_ros::bus::Arrival;
use teampulse_ros::graph::Graph;
use teampulse_ros::losses::Losses;
use tokio::sync::watch;

use super::numbers::Numbers;
use super::stamping::Stamping;

/// The losses of one stream, from its publishers' sequence numbers.
#[derive(Debug)]
pub(crate) struct LossCounter {
    stream: StreamId,
    /// `None` if no computer stamps them.
    stamping: Option<Stamping>,
    losses: Losses,
    known: Option<bool>,
    unreported: u64,
    numbers: Numbers,
    /// Messages lost by the bus or unreadable since the last sample; its number reveals these, too.
    unnumbered: u64,
    /// The number of samples of a message: those of its wave.
    run: u64,
}

impl LossCounter {
    /// A counter before the first message.
    pub(crate) fn new(stream: StreamId, graph: watch::Receiver<Arc<Graph>>) -> LossCounter {
        LossCounter {
            stamping: Some(Stamping::new(stream, graph)),
            ..LossCounter::of_unstamped(stream)
        }
    }

    /// A counter of messages without stamps.
    pub(crate) fn of_unstamped(stream: StreamId) -> LossCounter {
        LossCounter {
            stream,
            stamping: None,
            losses: Losses::default(),
            known: None,
            unreported: 0,
            numbers: Numbers::default(),
            unnumbered: 0,
            run: 1,
        }
    }

    /// Takes in a message: reports which computer's clock stamps it, and counts the messages missing before it. Whether
    /// losses can be counted at all is reported at the first message and when it changes.
    pub(crate) fn count(&mut self, arrival: &Arrival, outlet: &Outlet) {
        if let Some(stamping) = &mut self.stamping {
            stamping.hear(arrival.publisher, outlet);
        }
        let known = arrival.sequence.is_some();
        if self.known != Some(known) {
            self.known = Some(known);
            if known {
                outlet.lost(self.stream, 0);
            } else {
                outlet.losses_are_unknown(self.stream);
            }
        }
        if let Some(sequence) = arrival.sequence {
            let lost = self.losses.observe(arrival.publisher, sequence);
            self.unreported = self.unreported.saturating_add(lost);
            self.unnumbered = self.unnumbered.saturating_add(lost);
        }
    }

    /// Counts an unreadable message as lost.
    pub(crate) fn refuse(&mut self) {
        self.unreported = self.unreported.saturating_add(1);
        self.unnumbered = self.unnumbered.saturating_add(1);
    }

    /// Takes in a decoded message, and counts those that by its number never reached its publisher as lost. They are
    /// reported immediately, as they are missing right before this one.
    pub(crate) fn number(&mut self, decoded: &Decoded, arrival: &Arrival, outlet: &Outlet) {
        let lost_here = std::mem::take(&mut self.unnumbered);
        if lost_here == 0 {
            // After a loss, a wave may have missing samples filled in.
            self.run = decoded.data.samples().into();
        }
        let Some(index) = decoded.index else { return };
        let missing = self.numbers.missing_before(arrival.publisher, index);
        let lost_before = missing.saturating_sub(lost_here);
        if lost_before > 0 {
            self.unreported = self.unreported.saturating_add(lost_before);
            self.report(outlet);
        }
    }

    /// Reports the losses counted since the previous call, and returns the number of messages.
    pub(crate) fn report(&mut self, outlet: &Outlet) -> u64 {
        let unreported = std::mem::take(&mut self.unreported);
        if unreported > 0 {
            outlet.lost(self.stream, unreported.saturating_mul(self.run));
        }
        unreported
    }
}
