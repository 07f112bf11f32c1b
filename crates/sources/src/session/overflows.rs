//! Packets dropped by this machine's receive buffers.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use teampulse_core::data::EventKind;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use teampulse_ros::bus::{Bus, Incident};
use tokio::sync::broadcast::error::RecvError;

use super::happen;

/// The shortest interval between reports.
const EVERY: Duration = Duration::from_secs(10);

/// Reports, as faults of the session, how many packets from a bus this machine dropped because a receive buffer was
/// full; a larger buffer avoids these losses.
pub struct Overflows {
    bus: Arc<dyn Bus>,
}

impl Overflows {
    /// Creates the source for the packets of a bus.
    pub fn new(bus: Arc<dyn Bus>) -> Overflows {
        Overflows { bus }
    }

    fn report(&self, outlet: &Outlet, packets: &mut u64) {
        if *packets > 0 {
            let label = label(&self.bus.name(), std::mem::take(packets));
            happen(outlet, EventKind::Fault, &label, 0.0);
        }
    }
}

#[async_trait]
impl Source for Overflows {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let mut incidents = self.bus.incidents();
        let mut due = tokio::time::interval(EVERY);
        let mut unreported = 0;
        loop {
            tokio::select! {
                incident = incidents.recv() => match incident {
                    Ok(Incident::Overflow { packets }) => unreported += packets,
                    Err(RecvError::Closed) => break outlet.closed().await,
                    Ok(_) | Err(RecvError::Lagged(_)) => {}
                },
                _ = due.tick() => self.report(outlet, &mut unreported),
                () = outlet.closed() => break,
            }
        }
        self.report(outlet, &mut unreported);
        Ok(())
    }
}

fn label(bus: &str, packets: u64) -> String {
    let what = if packets == 1 { "packet" } else { "packets" };
    format!(
        "{bus}: this machine dropped {packets} {what}, as its receive buffer was full; \
         `teampulse check` says how to enlarge it"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_packet_is_one() {
        assert!(label("ROS domain 0", 1).contains("dropped 1 packet, as"));
        assert!(
            label("ROS domain 0", 2).starts_with("ROS domain 0: this machine dropped 2 packets")
        );
    }
}
