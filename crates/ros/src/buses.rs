//! The buses of a session: each domain is joined once.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::bus::{Bus, BusError};
use crate::cyclone::configuration::configuration;
use crate::cyclone::{CycloneBus, Participation};
use crate::environment::Environment;

/// The buses of a session; clones share them.
#[derive(Clone)]
pub struct Buses(Arc<Pool>);

struct Pool {
    joining: Joining,
    joined: Mutex<BTreeMap<u32, Arc<dyn Bus>>>,
}

/// How a domain that is not yet joined is joined.
enum Joining {
    /// Over DDS, as a node of this name.
    Dds { environment: Box<Environment>, node_name: String },
    /// Not at all.
    Never,
}

impl Buses {
    /// The ROS domains in reach, joined when they are first asked for as a node of this name:
    /// `teampulse`.
    pub fn new(environment: Environment, node_name: &str) -> Buses {
        let environment = Box::new(environment);
        let joining = Joining::Dds { environment, node_name: node_name.to_owned() };
        Buses(Arc::new(Pool { joining, joined: Mutex::default() }))
    }

    /// These buses and no others, for tests.
    pub fn holding(buses: impl IntoIterator<Item = (u32, Arc<dyn Bus>)>) -> Buses {
        let joined = Mutex::new(buses.into_iter().collect());
        Buses(Arc::new(Pool { joining: Joining::Never, joined }))
    }

    /// The bus of a domain, joined if it was not yet.
    pub fn get(&self, domain: u32) -> Result<Arc<dyn Bus>, BusError> {
        let mut joined = self.0.joined.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bus) = joined.get(&domain) {
            return Ok(Arc::clone(bus));
        }
        let bus = self.0.joining.join(domain)?;
        joined.insert(domain, Arc::clone(&bus));
        Ok(bus)
    }

    /// The domain that is meant where none is named.
    pub fn default_domain(&self) -> Result<u32, BusError> {
        match &self.0.joining {
            Joining::Dds { environment, .. } => environment.domain(),
            Joining::Never => Ok(0),
        }
    }
}

impl Joining {
    fn join(&self, domain: u32) -> Result<Arc<dyn Bus>, BusError> {
        let Joining::Dds { environment, node_name } = self else {
            let (bus, reason) = (format!("ROS domain {domain}"), "it is not in this test".into());
            return Err(BusError::Join { bus, reason });
        };
        CycloneBus::join(Participation {
            domain,
            namespace: "/".into(),
            node_name: node_name.clone(),
            configuration: configuration(environment),
            gid_width: environment.gid_width(),
            prefixes: environment.prefixes(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::MemoryBus;

    #[test]
    fn a_domain_is_joined_once() {
        let memory: Arc<dyn Bus> = MemoryBus::new("/teampulse");
        let buses = Buses::holding([(3, Arc::clone(&memory))]);
        assert!(Arc::ptr_eq(&buses.get(3).unwrap(), &memory));
        assert!(Arc::ptr_eq(&buses.clone().get(3).unwrap(), &memory));
        assert!(buses.get(4).is_err());
    }
}
