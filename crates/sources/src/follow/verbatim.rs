//! Passes messages of foreign types on unchanged.

use std::sync::{Arc, Mutex};

use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::Reading;
use teampulse_core::stream::StreamId;
use teampulse_messages::fields;
use teampulse_ros::bus::{Arrival, Deliver};

use super::lock;
use super::loss_counter::LossCounter;
use super::stamped::Stamped;

/// Returns the callback that offers a stream's messages unchanged, with the stamp of their header or of the bus. In
/// simulated time the bus's stamps are meaningless.
pub(super) fn deliver(
    outlet: &Outlet,
    id: StreamId,
    stamped: &Stamped,
    losses: &Arc<Mutex<LossCounter>>,
) -> Deliver {
    let (outlet, losses, stamped) = (outlet.clone(), Arc::clone(losses), stamped.clone());
    let by_host = !outlet.clock().is_settable();
    Arc::new(move |arrival: Arrival| {
        lock(&losses).count(&arrival, &outlet);
        let source_time = if stamped.is_by_header() {
            let stamp = fields::header_stamp(&arrival.bytes);
            stamp.map(|stamp| outlet.clock().session_from_stamp(stamp))
        } else {
            arrival.source_time.filter(|_| by_host)
        };
        let data = Data::Message(arrival.bytes);
        outlet.offer(Reading { index: None, stream: id, device_time: None, source_time, data });
    })
}
