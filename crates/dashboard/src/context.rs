//! What a dashboard knows about its session from the start, and its settings.

use std::collections::BTreeSet;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::Arc;

use teampulse_core::clock::Clock;
use teampulse_core::status::StreamStatus;
use teampulse_core::stream::Stream;

use crate::addresses::Addresses;
use crate::playhead::Playhead;
use crate::tls::Tls;
use crate::tokens::Tokens;
use crate::wire::{Marker, PhasePlan, RecordingStage, Unmet};

/// The port of a dashboard; if it is taken, the next free one is used.
pub const PORT: u16 = 8742;

/// Where a dashboard listens, and what it offers.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The address. Any address other than a loopback address needs `tokens`.
    pub listen: IpAddr,
    /// The port; by default [`PORT`], or the first free one of the next hundred.
    pub port: Option<u16>,
    /// The tokens of those who may connect; if there are none, everyone may.
    pub tokens: Tokens,
    /// The certificate for https; without one, the dashboard is served over http.
    pub tls: Option<Tls>,
    /// Other names of this computer that a browser may use instead of an address.
    pub names: Vec<String>,
    /// The addresses of this computer, listed for users if the dashboard listens on all of them.
    pub local: Vec<IpAddr>,
    /// The markers of the study.
    pub markers: Vec<Marker>,
}

impl Settings {
    /// The scheme of the dashboard's URL: `http` or `https`.
    pub(crate) fn scheme(&self) -> &'static str {
        if self.tls.is_some() { "https" } else { "http" }
    }

    /// The addresses at which other computers reach the dashboard, if it listens on all of this computer's addresses.
    pub(crate) fn reached_at(&self) -> impl Iterator<Item = IpAddr> {
        let local = if self.listen.is_unspecified() { &*self.local } else { &[] };
        local.iter().copied().filter(|address| !address.is_loopback())
    }

    /// Whether the dashboard listens at the default address: if that fails, the session goes on without a dashboard.
    pub fn is_default(&self) -> bool {
        let is_here = self.listen == IpAddr::V4(Ipv4Addr::LOCALHOST);
        is_here && self.port.is_none() && self.tls.is_none()
    }
}

impl Default for Settings {
    fn default() -> Settings {
        let listen = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let (names, local, markers) = (Vec::new(), Vec::new(), Vec::new());
        Settings { listen, port: None, tokens: Tokens::default(), tls: None, names, local, markers }
    }
}

/// The part of a recording that is on the disk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Disk {
    /// The stage of the recording.
    pub stage: RecordingStage,
    /// The folder of the newest bag; empty before the first.
    pub path: String,
    /// The number of synced bytes.
    pub bytes: u64,
    /// The free space [bytes].
    pub free_bytes: Option<u64>,
    /// How many seconds are kept in memory while the recording is paused [s].
    pub kept_secs: Option<f64>,
    /// Why the recording ended early; empty otherwise.
    pub reason: String,
}

/// The current state of a joined bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BusView {
    /// The name of the bus: `ROS domain 0`.
    pub name: String,
    /// The name of our node on the bus.
    pub node: String,
    /// The number of other participants.
    pub participants: u32,
    /// The topics that these participants publish.
    pub topics: BTreeSet<String>,
}

/// Returns the requirements of a study that are not met by the received raw streams and their status.
pub type FindUnmet = Arc<dyn Fn(&[(Arc<Stream>, StreamStatus)]) -> Vec<Unmet> + Send + Sync>;

/// The session that a dashboard shows.
#[derive(Clone)]
pub struct Context {
    /// The name of the session.
    pub session: String,
    /// The folder of the session's bag; empty if there is none.
    pub path: String,
    /// The clock of the session.
    pub clock: Clock,
    /// The position in the recording that is shown; `None` for a live session.
    pub playhead: Option<Playhead>,
    /// The planned phases of the session.
    pub phases: Vec<PhasePlan>,
    /// The verbs of the commands that `[commands]` allows here.
    pub commands: Vec<&'static str>,
    /// Returns the unmet requirements of the study; `None` if there is no study.
    pub required: Option<FindUnmet>,
    /// Returns the state of the recording on the disk.
    pub disk: Arc<dyn Fn() -> Disk + Send + Sync>,
    /// Returns the name of the next phase.
    pub next_phase: Arc<dyn Fn() -> Option<String> + Send + Sync>,
    /// Returns the buses that were joined.
    pub buses: Arc<dyn Fn() -> Vec<BusView> + Send + Sync>,
    /// Whether some viewers must stay blind.
    pub is_blinding: bool,
    /// Returns whether a stream is hidden from viewers who must stay blind.
    pub hides: Arc<dyn Fn(&Stream) -> bool + Send + Sync>,
    /// Called with the addresses once they are known.
    pub announce: Arc<dyn Fn(&Addresses) + Send + Sync>,
}

impl Context {
    /// A live session that records nothing and hides nothing.
    pub fn new(session: impl Into<String>, clock: Clock) -> Context {
        Context {
            session: session.into(),
            path: String::new(),
            clock,
            playhead: None,
            phases: Vec::new(),
            commands: Vec::new(),
            required: None,
            disk: Arc::new(Disk::default),
            next_phase: Arc::new(|| None),
            buses: Arc::new(Vec::new),
            is_blinding: false,
            hides: Arc::new(|_| false),
            announce: Arc::new(|_| {}),
        }
    }
}

impl fmt::Debug for Context {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context").field("session", &self.session).finish_non_exhaustive()
    }
}
