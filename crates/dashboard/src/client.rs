//! A browser connected by WebSocket.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::SplitStream;
use futures_util::{SinkExt, StreamExt};
use teampulse_core::clock::Clock;
use tokio::time::timeout;

use crate::access::Grant;
use crate::acts::{self, Refusal};
use crate::context::{Context, Settings};
use crate::hub::{Hub, Known, message};
use crate::joining::{show_moment, welcome};
use crate::outbox::{Next, Outbox};
use crate::pictures::{Picture, Unshown};
use crate::rate::Allowance;
use crate::wire::{FromBrowser, FromServer, Playback, Pong, Refused, Right, Wanted};

/// The maximum number of clients at once.
pub const MOST_CLIENTS: usize = 64;
/// The largest message from a client [bytes].
pub const LARGEST_BYTES: usize = 64 << 10;
/// The time within which a client must read one message.
const PATIENCE: Duration = Duration::from_secs(10);
/// How much of the waves' past is sent when a client starts to draw them [bytes].
const BACKLOG_BYTES: usize = 128 << 10;
/// The time allowed for sending the reason for closing the connection.
const FAREWELL: Duration = Duration::from_secs(1);
/// The time after which a client that sends nothing, not even a clock probe, is considered gone.
const SILENCE: Duration = Duration::from_secs(60);
/// The messages allowed from a client: per second, and in a burst.
const RATE: (f64, f64) = (100.0, 300.0);
/// The longest reason in a close frame [bytes].
const LONGEST_REASON: usize = 120;

/// A connected browser.
#[derive(Debug)]
pub struct Client {
    /// The number of the client.
    pub number: u64,
    /// The messages that wait to be sent.
    pub outbox: Outbox,
    /// What the client may do.
    pub grant: Grant,
    wanted: Mutex<BTreeMap<u32, Want>>,
    is_unblinded: AtomicBool,
}

/// How a client draws a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Want {
    /// The number of points, or pictures, per second; 0 for all of them.
    pub per_sec: f64,
    /// Whether points are drawn on the pictures in which they were found.
    pub with_points: bool,
}

impl Client {
    /// A client that has just connected.
    pub fn new(grant: Grant) -> Client {
        static CLIENTS: AtomicU64 = AtomicU64::new(0);
        Client {
            number: CLIENTS.fetch_add(1, Ordering::Relaxed),
            outbox: Outbox::default(),
            grant,
            wanted: Mutex::default(),
            is_unblinded: AtomicBool::new(false),
        }
    }

    /// Whether some streams are hidden from the client.
    pub fn is_blind(&self) -> bool {
        !self.is_unblinded.load(Ordering::Acquire)
    }

    /// Stops hiding streams from the client.
    pub fn unblind(&self) {
        self.is_unblinded.store(true, Ordering::Release);
    }

