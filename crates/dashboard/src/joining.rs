//! What a client receives when it joins: everything known so far.

use std::sync::Arc;

use crate::client::{Client, MOST_CLIENTS};
use crate::history::STORED_SECS;
use crate::hub::{Hub, Known, json, message};
use crate::outbox::StateKind;
use crate::wire::{FromServer, Hello, Mode, PROTOCOL, Right, Timeline, Viewer};

/// Sends a client everything known so far, and subscribes it to everything new; returns whether there was room for it.
pub fn welcome(hub: &Hub, client: &Arc<Client>) -> bool {
    // No records are taken while this is locked, so that nothing is sent twice or skipped.
    let known = hub.known();
    if !hub.join(client, MOST_CLIENTS) {
        return false;
    }
    let context = &hub.context;
    client.outbox.urgent(message(&FromServer::Hello(Hello {
        protocol: PROTOCOL,
        session: context.session.clone(),
        version: env!("CARGO_PKG_VERSION"),
        mode: if context.playhead.is_some() { Mode::Replay } else { Mode::Live },
        began_unix_ms: hub.began().nanos() as f64 / 1e6,
        now: hub.now(),
        stored_secs: STORED_SECS,
        viewer: viewer(hub, client),
        markers: hub.settings.markers.clone(),
        phases: context.phases.clone(),
    })));
    show(&known, client);
    let (recording, unmet) = (known.recording.clone(), known.unmet.clone());
    drop(known);
    if let Some(unmet) = unmet {
        client.outbox.urgent(message(&FromServer::Required { unmet }));
    }
    if let Some(recording) = recording {
        client.outbox.urgent(message(&FromServer::Recording(recording)));
    }
    if let Some(playback) = hub.playback() {
        client.outbox.urgent(message(&FromServer::Playback(playback)));
    }
    if let Some(timeline) = hub.timeline() {
        client.outbox.urgent(message(&FromServer::Timeline(Timeline::clone(&timeline))));
    }
    let name = (context.next_phase)();
    client.outbox.urgent(message(&FromServer::NextPhase { name }));
    client.outbox.urgent(message(&FromServer::Ready));
    true
}

/// Sends a client everything that it may see.
pub fn show(known: &Known, client: &Client) {
    let is_blind = client.is_blind();
    let streams = known.declared(known.streams.keys().copied(), is_blind);
    client.outbox.urgent(message(&streams));
    show_moment(known, client);
}

/// Sends a client the newest data of everything that it may see.
pub fn show_moment(known: &Known, client: &Client) {
    let is_blind = client.is_blind();
    for (id, health) in &known.health {
        client.outbox.state(StateKind::Status, *id, known.health_t, json(health).into());
    }
    let features = known.features.iter().filter(|(id, _)| known.shows(**id, is_blind));
    for (id, feature) in features {
        client.outbox.state(StateKind::Feature, *id, feature.t, json(&**feature).into());
    }
    let samples = known.samples.iter().filter(|(id, _)| known.shows(**id, is_blind));
    for (id, sample) in samples {
        client.outbox.state(StateKind::Sample, *id, sample.t, json(&**sample).into());
    }
    for kept in &known.events {
        let shown = kept.iter().filter(|(id, _)| known.shows(*id, is_blind));
        let events: Vec<&str> = shown.map(|(_, event)| &**event).collect();
        for events in events.chunks(500) {
            let text = format!(r#"{{"type":"events","events":[{}]}}"#, events.join(","));
            client.outbox.urgent(text);
        }
    }
}

/// Describes a viewer to its own browser.
fn viewer(hub: &Hub, client: &Client) -> Viewer {
    let grant = &client.grant;
    let allowed =
        |verb: &&str| grant.right >= if *verb == "mark" { Right::Mark } else { Right::Control };
    Viewer {
        name: grant.sender().to_string(),
        right: grant.right,
        commands: hub.context.commands.iter().copied().filter(allowed).collect(),
        blind: client.is_blind() && hub.context.is_blinding,
    }
}
