//! Selects the ROS buses that a command joins.

use std::path::Path;
use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_ros::BusId;
use teampulse_ros::buses::Buses;
use teampulse_ros::environment::Environment;

use crate::failure::Failure;
use crate::output::say;

/// The buses selected by the environment, joined as a node of this name.
pub fn buses(node_name: &str) -> Arc<Buses> {
    Arc::new(Buses::new(environment(), node_name))
}

/// The buses selected by the environment, with probes that report a clock other than the machine's.
pub fn buses_with_clock(node_name: &str, clock: Clock) -> Arc<Buses> {
    let read = Arc::new(move || clock.now());
    Arc::new(Buses::with_clock(environment(), node_name, read))
}

/// The buses selected by the environment, with message definitions also looked up in a folder.
pub fn buses_with_messages(node_name: &str, messages: Option<&Path>) -> Arc<Buses> {
    let mut environment = environment();
    if let Some(folder) = messages {
        let installed = std::mem::take(&mut environment.ament_prefix_path);
        environment.ament_prefix_path = format!("{}:{installed}", folder.display());
    }
    Arc::new(Buses::new(environment, node_name))
}

/// Buses that are not visible beyond this machine.
pub fn buses_on_this_machine(node_name: &str) -> Arc<Buses> {
    Arc::new(Buses::new(on_this_machine(), node_name))
}

/// Buses that are not visible beyond this machine, with a default domain.
pub fn buses_of_demo(node_name: &str, domain: u32) -> Arc<Buses> {
    let environment = Environment { domain_id: domain.to_string(), ..on_this_machine() };
    Arc::new(Buses::new(environment, node_name))
}

fn on_this_machine() -> Environment {
    Environment { discovery_range: "LOCALHOST".to_owned(), ..Environment::read() }
}

/// Reads the environment, and warns about anything unusual in it.
fn environment() -> Environment {
    let environment = Environment::read();
    if let Some(oddity) = environment.oddity() {
        say(format!("warning: {oddity}"));
    }
    environment
}

/// Returns the bus to use if none is named.
pub fn default_bus(buses: &Buses) -> Result<BusId, Failure> {
    Ok(buses.default_id()?)
}