    /// The streams that the client draws, and how.
    pub fn wanted(&self) -> BTreeMap<u32, Want> {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Replaces the streams that the client draws. For each new one, it sends the last half minute of a wave, as far as
    /// that fits, or the newest picture.
    pub fn want(&self, streams: &[Wanted], known: &Known) {
        let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        let before = std::mem::take(&mut *wanted);
        let want =
            |each: &Wanted| Want { per_sec: each.points_per_sec, with_points: each.with_points };
        *wanted = streams.iter().map(|each| (each.stream, want(each))).collect();
        let is_known = |stream: &u32, want: &Want| {
            before.get(stream).is_some_and(|before| before.with_points == want.with_points)
        };
        let new = wanted.iter().filter(|(stream, want)| !is_known(stream, want));
        self.send_recent(new.map(|(stream, want)| (*stream, *want)).collect(), known);
    }

    /// Shows another time of a recording: sends the state at that time, and the recent data of the streams that the
    /// client draws.
    pub fn move_to(&self, playback: Playback, known: &Known) {
        self.outbox.forget();
        self.outbox.urgent(message(&FromServer::Moved(playback)));
        show_moment(known, self);
        self.send_recent(self.wanted().into_iter().collect(), known);
        self.outbox.urgent(message(&FromServer::Ready));
    }

    /// Sends the last half minute of waves, and the newest pictures.
    fn send_recent(&self, mut wanted: Vec<(u32, Want)>, known: &Known) {
        let is_blind = self.is_blind();
        wanted.retain(|(stream, _)| known.shows(*stream, is_blind));
        for (stream, want) in &wanted {
            if let Some(unshown) = known.cameras.unshown(*stream) {
                self.unshown(*stream, unshown);
                continue;
            }
            for picture in known.cameras.start(*stream, want.with_points) {
                self.outbox.picture(picture, want.per_sec);
            }
        }
        wanted.retain(|(stream, _)| !known.cameras.has(*stream));
        let share = BACKLOG_BYTES / wanted.len().max(1);
        for (stream, want) in wanted {
            for frame in known.recent.of(stream, want.per_sec, share) {
                self.outbox.wave(frame.into());
            }
        }
    }
}

impl Client {
    /// Reports why the pictures of a stream can't be shown.
    pub fn unshown(&self, stream: u32, why: &Unshown) {
        let reason = why.to_string();
        self.outbox.urgent(message(&FromServer::Unshown { stream, reason }));
    }
}

/// Serves a browser until either side ends.
pub async fn serve(socket: WebSocket, hub: Arc<Hub>, grant: Grant) {
    let client = Arc::new(Client::new(grant));
    let (mut sender, mut receiver) = socket.split();
    if !welcome(&hub, &client) {
        let reason = format!("{MOST_CLIENTS} viewers are already connected: close one of them");
        farewell(&mut sender, close_code::AGAIN, &reason).await;
        return;
    }
    let (code, reason) = tokio::select! {
        ended = sending(&client, &mut sender) => ended,
        ended = receiving(&hub, &client, &mut receiver) => ended,
    };
    hub.leave(client.number);
    if code == close_code::POLICY {
        hub.count_cut_off();
        tracing::warn!("a viewer of the dashboard was disconnected: {reason}");
    }
    farewell(&mut sender, code, &reason).await;
}

/// Sends waiting messages until the connection ends; returns the code and the reason.
async fn sending(client: &Client, sender: &mut (impl SinkExt<Message> + Unpin)) -> (u16, String) {
    let send = async {
        loop {
            let message = match client.outbox.next().await {
                Next::End(reason) => return (close_code::NORMAL, reason),
                Next::Message(message) => message,
                Next::Picture(picture) => match encoded(client, picture).await {
                    Some(message) => message,
                    None => continue,
                },
            };
            match timeout(PATIENCE, sender.send(message)).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) => return (close_code::NORMAL, String::new()),
                Err(_) => {
                    let reason = format!("the client read nothing for {} s", PATIENCE.as_secs());
                    return (close_code::POLICY, reason);
                }
            }
        }
    };
    tokio::select! {
        ended = send => ended,
        reason = client.outbox.overflow() => (close_code::POLICY, reason),
    }
}

/// Encodes a picture as a message; returns `None`, and reports the reason to the client, if it can't be shown.
async fn encoded(client: &Client, picture: Arc<Picture>) -> Option<Message> {
    let stream = picture.stream;
    // Encoding is moved to another thread, so that other clients need not wait for it.
    let encoded = tokio::task::spawn_blocking(move || picture.encode()).await.ok()?;
    match encoded {
        Ok(bytes) => Some(Message::Binary(bytes)),
        Err(unshown) => {
            client.outbox.shown(stream);
            client.unshown(stream, &unshown);
            None
        }
    }
}

