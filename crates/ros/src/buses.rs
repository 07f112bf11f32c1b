//! The buses of a session: each is joined once.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use teampulse_core::clock;

use crate::bus::{Bus, BusError, Subscription};
use crate::clocks::{ReadClock, serve_clock};
use crate::cyclone::configuration::configuration;
use crate::cyclone::{CycloneBus, Participation};
use crate::environment::{Environment, HIGHEST_DOMAIN};
use crate::memory::MemoryBus;

/// The buses of a session; clones share them.
#[derive(Clone)]
pub struct Buses(Arc<Pool>);

struct Pool {
    joining: Joining,
    joined: Mutex<BTreeMap<BusId, Joined>>,
}

/// A bus as named in a study: `domain = 12`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BusId {
    /// A ROS domain, over DDS.
    Domain(u32),
}

impl From<u32> for BusId {
    fn from(domain: u32) -> BusId {
        BusId::Domain(domain)
    }
}

impl fmt::Display for BusId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BusId::Domain(domain) = self;
        write!(f, "ROS domain {domain}")
    }
}

/// A bus that was joined.
struct Joined {
    /// Declared before `bus`, which it uses, to be dropped first.
    _clock: Option<Subscription>,
    bus: Arc<dyn Bus>,
}

/// How a bus is joined.
enum Joining {
    /// Over DDS, as a node with this name.
    Dds { environment: Box<Environment>, node_name: String, clock: ReadClock },
    /// As a separate bus in memory, without other participants.
    Apart,
    /// No further domains can be joined.
    Never,
}

impl Buses {
    /// The ROS domains of the environment, joined on first use as a node named `node_name`: `teampulse`.
    /// Clock probes by others are answered with the machine's clock.
    pub fn new(environment: Environment, node_name: &str) -> Buses {
        Buses::with_clock(environment, node_name, Arc::new(clock::wall))
    }

    /// The same, answering clock probes with another clock.
    pub fn with_clock(environment: Environment, node_name: &str, clock: ReadClock) -> Buses {
        let (environment, node_name) = (Box::new(environment), node_name.to_owned());
        let joining = Joining::Dds { environment, node_name, clock };
        Buses(Arc::new(Pool { joining, joined: Mutex::default() }))
    }

    /// Isolated buses, for dry runs.
    pub fn apart() -> Buses {
        Buses(Arc::new(Pool { joining: Joining::Apart, joined: Mutex::default() }))
    }

    /// Only the given buses, for tests.
    pub fn holding(buses: impl IntoIterator<Item = (u32, Arc<dyn Bus>)>) -> Buses {
        let held = |(domain, bus)| (BusId::Domain(domain), Joined { _clock: None, bus });
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
        let new = self.0.joining.join(id)?;
        let bus = Arc::clone(&new.bus);
        joined.insert(id, new);
        Ok(bus)
    }

    /// The buses joined so far.
    pub fn joined(&self) -> Vec<Arc<dyn Bus>> {
        let joined = self.0.joined.lock().unwrap_or_else(PoisonError::into_inner);
        joined.values().map(|known| Arc::clone(&known.bus)).collect()
    }

    /// The default domain.
    pub fn default_domain(&self) -> Result<u32, BusError> {
        match &self.0.joining {
            Joining::Dds { environment, .. } => environment.domain(),
            Joining::Apart | Joining::Never => Ok(0),
        }
    }
}

impl Joining {
    fn join(&self, id: BusId) -> Result<Joined, BusError> {
        let refused = |reason: String| {
            Err(BusError::Join { bus: id.to_string(), reason, hint: String::new() })
        };
        let BusId::Domain(domain) = id;
        if domain > HIGHEST_DOMAIN {
            return refused(format!("it is not a ROS domain: expected 0 to {HIGHEST_DOMAIN}"));
        }
        let (environment, node_name, clock) = match self {
            Joining::Dds { environment, node_name, clock } => (environment, node_name, clock),
            Joining::Apart => {
                return Ok(Joined { _clock: None, bus: MemoryBus::new("/teampulse") });
            }
            Joining::Never => return refused("it is not in this test".into()),
        };
        let joined = CycloneBus::join(Participation {
            domain,
            namespace: "/".into(),
            node_name: node_name.clone(),
            configuration: configuration(environment),
            gid_width: environment.gid_width(),
            prefixes: environment.prefixes(),
        });
        let bus = joined.map_err(|error| explained(error, environment))?;
        let served = serve_clock(&*bus, Arc::clone(clock));
        let served = served.map_err(|error| tracing::warn!("failed to {error}"));
        Ok(Joined { _clock: served.ok(), bus })
    }
}

/// Extends an error with settings of the environment that may be its cause.
fn explained(error: BusError, environment: &Environment) -> BusError {
    let BusError::Join { bus, reason, .. } = error else { return error };
    let set = [
        ("CYCLONEDDS_URI", &environment.cyclonedds_uri),
        ("ROS_STATIC_PEERS", &environment.static_peers),
    ];
    let set = set.into_iter().filter(|(_, value)| !value.is_empty());
    let set: Vec<&str> = set.map(|(name, _)| name).collect();
    let hint = if set.is_empty() {
        "`ip address` shows whether this machine has a network".to_owned()
    } else {
        format!("{} may be the cause: unset it, and try again", set.join(" or "))
    };
    BusError::Join { bus, reason, hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_that_ros_does_not_have_is_refused() {
        let buses = Buses::new(Environment::default(), "teampulse");
        let error = buses.get(233).err().unwrap().to_string();
        assert_eq!(error, "join ROS domain 233: it is not a ROS domain: expected 0 to 232");
    }

    #[test]
    fn what_in_the_environment_may_be_the_reason_is_named() {
        let environment = Environment {
            cyclonedds_uri: "<CycloneDDS".into(),
            static_peers: "nobody.invalid".into(),
            ..Environment::default()
        };
        let failed = || BusError::Join {
            bus: "ROS domain 0".into(),
            reason: "syntax".into(),
            hint: String::new(),
        };
        let hint = explained(failed(), &environment).hint();
        assert_eq!(
            hint,
            "CYCLONEDDS_URI or ROS_STATIC_PEERS may be the cause: unset it, and try again"
        );
        assert!(explained(failed(), &Environment::default()).hint().contains("ip address"));
    }

    #[test]
    fn buses_apart_are_there_for_every_domain() {
        let buses = Buses::apart();
        assert!(buses.get(3).is_ok() && buses.get(233).is_err());
        assert_eq!(buses.default_domain().unwrap(), 0);
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
