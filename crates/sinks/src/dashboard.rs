//! The dashboard of a session, in a browser.

use std::collections::BTreeSet;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_bag::Stage;
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Sink;
use teampulse_dashboard::wire::{Marker, PhasePlan, RecordingStage};
use teampulse_dashboard::{Addresses, BusView, Context, Disk, FindUnmet, Settings, Tls, Tokens};
use teampulse_ros::bus::Bus;
use teampulse_ros::graph::EndpointKind;

use crate::SinkContext;
use crate::local_addresses::local_addresses;
use crate::terminal::{Estimates, Kept};

/// The commands that a dashboard may send unless `[commands]` says otherwise: on loopback, everyone who can reach the
/// dashboard has an account on this computer, and none of these commands loses data.
pub const ALLOWED: [&str; 6] =
    ["mark", "next_phase", "repeat_phase", "abort_phase", "start_recording", "snapshot"];

/// Shows the team in a browser, and takes markers, notes and commands from it. Every session has it at
/// <http://127.0.0.1:8742> unless `dashboard = false`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Dashboard {
    /// The address to listen on. Any address other than a loopback address needs `tokens`.
    pub listen: IpAddr,
    /// The port; by default 8742, or the next free one.
    pub port: Option<u16>,
    /// A file with one token per line: `watch`, `mark` or `control`, then 16 or more letters and digits. A viewer opens
    /// `/?token=…`; programs send it as `Authorization: Bearer …`.
    pub tokens: Option<PathBuf>,
    /// A certificate in PEM, followed by the certificates that sign it; with it, the dashboard is served over https.
    /// Needs `key`.
    pub certificate: Option<PathBuf>,
    /// The private key of the `certificate` in PEM, without a passphrase.
    pub key: Option<PathBuf>,
    /// Other names of this computer by which browsers may open the dashboard.
    pub names: Vec<String>,
    /// The markers of the study, as buttons and keys.
    pub markers: Vec<MarkerSettings>,
}

/// A marker of the study.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkerSettings {
    /// The label: `robot lost`.
    pub label: String,
    /// The key, a letter or a digit; without it, there is only a button.
    pub key: Option<char>,
}

impl Default for Dashboard {
    fn default() -> Dashboard {
        let listen = IpAddr::V4(Ipv4Addr::LOCALHOST);
        let (names, markers) = (Vec::new(), Vec::new());
        let (certificate, key) = (None, None);
        Dashboard { listen, port: None, tokens: None, certificate, key, names, markers }
    }
}

/// What a dashboard knows about its session, in addition to what all sinks know.
#[derive(Clone, Default)]
pub struct DashboardContext {
    /// The phases of the study.
    pub phases: Vec<PhasePlan>,
    /// The verbs of the commands that the dashboard may send.
    pub commands: Vec<&'static str>,
    /// The markers that the study's keys set, besides those of the dashboard's own settings.
    pub markers: Vec<MarkerSettings>,
    /// Returns the requirements of the study that the received streams do not meet.
    pub required: Option<FindUnmet>,
    /// Called with the addresses of the dashboard.
    pub announce: Option<Announce>,
}

/// A function that is called with the addresses of a dashboard.
pub type Announce = Arc<dyn Fn(&Addresses) + Send + Sync>;

impl fmt::Debug for DashboardContext {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DashboardContext").field("commands", &self.commands).finish_non_exhaustive()
    }
}

impl Component<dyn Sink, SinkContext> for Dashboard {
    const EXAMPLE: &'static str =
        "port = 8080\nmarkers = [{ label = \"robot lost\", key = \"l\" }]";

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let is_open = !self.listen.is_loopback();
        if is_open && self.tokens.is_none() {
            let message = format!(
                "without tokens, anybody on the network could see the team at {}",
                self.listen
            );
            let hint = "set `tokens` to a file of tokens, or listen on 127.0.0.1";
            return Err(SettingsError::new(message).at("listen").with_hint(hint));
        }
        let odd =
            |marker: &MarkerSettings| marker.key.is_some_and(|key| !key.is_ascii_alphanumeric());
        if let Some(place) = self.markers.iter().position(odd) {
            let error = SettingsError::new("the key of a marker is a letter or a digit");
            return Err(error.at(format!("markers.{place}.key")));
        }
        let marker = |marker: MarkerSettings| Marker {
            key: marker.key.map(String::from).unwrap_or_default(),
            label: marker.label,
        };
        let has_own = |key| self.markers.iter().any(|own| own.key == key);
        let of_keys = context.dashboard.markers.iter().filter(|other| !has_own(other.key)).cloned();
        let markers = self.markers.iter().cloned().chain(of_keys);
        let tokens = self.tokens.as_deref().map(Tokens::read).transpose();
        let tokens = tokens.map_err(|error| {
            let message = format!("failed to {error}");
            SettingsError::new(message).at("tokens").with_hint(error.hint())
        })?;
        let tokens = tokens.unwrap_or_default();
        let tls = tls(self.certificate.as_deref(), self.key.as_deref())?;
        let settings = Settings {
            listen: self.listen,
            port: self.port,
            tokens,
            tls,
            names: self.names,
            local: local_addresses().into_iter().map(IpAddr::V4).collect(),
            markers: markers.map(marker).collect(),
        };
        Ok(Box::new(teampulse_dashboard::Dashboard::new(session(context), settings)))
    }
}