/// Carries out the client's messages until the connection ends; returns the code and the reason.
async fn receiving(
    hub: &Hub,
    client: &Arc<Client>,
    receiver: &mut SplitStream<WebSocket>,
) -> (u16, String) {
    let mut allowance = Allowance::new(RATE.0, RATE.1);
    loop {
        let Ok(received) = timeout(SILENCE, receiver.next()).await else {
            return (
                close_code::NORMAL,
                format!("the client sent nothing for {} s", SILENCE.as_secs()),
            );
        };
        match received {
            Some(Ok(Message::Close(_))) | None => return (close_code::NORMAL, String::new()),
            Some(Ok(_)) if !allowance.take() => {
                let reason = format!("the client sent more than {} messages per second", RATE.0);
                return (close_code::POLICY, reason);
            }
            Some(Ok(Message::Text(text))) => receive(hub, client, text.as_str()),
            Some(Ok(Message::Binary(_))) => {
                let reason = "the client sent a binary frame; expected JSON".to_owned();
                return (close_code::UNSUPPORTED, reason);
            }
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
            Some(Err(error)) => return (close_code::POLICY, error.to_string()),
        }
    }
}

/// Sends the reason for closing the connection, if the client still reads.
async fn farewell(sender: &mut (impl SinkExt<Message> + Unpin), code: u16, reason: &str) {
    let mut end = reason.len().min(LONGEST_REASON);
    while !reason.is_char_boundary(end) {
        end -= 1;
    }
    let close = Message::Close(Some(CloseFrame { code, reason: reason[..end].into() }));
    // Errors are ignored, as the client may be gone.
    drop(timeout(FAREWELL, sender.send(close)).await);
}

/// Handles a text as if a browser had sent it in an empty session; returns the number of bytes waiting to be sent in
/// answer. For fuzzing.
pub fn receive_any(text: &str) -> u64 {
    let context = Context::new("any", Clock::host());
    let hub = Hub::new(context, Settings::default(), None);
    let client = Arc::new(Client::new(Grant { right: Right::Control, address: None }));
    receive(&hub, &client, text);
    client.outbox.waiting_bytes()
}

/// Reads a message and carries it out; answers with a refusal if it can't be read or carried out.
pub fn receive(hub: &Hub, client: &Arc<Client>, text: &str) {
    let received = hub.now();
    let answer = match serde_json::from_str::<FromBrowser>(text) {
        Ok(FromBrowser::Ping { sent }) => {
            Ok(Some(FromServer::Pong(Pong { sent, received, replied: hub.now() })))
        }
        Ok(asked) => {
            let reference = acts::reference(&asked).map(str::to_owned);
            acts::act(hub, client, asked).map_err(|refusal| (reference, refusal))
        }
        Err(error) => {
            let reason = format!("failed to read a message: {error}");
            Err((None, Refusal::new(reason, "reload the page")))
        }
    };
    let answer = answer.unwrap_or_else(|(reference, refusal)| {
        let Refusal { reason, hint, .. } = refusal;
        Some(FromServer::Refused(Refused { reference, reason, hint }))
    });
    if let Some(answer) = answer {
        client.outbox.urgent(message(&answer));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_text_is_answered_or_ignored_in_a_few_bytes(
            kind in "ping|want|history|command|note|acknowledge|report|show_estimates|[a-z]{0,9}",
            text in ".{0,300}",
            (number, at) in (any::<f64>(), any::<Option<f64>>()),
        ) {
            prop_assert!(receive_any(&text) < 2000);
            let message = serde_json::json!({
                "type": kind, "reference": text, "text": text, "at": at, "alert": text, "scale": text, "value": number,
            });
            prop_assert!(receive_any(&message.to_string()) < 10_000);
            for fields in ["reference text at", "reference alert at", "reference scale subject value at", "reference"] {
                let fields = fields.split(' ').filter_map(|name| Some((name.to_owned(), message.get(name)?.clone())));
                let mut some: serde_json::Map<_, _> = fields.collect();
                some.insert("type".into(), kind.clone().into());
                prop_assert!(receive_any(&serde_json::Value::from(some).to_string()) < 10_000);
            }
        }
    }
}
