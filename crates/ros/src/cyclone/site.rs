//! Our place in a domain, and the thread that watches the domain from there.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_messages::standard::rmw_dds_common::GidWidth;
use tokio::sync::{broadcast, watch};

use super::census::{self, Census};
use super::discovery::Discovery;
use super::domain::Participant;
use super::nodes::Nodes;
use super::overflow::Overflow;
use super::subscription::Listening;
use super::wake::Wake;
use crate::bus::Incident;
use crate::graph::Graph;

/// How long changes are collected before they are reported.
const COALESCED: Duration = Duration::from_millis(5);
/// How often it is looked for readers that may go.
const PATIENCE: Duration = Duration::from_secs(1);
/// How many incidents wait for a slow listener.
const INCIDENTS: usize = 256;

/// Our place in a domain.
pub(super) struct Site {
    pub(super) namespace: String,
    pub(super) node_name: String,
    pub(super) participant: Arc<Participant>,
    pub(super) graph: watch::Sender<Arc<Graph>>,
    pub(super) incidents: broadcast::Sender<Incident>,
    pub(super) wake: Arc<Wake>,
    clock: Clock,
    census: Mutex<Census>,
    subscriptions: Mutex<Vec<Weak<Listening>>>,
    calls: AtomicI64,
}

impl Site {
    pub(super) fn new(participant: Arc<Participant>, namespace: String, node_name: String) -> Site {
        Site {
            namespace,
            node_name,
            graph: watch::Sender::default(),
            incidents: broadcast::Sender::new(INCIDENTS),
            wake: Arc::default(),
            clock: Clock::host(),
            census: Mutex::new(Census::new(participant.entity().gid())),
            subscriptions: Mutex::default(),
            calls: AtomicI64::new(0),
            participant,
        }
    }

    /// Who is there.
    pub(super) fn census(&self) -> MutexGuard<'_, Census> {
        self.census.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A number for a call of a service.
    pub(super) fn next_call(&self) -> i64 {
        self.calls.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Keeps a subscription suited to what is offered, as long as it is alive.
    pub(super) fn keep(&self, subscription: &Arc<Listening>) {
        let mut all = self.subscriptions.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() == all.capacity() {
            all.retain(|each| each.strong_count() > 0);
        }
        all.push(Arc::downgrade(subscription));
        drop(all);
        // The graph may have changed since the subscription looked at it.
        self.wake.wake();
    }

    fn subscriptions(&self) -> Vec<Arc<Listening>> {
        let all = self.subscriptions.lock().unwrap_or_else(PoisonError::into_inner);
        all.iter().filter_map(Weak::upgrade).collect()
    }
}

/// Watches a domain.
pub(super) struct Watcher {
    /// Before `site`, in whose participant they live; so is `nodes`.
    discovery: Discovery,
    nodes: Nodes,
    site: Arc<Site>,
    width: Option<GidWidth>,
    overflow: Overflow,
    ambiguous: BTreeMap<String, Vec<String>>,
}

impl Watcher {
    /// Starts watching; ids are announced in this width, or in that of the first announcement received.
    pub(super) fn new(
        site: Arc<Site>,
        domain: u32,
        width: Option<GidWidth>,
    ) -> Result<Watcher, String> {
        let discovery = Discovery::listen(&site.participant, Arc::clone(&site.wake))?;
        let nodes = Nodes::open(&site.participant, Arc::clone(&site.wake))?;
        let overflow = Overflow::of(domain);
        Ok(Watcher { discovery, nodes, site, width, overflow, ambiguous: BTreeMap::new() })
    }

    /// Watches until the site's `wake` ends.
    pub(super) fn run(mut self) {
        while self.site.wake.wait(PATIENCE) {
            self.look();
            self.report_overflow();
            self.site.wake.pause(COALESCED);
        }
    }

    /// Takes what has changed, and reports it.
    pub(super) fn look(&mut self) {
        // In this order: who is heard was discovered before.
        let heard = self.nodes.take();
        let changes = self.discovery.take();
        if heard.is_empty() && changes.is_empty() {
            let graph = Arc::clone(&self.site.graph.borrow());
            return self.adapt_subscriptions(&graph);
        }
        let mut census = self.site.census();
        for change in changes {
            census.apply(change);
        }
        for (info, width) in heard {
            self.width.get_or_insert(width);
            census.hear(info);
        }
        let ours = census.own_nodes(&self.site.namespace, &self.site.node_name);
        census.hear(ours.clone());
        let graph = Arc::new(census.graph());
        drop(census);
        self.nodes.report(ours, self.width.unwrap_or(GidWidth::Iron));
        self.report_ambiguity(&graph);
        self.adapt_subscriptions(&graph);
        self.site.graph.send_if_modified(|told| {
            let changed = *told != graph;
            if changed {
                *told = graph;
            }
            changed
        });
    }

    fn adapt_subscriptions(&self, graph: &Graph) {
        let now = self.site.clock.now();
        for subscription in self.site.subscriptions() {
            if let Err(reason) = subscription.adapt(graph, now) {
                tracing::warn!(
                    "failed to adapt a subscription to the offered quality of service: {reason}"
                );
            }
        }
    }

    /// Reports how many packets were dropped because our receive buffers were full.
    fn report_overflow(&mut self) {
        let packets = self.overflow.look(self.site.clock.now());
        if packets > 0 {
            // Without a listener the event is dropped.
            self.site.incidents.send(Incident::Overflow { packets }).ok();
        }
    }

    /// Reports each topic that is published with two types, once for each set of types.
    fn report_ambiguity(&mut self, graph: &Graph) {
        let now: BTreeMap<String, Vec<String>> = census::ambiguous_topics(graph)
            .into_iter()
            .map(|(topic, types)| (topic, types.into_iter().collect()))
            .collect();
        for (topic, types) in &now {
            if self.ambiguous.get(topic) != Some(types) {
                let (topic, types) = (topic.clone(), types.clone());
                // Without a listener the event is dropped.
                self.site.incidents.send(Incident::TwoTypes { topic, types }).ok();
            }
        }
        self.ambiguous = now;
    }
}
