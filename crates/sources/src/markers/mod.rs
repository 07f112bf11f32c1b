//! Markers from programs and devices that use neither LSL nor ROS.

pub mod lines;
pub mod ttl;

use teampulse_core::data::{Event, EventKind};
use teampulse_core::outlet::Outlet;
use teampulse_core::time::Time;

/// Offers a marker; `value` is the number sent with it, NaN if there is none.
fn mark(label: String, value: f64, at: Time, outlet: &Outlet) {
    let event = Event { kind: EventKind::Marker, label, value, duration_secs: 0.0 };
    outlet.happen_at(event, Some(at));
}
