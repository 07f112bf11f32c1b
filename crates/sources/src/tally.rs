//! The tally of one topic: how many of its messages were lost on the way.

use teampulse_core::outlet::Outlet;
use teampulse_core::stream::StreamId;
use teampulse_ros::bus::Arrival;
use teampulse_ros::losses::Losses;

/// What is known of the losses of one stream, from the numbers that its publishers give.
#[derive(Debug)]
pub(crate) struct Tally {
    stream: StreamId,
    losses: Losses,
    known: Option<bool>,
    untold: u64,
}

impl Tally {
    /// Nothing has arrived yet.
    pub(crate) fn new(stream: StreamId) -> Tally {
        Tally { stream, losses: Losses::default(), known: None, untold: 0 }
    }

    /// A message arrived: counts what is missing before it. Whether losses can be known at all is
    /// told when it is first seen or changes.
    pub(crate) fn count(&mut self, arrival: &Arrival, outlet: &Outlet) {
        let known = arrival.sequence.is_some();
        if self.known != Some(known) {
            self.known = Some(known);
            outlet.lost(self.stream, if known { 0.0 } else { f64::NAN });
        }
        if let Some(sequence) = arrival.sequence {
            self.untold += self.losses.observe(arrival.publisher, sequence);
        }
    }

    /// A message could not be read: it is as good as lost.
    pub(crate) fn refuse(&mut self) {
        self.untold += 1;
    }

    /// Tells what was counted since the last time.
    pub(crate) fn tell(&mut self, outlet: &Outlet) {
        if self.untold > 0 {
            outlet.lost(self.stream, std::mem::take(&mut self.untold) as f64);
        }
    }
}
