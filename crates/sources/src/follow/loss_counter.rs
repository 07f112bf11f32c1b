//! The losses of one stream: how many messages were lost in transit, and which computer's clock stamps them.

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

/// Counts the losses of one stream by its publishers' sequence numbers.
#[derive(Debug)]
pub(crate) struct LossCounter {
    stream: StreamId,
    /// `None` if the messages have no stamps.
    stamping: Option<Stamping>,
    losses: Losses,
    known: Option<bool>,
    unreported: u64,
    numbers: Numbers,
    /// Messages lost by the bus or unreadable since the last sample; a gap in the sample numbers includes them.
    unnumbered: u64,
    /// The number of samples in a message: those of its wave.
    run: u64,
}

impl LossCounter {
    /// Creates a counter for messages stamped by their publisher's computer.
    pub(crate) fn new(stream: StreamId, graph: watch::Receiver<Arc<Graph>>) -> LossCounter {
        LossCounter {
            stamping: Some(Stamping::new(stream, graph)),
            ..LossCounter::of_unstamped(stream)
        }
    }

    /// Creates a counter for messages without stamps.
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

    /// Handles a message: reports which computer's clock stamps it, and counts the messages missing before it. Whether
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

    /// Handles a decoded message: samples that, by its number, never reached its publisher are counted as lost. They
    /// are reported immediately, as they are missing right before this message.
    pub(crate) fn number(&mut self, decoded: &Decoded, arrival: &Arrival, outlet: &Outlet) {
        let lost_here = std::mem::take(&mut self.unnumbered);
        if lost_here == 0 {
            // After a loss, a wave may contain filled-in samples.
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
