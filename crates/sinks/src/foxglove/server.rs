//! The connections of viewers.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::http::header::ORIGIN;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::any;
use futures_util::stream::SplitStream;
use futures_util::{SinkExt, StreamExt};
use teampulse_core::command::{Command, Sender};
use teampulse_core::counted::counted;
use teampulse_core::outlet::Outlet;
use teampulse_dashboard::loopback::{is_for_this_computer, is_this_computer, name_of};
use tokio::net::TcpListener;
use tokio::time::timeout;

use super::client::Client;
use super::protocol::{Channel, FromClient, FromServer, SUBPROTOCOLS, published};

/// The maximum number of clients at once.
const MOST_CLIENTS: usize = 16;
/// The largest message from a client [bytes].
const LARGEST_BYTES: usize = 1 << 20;
/// The maximum number of channels on which a client may publish.
const MOST_PUBLISHED: usize = 64;
/// The time within which a client must read one message.
const PATIENCE: Duration = Duration::from_secs(10);
/// The origins of Foxglove's web app.
const KNOWN_ORIGINS: [&str; 2] = ["https://app.foxglove.dev", "https://studio.foxglove.dev"];

/// The state shared by the sink's thread and the connections.
pub(super) struct Shared {
    name: String,
    session_id: String,
    origins: Vec<String>,
    outlet: Option<Outlet>,
    channels: Mutex<BTreeMap<u32, Channel>>,
    clients: Mutex<Vec<Arc<Client>>>,
}

impl Shared {
    pub(super) fn new(session: &str, origins: Vec<String>, outlet: Option<Outlet>) -> Shared {
        let began = outlet.as_ref().map_or(0, |outlet| outlet.clock().now().nanos());
        Shared {
            name: format!("teampulse {session}"),
            session_id: format!("{session} {began}"),
            origins,
            outlet,
            channels: Mutex::default(),
            clients: Mutex::default(),
        }
    }

    /// Advertises channels to current and future viewers.
    pub(super) fn advertise(&self, channels: Vec<Channel>) {
        // A client that joins now waits for the lock, so it gets each channel exactly once.
        let mut known = self.channels();
        known.extend(channels.iter().map(|channel| (channel.id, channel.clone())));
        self.text(&FromServer::Advertise { channels });
    }

    pub(super) fn unadvertise(&self, ids: &[u32]) {
        let mut known = self.channels();
        known.retain(|id, _| !ids.contains(id));
        self.text(&FromServer::Unadvertise { channel_ids: ids.to_vec() });
    }

    /// Sends a message to the clients that have subscribed to its channel.
    pub(super) fn send(&self, channel: u32, time_nanos: i64, message: &[u8]) {
        for client in &*self.clients() {
            client.message(channel, time_nanos, message);
        }
    }

    /// Whether any client has subscribed to a channel.
    pub(super) fn is_wanted(&self, channel: u32) -> bool {
        self.clients().iter().any(|client| client.wants(channel))
    }

    /// Reports to each client the samples that were skipped before they reached this sink, and the messages for which
    /// the client was too slow.
    pub(super) fn report_skipped(&self, before: u64) {
        let warning = |message: String| FromServer::Status { level: 1, message };
        for client in &*self.clients() {
            if before > 0 {
                client.text(&warning(format!(
                    "{} skipped: this computer is busy",
                    counted(before, "sample was", "samples were")
                )));
            }
            if let Some(skipped) = client.skipped() {
                let skipped = counted(skipped, "message was", "messages were");
                let message = format!("{skipped} skipped: this connection is too slow");
                client.text(&warning(message));
            }
        }
    }

    /// Ends all connections at the end of the session.
    pub(super) fn end(&self) {
        self.clients().iter().for_each(|client| client.end());
    }

    fn text(&self, message: &FromServer) {
        self.clients().iter().for_each(|client| client.text(message));
    }

    /// Adds a client, and sends it all current channels; returns whether there was room.
    fn join(&self, client: &Arc<Client>) -> bool {
        let known = self.channels();
        let mut clients = self.clients();
        if clients.len() >= MOST_CLIENTS {
            return false;
        }
        client.text(&FromServer::ServerInfo {
            name: self.name.clone(),
            capabilities: ["clientPublish"],
            supported_encodings: ["json"],
            session_id: self.session_id.clone(),
        });
        client.text(&FromServer::Advertise { channels: known.values().cloned().collect() });
        clients.push(Arc::clone(client));
        true
    }

