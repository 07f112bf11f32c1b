//! Probes other computers' clocks.

use std::sync::Arc;

use async_trait::async_trait;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Source, SourceError};
use teampulse_ros::bus::Bus;
use teampulse_ros::clocks::probe_clocks;

/// Probes the clocks of the computers on a bus during the session; does nothing in simulated time.
pub struct Computers {
    bus: Arc<dyn Bus>,
}

impl Computers {
    /// Creates a prober of the computers on a bus.
    pub fn new(bus: Arc<dyn Bus>) -> Computers {
        Computers { bus }
    }
}

#[async_trait]
impl Source for Computers {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        if outlet.clock().is_settable() {
            outlet.closed().await;
            return Ok(());
        }
        let probing = probe_clocks(&*self.bus, outlet.clock(), |computer, exchange| {
            outlet.probed(computer, exchange.offset_secs, exchange.round_trip_secs);
        });
        tokio::select! {
            () = probing => {}
            () = outlet.closed() => {}
        }
        Ok(())
    }
}
