//! The simulated clock of a session that follows `/clock`.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::time::Time;
use teampulse_messages::standard::{Message, rosgraph_msgs};
use teampulse_ros::bus::{Arrival, Asked, Bus, BusError, Subscription};

/// How often it is looked whether the clock runs.
const LOOK: Duration = Duration::from_millis(20);

/// Lets a told clock follow `/clock` on a bus, as long as the subscription is held, and waits until
/// it runs. Gives `None` when nothing is told within `patience`.
pub async fn follow_clock(
    bus: &dyn Bus,
    clock: &Clock,
    patience: Duration,
) -> Result<Option<Subscription>, BusError> {
    let told = clock.clone();
    let deliver = Arc::new(move |arrival: Arrival| {
        if let Ok(message) = rosgraph_msgs::Clock::decode(&arrival.bytes) {
            told.tell(message.clock);
        }
    });
    let asked = Asked::Adaptive { depth: 1 };
    let subscription = bus.subscribe("/clock", "rosgraph_msgs/msg/Clock", asked, deliver)?;
    let running = async {
        while clock.now() == Time::EPOCH {
            tokio::time::sleep(LOOK).await;
        }
    };
    Ok(tokio::time::timeout(patience, running).await.is_ok().then_some(subscription))
}