    fn leave(&self, client: &Arc<Client>) {
        self.clients().retain(|each| !Arc::ptr_eq(each, client));
    }

    /// Sets a marker with the published text; returns the reason if it was refused.
    fn mark(&self, message: &[u8]) -> Result<(), String> {
        let json: serde_json::Value = serde_json::from_slice(message)
            .map_err(|error| format!("failed to read the published message: {error}"))?;
        let text = |key: &str| json.get(key).and_then(serde_json::Value::as_str);
        let Some(label) = text("label").or_else(|| text("data")).map(str::trim) else {
            return Err("a marker is an object with a text in `label` or `data`".to_owned());
        };
        let outlet = self.outlet.as_ref().ok_or("no session is running")?;
        let command: Command =
            format!("mark {label}").parse().map_err(|error| format!("failed to {error}"))?;
        let sender = Sender::through("foxglove", "");
        outlet.command(&sender, command).map_err(|refused| format!("`mark` was refused: {refused}"))
    }

    fn channels(&self) -> MutexGuard<'_, BTreeMap<u32, Channel>> {
        self.channels.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn clients(&self) -> MutexGuard<'_, Vec<Arc<Client>>> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a request comes from a program on this computer, or from a page that may connect.
    fn admits(&self, headers: &HeaderMap) -> bool {
        if !is_for_this_computer(headers) {
            return false;
        }
        let Some(origin) = headers.get(ORIGIN) else { return true };
        let Ok(origin) = origin.to_str() else { return false };
        // The desktop apps do not belong to a site.
        let is_desktop = origin.starts_with("file://") || origin.starts_with("app://");
        let name = origin.split_once("://").map_or("", |(_, rest)| name_of(rest));
        let is_listed = self.origins.iter().any(|each| each.trim_end_matches('/') == origin);
        is_desktop || is_this_computer(name) || KNOWN_ORIGINS.contains(&origin) || is_listed
    }
}

/// Serves until the listener fails.
pub(super) async fn run(listener: TcpListener, shared: Arc<Shared>) -> io::Result<()> {
    let routes = Router::new().fallback(any(connect)).with_state(shared);
    axum::serve(listener, routes).await
}

async fn connect(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, axum::extract::ws::rejection::WebSocketUpgradeRejection>,
) -> Response {
    if !shared.admits(&headers) {
        let reason =
            "pages of other sites may not connect unless their origins are listed in `origins`\n";
        return (StatusCode::FORBIDDEN, reason).into_response();
    }
    let Ok(upgrade) = upgrade else {
        let hint = "open this address in Foxglove or Lichtblick as a Foxglove WebSocket\n";
        return (StatusCode::UPGRADE_REQUIRED, hint).into_response();
    };
    upgrade
        .protocols(SUBPROTOCOLS)
        .max_message_size(LARGEST_BYTES)
        .max_frame_size(LARGEST_BYTES)
        .on_upgrade(move |socket| serve(socket, shared))
}

/// Serves a viewer until either side ends.
async fn serve(socket: WebSocket, shared: Arc<Shared>) {
    let client = Arc::new(Client::default());
    let (mut sender, mut receiver) = socket.split();
    let is_joined = shared.join(&client);
    let reason = if is_joined {
        tokio::select! {
            reason = sending(&client, &mut sender) => reason,
            () = receiving(&shared, &client, &mut receiver) => None,
        }
    } else {
        Some("too many viewers are already connected: close one of them")
    };
    shared.leave(&client);
    if let Some(reason) = reason {
        let close = CloseFrame { code: close_code::AWAY, reason: reason.into() };
        // Errors are ignored, as the client may be gone.
        drop(timeout(PATIENCE, sender.send(Message::Close(Some(close)))).await);
    }
}

/// Sends waiting messages until the connection ends; returns the reason, if the client may still receive it.
async fn sending(
    client: &Client,
    sender: &mut (impl SinkExt<Message> + Unpin),
) -> Option<&'static str> {
    while let Some(message) = client.next().await {
        match timeout(PATIENCE, sender.send(message)).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return None,
            Err(_) => return Some("the viewer read nothing for 10 s"),
        }
    }
    Some("the session is over")
}

