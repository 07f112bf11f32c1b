//! One viewer: its subscriptions and waiting messages.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};

use axum::extract::ws::Message;
use tokio::sync::Notify;

use super::protocol::{FromServer, frame};

/// The maximum amount of data waiting for a client; beyond it, the oldest messages are skipped [bytes].
const MOST_BYTES: usize = 8 << 20;
/// The maximum number of subscriptions of a client.
const MOST_WANTED: usize = 4096;

/// A connected viewer.
#[derive(Debug, Default)]
pub(super) struct Client {
    state: Mutex<State>,
    wake: Notify,
}

#[derive(Debug, Default)]
struct State {
    /// The client's subscription numbers, by channel.
    wanted: BTreeMap<u32, Vec<u32>>,
    texts: VecDeque<String>,
    frames: VecDeque<Vec<u8>>,
    bytes: usize,
    skipped: u64,
    reported: u64,
    is_over: bool,
}

impl Client {
    /// Adds a text message, which is never skipped.
    pub(super) fn text(&self, message: &FromServer) {
        let Ok(text) = serde_json::to_string(message) else { return };
        self.lock().texts.push_back(text);
        self.wake.notify_one();
    }

    /// Adds a message of a channel, if the client has subscribed to it.
    pub(super) fn message(&self, channel: u32, time_nanos: i64, message: &[u8]) {
        let mut state = self.lock();
        let Some(wanted) = state.wanted.get(&channel) else { return };
        let frames: Vec<_> = wanted.iter().map(|id| frame(*id, time_nanos, message)).collect();
        for frame in frames {
            state.bytes += frame.len();
            state.frames.push_back(frame);
        }
        while state.bytes > MOST_BYTES {
            let Some(oldest) = state.frames.pop_front() else { break };
            state.bytes -= oldest.len();
            state.skipped += 1;
        }
        drop(state);
        self.wake.notify_one();
    }

    /// Whether the client has subscribed to a channel.
    pub(super) fn wants(&self, channel: u32) -> bool {
        self.lock().wanted.contains_key(&channel)
    }

    /// Subscribes to a channel under the client's own number; returns whether there was room.
    pub(super) fn subscribe(&self, id: u32, channel: u32) -> bool {
        let mut state = self.lock();
        let count: usize = state.wanted.values().map(Vec::len).sum();
        if count >= MOST_WANTED {
            return false;
        }
        state.wanted.entry(channel).or_default().push(id);
        true
    }

    /// Ends the subscription with this number.
    pub(super) fn unsubscribe(&self, id: u32) {
        self.lock().wanted.retain(|_, ids| {
            ids.retain(|each| *each != id);
            !ids.is_empty()
        });
    }

    /// The number of skipped messages, if it has grown since the last call.
    pub(super) fn skipped(&self) -> Option<u64> {
        let mut state = self.lock();
        let skipped = state.skipped;
        (std::mem::replace(&mut state.reported, skipped) != skipped).then_some(skipped)
    }

    /// Marks that nothing more will be sent.
    pub(super) fn end(&self) {
        self.lock().is_over = true;
        self.wake.notify_one();
    }

    /// Waits for the next message; `None` at the end.
    pub(super) async fn next(&self) -> Option<Message> {
        loop {
            let woken = self.wake.notified();
            {
                let mut state = self.lock();
                if let Some(text) = state.texts.pop_front() {
                    return Some(Message::Text(text.into()));
                }
                if let Some(frame) = state.frames.pop_front() {
                    state.bytes -= frame.len();
                    return Some(Message::Binary(frame.into()));
                }
                if state.is_over {
                    return None;
                }
            }
            woken.await;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_client_that_does_not_read_skips_the_oldest_and_holds_a_bounded_memory() {
        let client = Client::default();
        assert!(client.subscribe(7, 1));
        let message = vec![0; MOST_BYTES / 4];
        for time in 0..10 {
            client.message(1, time, &message);
            client.message(2, time, &message);
        }
        assert!(client.lock().bytes <= MOST_BYTES);
        assert_eq!((client.skipped(), client.skipped()), (Some(7), None));
        let Some(Message::Binary(first)) = client.next().await else { panic!("a message waits") };
        assert_eq!(first[..13], [1, 7, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0]);
        client.unsubscribe(7);
        assert!(!client.wants(1));
    }

    #[test]
    fn a_client_wants_a_bounded_number() {
        let client = Client::default();
        let taken = (0..10_000).filter(|id| client.subscribe(*id, 1)).count();
        assert_eq!(taken, MOST_WANTED);
    }
}
