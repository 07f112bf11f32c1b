//! The in-memory bus: participants in one process, for tests.

mod network;

use std::sync::Arc;

use async_trait::async_trait;
use teampulse_core::clock;
use teampulse_core::qos::Qos;
use teampulse_core::stream::Schema;
use teampulse_core::time::Time;
use teampulse_messages::catalogue;
use tokio::sync::{broadcast, watch};

use crate::bus::{
    Answer, Asked, Bus, BusError, Client, Deliver, Hear, Incident, Publisher, Reply, Subscription,
};
use crate::graph::{Gid, Graph};
use network::{Member, Network, Reader, Server, Writer};

/// A participant of an in-memory bus.
///
/// It behaves like a participant of a ROS 2 domain: late joiners receive transient-local messages, incompatible
/// endpoints do not match, which is reported; and no participant receives its own messages. Messages arrive before
/// [`Publisher::publish`] returns; deadlines are not checked. A [`Deliver`] must not call the bus.
pub struct MemoryBus {
    name: String,
    network: Arc<Network>,
    member: Arc<Member>,
}

impl MemoryBus {
    /// Creates a separate bus with one participant, whose node has this full name: `/teampulse`.
    pub fn new(node: &str) -> Arc<MemoryBus> {
        MemoryBus::on(Arc::default(), node)
    }

    /// Adds another participant to the same bus.
    pub fn join(&self, node: &str) -> Arc<MemoryBus> {
        MemoryBus::on(Arc::clone(&self.network), node)
    }

    fn on(network: Arc<Network>, node: &str) -> Arc<MemoryBus> {
        let member = network.join(node);
        Arc::new(MemoryBus { name: format!("memory bus as {node}"), network, member })
    }
}

impl Drop for MemoryBus {
    fn drop(&mut self) {
        self.network.leave(&self.member);
    }
}

#[async_trait]
impl Bus for MemoryBus {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn graph(&self) -> watch::Receiver<Arc<Graph>> {
        self.network.graph(&self.member)
    }

    fn incidents(&self) -> broadcast::Receiver<Incident> {
        self.member.incidents.subscribe()
    }

    fn subscribe(
        &self,
        topic: &str,
        type_name: &str,
        asked: Asked,
        deliver: Deliver,
    ) -> Result<Subscription, BusError> {
        let member = Arc::clone(&self.member);
        let (topic, type_name) = (topic.to_owned(), type_name.to_owned());
        let gid = self.network.read(Reader { member, topic, type_name, asked, deliver });
        Ok(Subscription::new(Membership { network: Arc::clone(&self.network), gid }))
    }

    fn publish(
        &self,
        topic: &str,
        schema: &Schema,
        qos: &Qos,
    ) -> Result<Box<dyn Publisher>, BusError> {
        let writer = Writer::new(Arc::clone(&self.member), topic, schema, qos);
        let gid = self.network.write(writer);
        Ok(Box::new(Membership { network: Arc::clone(&self.network), gid }))
    }

    fn node(&self) -> String {
        self.member.node.clone()
    }

    fn serve(
        &self,
        service: &str,
        type_name: &str,
        answer: Answer,
    ) -> Result<Subscription, BusError> {
        let member = Arc::clone(&self.member);
        let (service, type_name) = (service.to_owned(), type_name.to_owned());
        let gid = self.network.serve(Server { member, service, type_name, answer });
        Ok(Subscription::new(Membership { network: Arc::clone(&self.network), gid }))
    }

    fn client(
        &self,
        service: &str,
        _type_name: &str,
        hear: Hear,
    ) -> Result<Box<dyn Client>, BusError> {
        let (network, member) = (Arc::clone(&self.network), Arc::clone(&self.member));
        Ok(Box::new(Asking { network, member, service: service.to_owned(), hear }))
    }

    async fn definition(&self, type_name: &str, hash: &str) -> Result<Schema, BusError> {
        let is_it = |schema: &Arc<Schema>| hash.is_empty() || schema.hash == hash;
        let shipped = || Some(Schema::clone(&*catalogue::shipped(type_name).filter(is_it)?));
        let found = self.network.definition(type_name, hash).or_else(shipped);
        found.ok_or_else(|| BusError::Definition {
            type_name: type_name.to_owned(),
            reason: "no publisher on the memory bus provides it; it is not shipped with teampulse"
                .into(),
        })
    }
}

/// An endpoint of the bus, which is removed when this value is dropped.
struct Membership {
    network: Arc<Network>,
    gid: Gid,
}

impl Publisher for Membership {
    fn publish(&self, cdr: &[u8]) -> Result<(), BusError> {
        self.publish_at(cdr, clock::wall())
    }

    fn publish_at(&self, cdr: &[u8], stamp: Time) -> Result<(), BusError> {
        self.network.publish(self.gid, cdr, stamp);
        Ok(())
    }

    fn subscribers(&self) -> usize {
        self.network.subscribers(self.gid)
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        self.network.remove(self.gid);
    }
}

/// A client of a service.
struct Asking {
    network: Arc<Network>,
    member: Arc<Member>,
    service: String,
    hear: Hear,
}

impl Client for Asking {
    fn ask(&self, number: i64, request: &[u8]) -> Result<(), BusError> {
        for (server, answer) in self.network.servers(&self.member, &self.service) {
            if let Some(bytes) = answer(request) {
                (self.hear)(Reply { number, bytes, server });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
