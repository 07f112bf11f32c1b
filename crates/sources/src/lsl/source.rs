//! All streams that match a query, as they come and go.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use teampulse_core::clock::Stopwatch;
use teampulse_core::fault::passing;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::SourceError;
use teampulse_devices::lsl::StreamInfo;
use tokio::task::{JoinError, JoinSet};
use tokio::time::sleep;

use super::Lsl;
use super::connection::InletError;
use super::described::{leaf, slug};
use super::inlet::Inlet;
use super::resolver::{FoundStream, Resolver};
use super::senders::SenderClocks;

/// The time between queries while a stream is missing, and while none is.
const OFTEN: Duration = Duration::from_millis(500);
const SELDOM: Duration = Duration::from_secs(3);
/// How long finding a stream may take before its absence is reported.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long a stream is left alone after a failure.
const PAUSE: Duration = Duration::from_secs(1);
/// The largest number of streams of a source.
const MOST: usize = 64;

/// The identity of a stream, which remains when its sender restarts.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Identity {
    name: String,
    kind: String,
    source_id: String,
}

impl Identity {
    fn of(info: &StreamInfo) -> Identity {
        let StreamInfo { name, kind, source_id, .. } = info;
        Identity { name: name.clone(), kind: kind.clone(), source_id: source_id.clone() }
    }
}

/// The streams of a query.
pub(super) struct Inlets {
    settings: Lsl,
    query: String,
    clocks: SenderClocks,
    /// Streams that are not read at present, as their sender is away.
    away: Vec<(Identity, Inlet)>,
    /// The device names that are taken, each with the last token of the topic.
    names: BTreeSet<(String, String)>,
    /// Whether it has been reported that there are too many streams.
    is_crowded: bool,
    /// Whether streams of teampulse itself were left out.
    has_own: bool,
}

/// How an inlet ended.
struct Ended {
    identity: Identity,
    uid: String,
    inlet: Inlet,
    result: Result<(), InletError>,
}

impl Inlets {
    pub fn new(settings: Lsl, query: String) -> Inlets {
        Inlets {
            settings,
            query,
            clocks: SenderClocks::default(),
            away: Vec::new(),
            names: BTreeSet::new(),
            is_crowded: false,
            has_own: false,
        }
    }

    /// Reads all streams until the session is over.
    pub async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let opened = Resolver::open(self.query.clone(), self.settings.peers.clone());
        let mut resolver = opened.map_err(|error| SourceError::Gone {
            message: format!("search for LSL streams: {error}"),
            hint: "check that this computer is on a network".into(),
        })?;
        let mut running: JoinSet<Ended> = JoinSet::new();
        let mut read = BTreeSet::new();
        let mut failed: BTreeMap<String, Stopwatch> = BTreeMap::new();
        let (began, mut is_reported) = (Stopwatch::start(), false);
        resolver.ask().await;
        let mut asked = Stopwatch::start();
        loop {
            let is_complete = !running.is_empty() && self.away.is_empty();
            let pause = if is_complete { SELDOM } else { OFTEN };
            tokio::select! {
                found = resolver.next() => {
                    failed.retain(|_, since| since.elapsed() < PAUSE);
                    let is_new = !read.contains(&found.info.uid) && !failed.contains_key(&found.info.uid);
                    let is_read = self.settings.reads(&found.info);
                    self.has_own |= !is_read;
                    if is_new && is_read {
                        if running.len() >= MOST {
                            self.report_crowd(outlet);
                        } else {
                            read.insert(found.info.uid.clone());
                            self.begin(found, outlet, &mut running);
                        }
                    }
                }
                Some(ended) = running.join_next() => {
                    let ended = joined(ended);
                    read.remove(&ended.uid);
                    failed.insert(ended.uid.clone(), Stopwatch::start());
                    self.take_ended(ended, outlet);
                }
                () = sleep(pause.saturating_sub(asked.elapsed())) => {
                    resolver.ask().await;
                    asked = Stopwatch::start();
                    if running.is_empty() && self.away.is_empty() && !is_reported && began.elapsed() > PATIENCE {
                        is_reported = true;
                        self.report_nothing(outlet);
                    }
                }
                () = outlet.closed() => break,
            }
        }
        // The tasks end with the session.
        while let Some(ended) = running.join_next().await {
            joined(ended);
        }
        Ok(())
    }

    fn report_nothing(&self, outlet: &Outlet) {
        let query = &self.query;
        let label = if self.has_own {
            format!(
                "lsl: only teampulse itself offers streams with {query}; set `name` to read one of them"
            )
        } else {
            format!(
                "lsl: no stream with {query} is found; is its program running, and on the same network? `teampulse scan` \
                 lists the streams in range"
            )
        };
        outlet.happen(passing(label));
    }

    fn begin(&mut self, found: FoundStream, outlet: &Outlet, running: &mut JoinSet<Ended>) {
        let identity = Identity::of(&found.info);
        let known = self.away.iter().position(|(known, _)| *known == identity);
        let mut inlet = match known {
            Some(place) => self.away.swap_remove(place).1,
            None => Inlet::new(
                self.settings.person.clone(),
                self.device(&found.info),
                self.clocks.clone(),
            ),
        };
        let (outlet, uid) = (outlet.clone(), found.info.uid.clone());
        running.spawn(async move {
            let result = inlet.run(&found, &outlet).await;
            Ended { identity, uid, inlet, result }
        });
    }

    /// Returns a device name that no other stream of this source has.
    fn device(&mut self, info: &StreamInfo) -> String {
        let (slug, leaf) = (slug(&info.name), leaf(info));
        let numbered = (2..).map(|number| format!("{slug}_{number}"));
        let mut names = std::iter::once(slug.clone()).chain(numbered);
        let name = names.find(|name| self.names.insert((name.clone(), leaf.clone())));
        name.unwrap_or_default()
    }

    fn take_ended(&mut self, ended: Ended, outlet: &Outlet) {
        let Ended { identity, inlet, result, .. } = ended;
        if let Err(error) = result {
            outlet.happen(passing(format!(
                "lsl: the stream {} failed to {error}; it is read again when its sender is back",
                identity.name
            )));
        }
        self.away.push((identity, inlet));
    }

    fn report_crowd(&mut self, outlet: &Outlet) {
        if !std::mem::replace(&mut self.is_crowded, true) {
            let query = &self.query;
            outlet.happen(passing(format!(
                "lsl: more than {MOST} streams with {query}: the others are not read"
            )));
        }
    }
}

/// Returns the result of a task; its panic is resumed here, and caught further up.
fn joined(ended: Result<Ended, JoinError>) -> Ended {
    ended.unwrap_or_else(|error| std::panic::resume_unwind(error.into_panic()))
}
