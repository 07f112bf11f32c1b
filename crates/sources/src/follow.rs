//! Following topics on a bus: from the appearance of a publisher to offered samples.
//!
//! ```text
//! a publisher on the graph ── choose ──► the stream that its topic becomes, or none
//!   subscribing: declares the stream and subscribes to the topic
//!     messages from elsewhere: verbatim ──────────────────────────────► Outlet::offer
//!     our own types:           publisher_split ──► decoding ──────────► Outlet::offer
//! ```
//!
//! Beside that path: later information about a type or a stream (`definitions`, `describing`), the publishers of a
//! topic (`origins`), and losses (`losses`).

mod subscribing;
mod followed;
mod verbatim;
mod stamped;
mod publisher_split;
mod publishers;
mod decoding;
mod definitions;
mod describing;
mod updates;
mod origins;
mod publishing;
mod losses;
mod loss_counter;
mod numbers;
mod places;
mod incidents;
mod stamping;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::SourceError;
use teampulse_core::stream::{Schema, Stream};
use teampulse_messages::convert::Decoded;
use teampulse_ros::bus::{Arrival, Bus, BusError};
use teampulse_ros::graph::{Endpoint, Graph};
use tokio::sync::broadcast::error::RecvError;
use tokio::task::JoinSet;

use definitions::Type;
use followed::Followed;
pub(crate) use loss_counter::LossCounter;
use places::Places;
use publishing::Key;
pub(crate) use publishing::{offered, who};
pub(crate) use updates::Updates;

/// How many times publishers are checked after each change: reports are made at the second check.
const LOOKS: u32 = 3;
/// Counted losses are reported at least this often.
const REPORT_LOSSES: Duration = Duration::from_millis(500);

/// Follows the topics of a bus until the session is over, and keeps their messages as received. `choose` returns the
/// stream that a publisher's topic becomes, or `None` if the topic is not wanted; this function fills in the stream's
/// shape, offered QoS and losses.
pub(crate) async fn follow(
    bus: Arc<dyn Bus>,
    outlet: &Outlet,
    choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
) -> Result<(), SourceError> {
    Following::new(bus, outlet, Kept::AsTheyCame).run(choose, &Updates::default()).await
}

/// Follows topics of teampulse's own types, whose messages are decoded. `choose` sets their shape; it is called again
/// for the topics in `updates`, as descriptions may arrive at any time. A topic without a description has the channels
/// of its first messages.
pub(crate) async fn follow_ours(
    bus: Arc<dyn Bus>,
    outlet: &Outlet,
    choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
    updates: &Updates,
) -> Result<(), SourceError> {
    Following::new(bus, outlet, Kept::Decoded).run(choose, updates).await
}

/// Follows topics of foreign types whose messages have no stamps: `read` returns the decoder of a publisher's topic.
/// Samples are timed by their arrival here, as neither the messages nor the bus know when they were measured.
pub(crate) async fn follow_decoded(
    bus: Arc<dyn Bus>,
    outlet: &Outlet,
    choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
    read: &DecoderOf<'_>,
) -> Result<(), SourceError> {
    Following::new(bus, outlet, Kept::Read(read)).run(choose, &Updates::default()).await
}

/// Decodes a message into a sample, or returns `None` if the sample is not complete yet; an error fits after "failed
/// to".
pub(crate) type Decoder = Arc<dyn Fn(&Arrival) -> Result<Option<Decoded>, String> + Send + Sync>;

/// Returns the decoder of a publisher's topic.
pub(crate) type DecoderOf<'a> = dyn Fn(&Endpoint) -> Result<Decoder, String> + Sync + 'a;

/// How messages are kept.
#[derive(Clone, Copy)]
enum Kept<'a> {
    /// Byte for byte.
    AsTheyCame,
    /// As samples of teampulse's own types.
    Decoded,
    /// As samples decoded from foreign types.
    Read(&'a DecoderOf<'a>),
}

/// The followed topics of a bus.
struct Following<'a> {
    bus: Arc<dyn Bus>,
    outlet: &'a Outlet,
    kept: Kept<'a>,
    followed: BTreeMap<Key, Followed>,
    /// Problems that have been reported; each is reported once.
    reported: BTreeSet<String>,
    /// The topics that are published from several places, and whether that has been reported.
    several: BTreeMap<Key, bool>,
    places: Places,
    definitions: JoinSet<(Type, Result<Schema, BusError>)>,
    /// The topics that wait for the definition of their type.
    undefined: BTreeMap<Type, Vec<Key>>,
    /// The definitions that were found.
    defined: BTreeMap<Type, Schema>,
}

impl<'a> Following<'a> {
    fn new(bus: Arc<dyn Bus>, outlet: &'a Outlet, kept: Kept<'a>) -> Following<'a> {
        Following {
            bus,
            outlet,
            kept,
            followed: BTreeMap::new(),
            reported: BTreeSet::new(),
            several: BTreeMap::new(),
            places: Places::default(),
            definitions: JoinSet::new(),
            undefined: BTreeMap::new(),
            defined: BTreeMap::new(),
        }
    }

    async fn run(
        mut self,
        choose: impl Fn(&Endpoint) -> Option<Stream> + Send,
        updates: &Updates,
    ) -> Result<(), SourceError> {
        let mut graph = self.bus.graph();
        let mut incidents = self.bus.incidents();
        let mut report_losses = tokio::time::interval(REPORT_LOSSES);
        // There may be thousands of topics, so only those that changed are visited.
        let (mut seen, mut looks) = (Arc::<Graph>::default(), 0);
        loop {
            let before = std::mem::replace(&mut seen, Arc::clone(&graph.borrow_and_update()));
            if !Arc::ptr_eq(&before, &seen) {
                for topic in seen.changed_topics(&before) {
                    self.subscribe_to_wanted(&topic, &seen, &choose);
                    self.look_at_publishers_of(&topic, &seen);
                    self.describe_anew(&topic, &seen, &choose);
                }
                looks = LOOKS;
            }
            tokio::select! {
                changed = graph.changed() => if changed.is_err() {
                    return Err(bus_closed());
                },
                incident = incidents.recv() => match incident {
                    Ok(incident) => self.report_incident(&incident),
                    Err(RecvError::Lagged(_)) => {}
                    Err(RecvError::Closed) => return Err(bus_closed()),
                },
                Some(Ok((of, found))) = self.definitions.join_next() => self.learn(of, found),
                topics = updates.next() => for topic in topics {
                    self.describe_anew(&topic, &seen, &choose);
                },
                _ = report_losses.tick() => {
                    self.report_losses();
                    self.describe_all_anew(&seen, &choose);
                    self.look_at_publishers(&seen);
                    if looks > 0 {
                        looks -= 1;
                        self.report_several(&seen);
                        self.report_publishers(&seen);
                    }
                }
                () = self.outlet.closed() => {
                    self.close();
                    return Ok(());
                }
            }
        }
    }

    /// Hands over waiting messages, and reports the last losses.
    fn close(&mut self) {
        let graph = Arc::clone(&self.bus.graph().borrow());
        for (key, followed) in &self.followed {
            followed.close(&publishing::gids(key, &graph).collect());
        }
        self.report_last_losses();
    }

    /// Records a fault.
    fn fault(&self, label: String) {
        self.outlet.happen(passing(label));
    }
}

fn bus_closed() -> SourceError {
    SourceError::Gone { message: "follow the bus: it was closed".into(), hint: String::new() }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
