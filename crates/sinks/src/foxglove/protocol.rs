//! The messages of Foxglove's WebSocket protocol, version 1 (<https://github.com/foxglove/ws-protocol>), as far as they
//! are used here. Text messages are JSON with an `op`; binary frames begin with a byte that states their kind.

use serde::{Deserialize, Serialize};

/// The subprotocol names that clients may request, the newer one first.
pub const SUBPROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// The header of a message's frame: its kind, the subscription, and the time [bytes].
const HEAD_BYTES: usize = 1 + 4 + 8;
/// The kind of a frame with a message, in either direction.
const MESSAGE: u8 = 1;

/// A text message from the server.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum FromServer {
    /// The first message.
    ServerInfo {
        /// The name shown to the user.
        name: String,
        /// The capabilities that clients may use.
        capabilities: [&'static str; 1],
        /// The encodings in which clients may publish messages.
        supported_encodings: [&'static str; 1],
        /// An id that is constant during the session.
        session_id: String,
    },
    /// New channels.
    Advertise {
        /// The channels.
        channels: Vec<Channel>,
    },
    /// Channels that no longer exist.
    Unadvertise {
        /// The numbers of the channels.
        channel_ids: Vec<u32>,
    },
    /// A note to the user.
    Status {
        /// The severity: 0 for a note, 1 for a warning, 2 for an error.
        level: u8,
        /// The text of the note.
        message: String,
    },
}

/// A channel of messages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Channel {
    /// The number of the channel.
    pub id: u32,
    /// The topic of the channel.
    pub topic: String,
    /// The encoding of the messages: `cdr`.
    pub encoding: &'static str,
    /// The type of the messages.
    pub schema_name: String,
    /// The definition of that type.
    pub schema: String,
    /// The encoding of the definition: `ros2msg`, as in the bag.
    pub schema_encoding: String,
}

/// A text message from a client.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
pub enum FromClient {
    /// Subscribes to channels.
    Subscribe {
        /// The subscriptions, each with the client's own number.
        subscriptions: Vec<Subscription>,
    },
    /// Ends subscriptions.
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        /// The client's numbers for the subscriptions.
        subscription_ids: Vec<u32>,
    },
    /// Announces channels on which the client publishes.
    Advertise {
        /// The channels.
        channels: Vec<ClientChannel>,
    },
    /// Announces that the client no longer publishes on channels.
    #[serde(rename_all = "camelCase")]
    Unadvertise {
        /// The client's numbers for the channels.
        channel_ids: Vec<u32>,
    },
    /// Messages that are not used here: parameters, services, assets.
    #[serde(other)]
    Other,
}

/// A client's subscription to a channel.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    /// The client's number for the subscription.
    pub id: u32,
    /// The channel's number.
    pub channel_id: u32,
}

/// A channel on which a client publishes.
#[derive(Clone, Debug, Deserialize)]
pub struct ClientChannel {
    /// The client's number for the channel.
    pub id: u32,
    /// The encoding of the messages: `json`.
    pub encoding: String,
}

/// Encodes a message for a subscription, at a time [ns since the Unix epoch], as a frame.
pub fn frame(subscription: u32, time_nanos: i64, message: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(HEAD_BYTES + message.len());
    frame.push(MESSAGE);
    frame.extend_from_slice(&subscription.to_le_bytes());
    frame.extend_from_slice(&u64::try_from(time_nanos).unwrap_or(0).to_le_bytes());
    frame.extend_from_slice(message);
    frame
}

/// Returns the client's channel and the message in a published frame; `None` for any other frame.
pub fn published(frame: &[u8]) -> Option<(u32, &[u8])> {
    let (kind, rest) = frame.split_first()?;
    let (channel, message) = rest.split_first_chunk::<4>()?;
    (*kind == MESSAGE).then(|| (u32::from_le_bytes(*channel), message))
}
