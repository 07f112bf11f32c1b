//! Our participant in a domain, and the thread that watches the domain.

use std::collections::{BTreeMap, BTreeSet};
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
/// The interval at which readers are checked for removal.
const PATIENCE: Duration = Duration::from_secs(1);
/// The most incidents queued for a slow listener.
const INCIDENTS: usize = 256;

/// Our participant in a domain, with its graph and subscriptions.
pub(super) struct Site {
    pub(super) namespace: String,
    pub(super) node_name: String,
    pub(super) participant: Arc<Participant>,
    pub(super) graph: watch::Sender<Arc<Graph>>,
    pub(super) incidents: broadcast::Sender<Incident>,
    pub(super) wake: Arc<Wake>,
    clock: Clock,
    census: Mutex<Census>,
    subscriptions: Mutex<Subscriptions>,
    calls: AtomicI64,
}

/// Our subscriptions.
#[derive(Default)]
struct Subscriptions {
    by_topic: BTreeMap<Arc<str>, Vec<Weak<Listening>>>,
    /// The topics whose subscriptions must be checked even if the offered QoS has not changed.
    unsettled: BTreeSet<Arc<str>>,
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

    /// The census of the domain.
    pub(super) fn census(&self) -> MutexGuard<'_, Census> {
        self.census.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next sequence number for a service request.
    pub(super) fn next_call(&self) -> i64 {
        self.calls.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Keeps a subscription adapted to the offered QoS as long as it exists.
    pub(super) fn keep(&self, subscription: &Arc<Listening>) {
        let mut all = self.subscriptions();
        let topic = Arc::<str>::from(subscription.topic());
        all.by_topic.entry(Arc::clone(&topic)).or_default().push(Arc::downgrade(subscription));
        // The graph may have changed since the subscription was set up.
        all.unsettled.insert(topic);
        drop(all);
        self.wake.wake();
    }

    fn subscriptions(&self) -> MutexGuard<'_, Subscriptions> {
        self.subscriptions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adapts the subscriptions of changed topics to the offered QoS.
    fn adapt_subscriptions(&self, graph: &Graph, mut topics: BTreeSet<Arc<str>>) {
        let now = self.clock.now();
        topics.append(&mut self.subscriptions().unsettled);
        for topic in topics {
            let subscriptions = self.subscriptions().of(&topic);
            let adapted = subscriptions.iter().map(|each| each.adapt(graph, now));
            let unsettled = adapted.filter(|adapted| match adapted {
                Ok(is_settled) => !is_settled,
                Err(reason) => {
                    tracing::warn!(
                        "failed to adapt a subscription to the offered quality of service: {reason}"
                    );
                    true
                }
            });
            if unsettled.count() > 0 {
                self.subscriptions().unsettled.insert(topic);
            }
        }
    }
}

impl Subscriptions {
    /// The subscriptions of a topic; forgets those that are closed.
    fn of(&mut self, topic: &Arc<str>) -> Vec<Arc<Listening>> {
        let Some(of_topic) = self.by_topic.get_mut(topic) else { return Vec::new() };
        let alive: Vec<_> = of_topic.iter().filter_map(Weak::upgrade).collect();
        of_topic.retain(|each| each.strong_count() > 0);
        if of_topic.is_empty() {
            self.by_topic.remove(topic);
        }
        alive
    }
}

/// Watches a domain.
pub(super) struct Watcher {
    /// Declared before `site`, like `nodes`, to be dropped first: both use its participant.
    discovery: Discovery,
    nodes: Nodes,
    site: Arc<Site>,
    width: Option<GidWidth>,
    /// Whether our current endpoints have been announced, with this width of GIDs.
    is_announced: bool,
    overflow: Overflow,
    ambiguous: BTreeMap<Arc<str>, Vec<String>>,
}

impl Watcher {
    /// Starts watching; GIDs are announced with this width, or with the width of the first announcement received.
    pub(super) fn new(
        site: Arc<Site>,
        domain: u32,
        width: Option<GidWidth>,
    ) -> Result<Watcher, String> {
        let discovery = Discovery::listen(&site.participant, Arc::clone(&site.wake))?;
        let nodes = Nodes::open(&site.participant, Arc::clone(&site.wake))?;
        let (overflow, ambiguous) = (Overflow::of(domain), BTreeMap::new());
        Ok(Watcher { discovery, nodes, site, width, is_announced: false, overflow, ambiguous })
    }

    /// Watches the domain until the site's `wake` ends.
    pub(super) fn run(mut self) {
        while self.site.wake.wait(PATIENCE) {
            self.look();
            self.report_overflow();
            self.site.wake.pause(COALESCED);
        }
    }

    /// Takes all changes, and reports them.
    pub(super) fn look(&mut self) {
        // The order matters: participants are discovered before their announcements arrive.
        let heard = self.nodes.take();
        let changes = self.discovery.take();
        if heard.is_empty() && changes.is_empty() {
            let graph = Arc::clone(&self.site.graph.borrow());
            return self.site.adapt_subscriptions(&graph, BTreeSet::new());
        }
        let mut census = self.site.census();
        for change in changes {
            census.apply(change);
        }
        for (info, width) in heard {
            self.is_announced &= self.width.is_some();
            self.width.get_or_insert(width);
            census.hear(info);
        }
        self.is_announced &= !census.take_own_change();
        if !self.is_announced {
            let ours = census.own_nodes(&self.site.namespace, &self.site.node_name);
            census.hear(ours.clone());
            self.is_announced = self.nodes.announce(ours, self.width.unwrap_or(GidWidth::Iron));
        }
        let graph = Arc::new(census.graph());
        drop(census);
        let before = Arc::clone(&self.site.graph.borrow());
        let changed = graph.changed_topics(&before);
        self.report_ambiguity(&graph, &changed);
        self.site.adapt_subscriptions(&graph, changed);
        if *before != *graph {
            self.site.graph.send_replace(graph);
        }
    }

    /// Reports the number of packets dropped because our receive buffers were full.
    fn report_overflow(&mut self) {
        let packets = self.overflow.look(self.site.clock.now());
        if packets > 0 {
            // Without a listener the event is dropped.
            self.site.incidents.send(Incident::Overflow { packets }).ok();
        }
    }

    /// Reports each topic that is published with two types, once for each set of types.
    fn report_ambiguity(&mut self, graph: &Graph, changed: &BTreeSet<Arc<str>>) {
        for topic in changed {
            let Some(types) = census::several_types(graph, topic) else {
                self.ambiguous.remove(topic);
                continue;
            };
            let types: Vec<String> = types.into_iter().collect();
            if self.ambiguous.insert(Arc::clone(topic), types.clone()).as_ref() != Some(&types) {
                let topic = topic.to_string();
                // Without a listener the event is dropped.
                self.site.incidents.send(Incident::TwoTypes { topic, types }).ok();
            }
        }
    }
}
