//! The messages of Foxglove's WebSocket protocol, version 1 (<https://github.com/foxglove/ws-protocol>), as far as they
//! are used here: texts are JSON with an `op`, binary frames begin with a byte that states their kind.

use serde::{Deserialize, Serialize};

/// The subprotocol names that clients may request, the newer one first.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// The header of a message's frame: its kind, the subscription, and the time [bytes].
const HEAD_BYTES: usize = 1 + 4 + 8;
/// The kind of a frame with a message, in either direction.
const MESSAGE: u8 = 1;

/// What the server sends as text.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum FromServer {
    /// The first message.
    ServerInfo {
        /// The name shown to the user.
        name: String,
        /// What clients may do.
        capabilities: [&'static str; 1],
        /// The encodings of the messages that they publish.
        supported_encodings: [&'static str; 1],
        /// An id that is constant during the session.
        session_id: String,
    },
    /// Channels that are new.
    Advertise {
        /// The channels.
        channels: Vec<Channel>,
    },
    /// Channels that are gone.
    Unadvertise {
        /// Their numbers.
        channel_ids: Vec<u32>,
    },
    /// A note to the user.
    Status {
        /// 0 a note, 1 a warning, 2 an error.
        level: u8,
        /// Its text.
        message: String,
    },
}

/// A channel of messages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Channel {
    /// Its number.
    pub id: u32,
    /// Its topic.
    pub topic: String,
    /// `cdr`.
    pub encoding: &'static str,
    /// The type of its messages.
    pub schema_name: String,
    /// The definition of that type.
    pub schema: String,
    /// `ros2msg`, as in the bag.
    pub schema_encoding: String,
}

/// What a client sends as text.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
pub enum FromClient {
    /// Channels that it wants.
    Subscribe {
        /// The subscriptions, each with the client's own number.
        subscriptions: Vec<Subscription>,
    },
    /// Channels that it no longer wants.
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        /// The client's numbers.
        subscription_ids: Vec<u32>,
    },
    /// Channels on which it publishes.
    Advertise {
        /// The channels.
        channels: Vec<ClientChannel>,
    },
    /// Channels on which it no longer publishes.
    #[serde(rename_all = "camelCase")]
    Unadvertise {
        /// Their numbers.
        channel_ids: Vec<u32>,
    },
    /// Messages that are not used here: parameters, services, assets.
    #[serde(other)]
    Other,
}

/// A channel that a client wants.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    /// The client's number.
    pub id: u32,
    /// The channel's number.
    pub channel_id: u32,
}

/// A channel on which a client publishes.
#[derive(Clone, Debug, Deserialize)]
pub struct ClientChannel {
    /// The client's number.
    pub id: u32,
    /// How it is encoded: `json`.
    pub encoding: String,
}

/// The frame of a message for a subscription, at a time [ns since the Unix epoch].
pub fn frame(subscription: u32, time_nanos: i64, message: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(HEAD_BYTES + message.len());
    frame.push(MESSAGE);
    frame.extend_from_slice(&subscription.to_le_bytes());
    frame.extend_from_slice(&u64::try_from(time_nanos).unwrap_or(0).to_le_bytes());
    frame.extend_from_slice(message);
    frame
}

/// The client's channel and the message in a published frame; `None` for any other frame.
pub fn published(frame: &[u8]) -> Option<(u32, &[u8])> {
    let (kind, rest) = frame.split_first()?;
    let (channel, message) = rest.split_first_chunk::<4>()?;
    (*kind == MESSAGE).then(|| (u32::from_le_bytes(*channel), message))
}
