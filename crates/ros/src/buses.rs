//! The buses of a session: each is joined once.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use teampulse_core::clock;

use crate::bus::{Bus, BusError, Subscription};
use crate::bus_id::BusId;
use crate::clocks::{ReadClock, serve_clock};
use crate::environment::Environment;
use crate::memory::MemoryBus;

/// The buses of a session; clones share them.
#[derive(Clone)]
pub struct Buses(Arc<Pool>);

struct Pool {
    joining: Joining,
    joined: Mutex<BTreeMap<BusId, Joined>>,
}

/// A kind of bus: an entry of [`BUSES`](crate::BUSES).
pub struct BusKind {
    /// The word in front of an address in a study: `dds`.
    pub word: &'static str,
    /// A description of the bus and its addresses.
    pub doc: &'static str,
    /// The name of the bus at an address, in messages: `ROS domain 12`.
    pub name: fn(&str) -> String,
    /// Fails if an address is invalid; the message states what was expected.
    pub check: fn(&str) -> Result<(), String>,
    /// Joins the bus at an address.
    pub join: Join,
}

/// Joins the bus at an address. The call may block.
pub type Join = fn(&str, &Node) -> Result<Arc<dyn Bus>, BusError>;

/// Our node on a bus.
pub struct Node {
    /// The name of our node: `teampulse`.
    pub name: String,
    /// The environment variables that the node follows.
    pub environment: Environment,
}

/// A bus that was joined.
struct Joined {
    /// Declared before `bus`, which it uses, to be dropped first.
    _clock: Option<Subscription>,
    bus: Arc<dyn Bus>,
}

/// How a bus is joined.
enum Joining {
    /// The bus is joined as this node.
    As { node: Box<Node>, clock: ReadClock },
    /// A separate bus in memory is created, without other participants.
    Apart,
    /// No further buses can be joined.
    Never,
}

impl Buses {
    /// The buses of this environment, joined on first use as a node named `node_name`, such as `teampulse`. Clock
    /// probes of others are answered with the machine's clock.
    pub fn new(environment: Environment, node_name: &str) -> Buses {
        Buses::with_clock(environment, node_name, Arc::new(clock::wall))
    }

    /// Like [`new`](Buses::new), but clock probes are answered with `clock`.
    pub fn with_clock(environment: Environment, node_name: &str, clock: ReadClock) -> Buses {
        let node = Box::new(Node { name: node_name.to_owned(), environment });
        let joining = Joining::As { node, clock };
        Buses(Arc::new(Pool { joining, joined: Mutex::default() }))
    }

    /// Isolated buses, for dry runs.
    pub fn apart() -> Buses {
        Buses(Arc::new(Pool { joining: Joining::Apart, joined: Mutex::default() }))
    }

    /// Only the given buses, for tests.
    pub fn holding<I: Into<BusId>>(buses: impl IntoIterator<Item = (I, Arc<dyn Bus>)>) -> Buses {
        let held = |(id, bus): (I, _)| (id.into(), Joined { _clock: None, bus });
        let joined = Mutex::new(buses.into_iter().map(held).collect());
        Buses(Arc::new(Pool { joining: Joining::Never, joined }))
    }

    /// The bus with this id, joined on first use.
    pub fn get(&self, id: impl Into<BusId>) -> Result<Arc<dyn Bus>, BusError> {
        let id = id.into();
        let mut joined = self.0.joined.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = joined.get(&id) {
            return Ok(Arc::clone(&known.bus));
        }
        let new = self.0.joining.join(&id)?;
        let bus = Arc::clone(&new.bus);
        joined.insert(id, new);
        Ok(bus)
    }

    /// The buses joined so far.
    pub fn joined(&self) -> Vec<Arc<dyn Bus>> {
        let joined = self.0.joined.lock().unwrap_or_else(PoisonError::into_inner);
        joined.values().map(|known| Arc::clone(&known.bus)).collect()
    }

    /// The bus to join if none is named: the ROS domain of the environment.
    pub fn default_id(&self) -> Result<BusId, BusError> {
        match &self.0.joining {
            Joining::As { node, .. } => node.environment.domain().map(BusId::from),
            Joining::Apart | Joining::Never => Ok(BusId::from(0)),
        }
    }
}

impl Joining {
    fn join(&self, id: &BusId) -> Result<Joined, BusError> {
        let refused =
            |reason: String| BusError::Join { bus: id.to_string(), reason, hint: String::new() };
        let kind = id.check().map_err(refused)?;
        match self {
            Joining::As { node, clock } => {
                let bus = (kind.join)(id.address(), node)?;
                let served = serve_clock(&*bus, Arc::clone(clock));
                let served = served.map_err(|error| tracing::warn!("failed to {error}"));
                Ok(Joined { _clock: served.ok(), bus })
            }
            Joining::Apart => Ok(Joined { _clock: None, bus: MemoryBus::new("/teampulse") }),
            Joining::Never => Err(refused("it is not in this test".into())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_that_ros_does_not_have_is_refused() {
        let buses = Buses::new(Environment::default(), "teampulse");
        let error = buses.get(233).err().unwrap().to_string();
        assert_eq!(error, "join ROS domain 233: expected 0 to 232");
    }

    #[test]
    fn buses_apart_are_there_for_every_domain() {
        let buses = Buses::apart();
        assert!(buses.get(3).is_ok() && buses.get(233).is_err());
        assert_eq!(buses.default_id().unwrap(), BusId::from(0));
    }

    #[test]
    fn a_domain_is_joined_once() {
        let memory: Arc<dyn Bus> = MemoryBus::new("/teampulse");
        let buses = Buses::holding([(3, Arc::clone(&memory))]);
        assert!(Arc::ptr_eq(&buses.get(3).unwrap(), &memory));
        assert!(Arc::ptr_eq(&buses.clone().get(3).unwrap(), &memory));
        assert!(buses.get(4).is_err());
    }
}