/// Reads the certificate and its key.
fn tls(certificate: Option<&Path>, key: Option<&Path>) -> Result<Option<Tls>, SettingsError> {
    let alone = |setting, message: &str, hint: &str| {
        Err(SettingsError::new(message).at(setting).with_hint(hint))
    };
    match (certificate, key) {
        (None, None) => Ok(None),
        (Some(certificate), Some(key)) => Tls::read(certificate, key).map(Some).map_err(|error| {
            let setting = error.file().setting();
            SettingsError::new(format!("failed to {error}")).at(setting).with_hint(error.hint())
        }),
        (Some(_), None) => {
            let hint = "name its file: `key = \"key.pem\"`; it may be the same file";
            alone("certificate", "a certificate needs its private key", hint)
        }
        (None, Some(_)) => {
            let hint = "name its file: `certificate = \"certificate.pem\"`";
            alone("key", "a key needs its certificate", hint)
        }
    }
}

/// The session as seen by the dashboard.
fn session(context: &SinkContext) -> Context {
    let estimates = context.terminal.estimates;
    let kept = context.terminal.kept.clone();
    let next = context.terminal.next.clone();
    let announce = context.dashboard.announce.clone();
    let buses = Arc::clone(&context.ros.buses);
    let announcements = context.announcements.clone();
    let path = matches!(kept, Kept::Bag(_)).then(|| context.bag.display().to_string());
    Context {
        path: path.unwrap_or_default(),
        phases: context.dashboard.phases.clone(),
        commands: context.dashboard.commands.clone(),
        required: context.dashboard.required.clone(),
        disk: Arc::new(move || disk(&kept)),
        buses: Arc::new(move || buses.joined().iter().map(|bus| seen(&**bus)).collect()),
        next_phase: Arc::new(move || next.as_ref().and_then(|next| next())),
        is_blinding: estimates == Estimates::Hidden,
        hides: Arc::new(move |stream| estimates.hide(stream)),
        announce: Arc::new(move |addresses| {
            addresses.lines().into_iter().for_each(|line| announcements.add(line));
            if let Some(announce) = &announce {
                announce(addresses);
            }
        }),
        ..Context::new(context.session.clone(), context.clock.clone())
    }
}

/// The current state of a bus, without our own endpoints.
fn seen(bus: &dyn Bus) -> BusView {
    let graph = bus.graph().borrow().clone();
    let others = || graph.endpoints().filter(|each| !each.own);
    let services = graph.services().filter(|each| !each.own).map(|each| each.gid.participant());
    let participants: BTreeSet<_> =
        others().map(|each| each.gid.participant()).chain(services).collect();
    let published = others().filter(|each| each.kind == EndpointKind::Publisher);
    BusView {
        name: bus.name(),
        node: bus.node(),
        participants: participants.len() as u32,
        topics: published.map(|each| each.topic.clone()).collect(),
    }
}

/// The part of a recording that is on the disk.
fn disk(kept: &Kept) -> Disk {
    let empty = |stage| Disk { stage, ..Disk::default() };
    let growth = match kept {
        Kept::Nothing => return empty(RecordingStage::Nothing),
        Kept::Tables => return empty(RecordingStage::Tables),
        Kept::Bag(growth) => growth.on_disk(),
    };
    let (mut reason, mut kept_secs) = (String::new(), None);
    let stage = match growth.stage {
        Stage::NotBegun => RecordingStage::NotBegun,
        Stage::Open => RecordingStage::Open,
        Stage::Paused { kept_secs: secs } => {
            kept_secs = Some(secs);
            RecordingStage::Paused
        }
        Stage::Finished => RecordingStage::Finished,
        Stage::EndedEarly(why) => {
            reason = why;
            RecordingStage::EndedEarly
        }
    };
    let (path, bytes) = (growth.folder.display().to_string(), growth.synced_bytes);
    Disk { stage, path, bytes, free_bytes: growth.free_bytes, kept_secs, reason }
}