/// Carries out the client's messages until the connection ends.
async fn receiving(shared: &Shared, client: &Client, receiver: &mut SplitStream<WebSocket>) {
    let mut publishing = BTreeSet::new();
    while let Some(Ok(message)) = receiver.next().await {
        take(shared, client, &mut publishing, &message);
    }
}

/// Handles a message of a client; if it can't be read or carried out, the user gets a note.
fn take(shared: &Shared, client: &Client, publishing: &mut BTreeSet<u32>, message: &Message) {
    let taken = match message {
        Message::Text(text) => {
            let asked = serde_json::from_str(text.as_str());
            let asked = asked.map_err(|error| format!("failed to read a message: {error}"));
            asked.and_then(|asked| answer(client, publishing, asked))
        }
        Message::Binary(frame) => match published(frame) {
            Some((channel, content)) if publishing.contains(&channel) => shared.mark(content),
            Some(_) => Err("a message on a channel that was not advertised".to_owned()),
            None => Err("a frame of an unknown kind".to_owned()),
        },
        Message::Ping(_) | Message::Pong(_) | Message::Close(_) => Ok(()),
    };
    if let Err(message) = taken {
        client.text(&FromServer::Status { level: 2, message });
    }
}

fn answer(
    client: &Client,
    publishing: &mut BTreeSet<u32>,
    asked: FromClient,
) -> Result<(), String> {
    match asked {
        FromClient::Subscribe { subscriptions } => {
            let is_room = |all: bool, each: &super::protocol::Subscription| {
                client.subscribe(each.id, each.channel_id) && all
            };
            if !subscriptions.iter().fold(true, is_room) {
                return Err("too many subscriptions".to_owned());
            }
        }
        FromClient::Unsubscribe { subscription_ids } => {
            for id in subscription_ids {
                client.unsubscribe(id);
            }
        }
        FromClient::Advertise { channels } => {
            for channel in channels {
                if channel.encoding != "json" || publishing.len() >= MOST_PUBLISHED {
                    let reason =
                        format!("channel {}: expected JSON, on at most 64 channels", channel.id);
                    return Err(reason);
                }
                publishing.insert(channel.id);
            }
        }
        FromClient::Unadvertise { channel_ids } => {
            publishing.retain(|id| !channel_ids.contains(id));
        }
        FromClient::Other => {}
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use axum::http::header::HOST;

    use super::*;

    #[test]
    fn pages_of_other_sites_are_refused_and_viewers_are_not() {
        let shared = Shared::new("test", vec!["https://viewer.lab.example".into()], None);
        let admits = |host: &'static str, origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(HOST, host.parse().unwrap());
            if let Some(origin) = origin {
                headers.insert(ORIGIN, origin.parse().unwrap());
            }
            shared.admits(&headers)
        };
        for origin in [
            None,
            Some("https://app.foxglove.dev"),
            Some("http://localhost:8080"),
            Some("file://"),
            Some("https://viewer.lab.example"),
        ] {
            assert!(admits("localhost:8765", origin), "{origin:?}");
            assert!(!admits("rebound.example:8765", origin), "{origin:?}");
        }
        for origin in ["https://evil.example", "http://localhost.evil.example", "null"] {
            assert!(!admits("127.0.0.1:8765", Some(origin)), "{origin}");
        }
    }

    #[test]
    fn anything_that_a_client_sends_is_answered_or_ignored() {
        let shared = Shared::new("test", Vec::new(), None);
        let (client, mut publishing) = (Client::default(), BTreeSet::new());
        let mut sent = |message| take(&shared, &client, &mut publishing, &message);
        for text in [
            "",
            "{",
            r#"{"op":"fetchAsset"}"#,
            r#"{"op":"subscribe"}"#,
            r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967295}]}"#,
            r#"{"op":"advertise","channels":[{"id":1,"encoding":"json","topic":"/x","schemaName":"y"}]}"#,
            r#"{"op":"advertise","channels":[{"id":2,"encoding":"cdr"}]}"#,
        ] {
            sent(Message::Text(text.into()));
        }
        for frame in [&[][..], &[1], &[9; 40], &[1, 1, 0, 0, 0], &[1, 1, 0, 0, 0, b'{', b'}']] {
            sent(Message::Binary(frame.to_vec().into()));
        }
        assert!(client.wants(u32::MAX));
    }
}
