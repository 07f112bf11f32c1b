//! Actions of clients, as read back from the session.

use std::sync::Arc;

use teampulse_core::clock::Stopwatch;

use crate::client::Client;
use crate::context::Disk;
use crate::hub::{Awaited, message};
use crate::wire::{Echo, FromServer, RecordingStage};

/// The number of syncs after which a record is certainly on the disk: the first may have started before the record.
const SYNCS: u64 = 2;

/// How long after a sync all earlier records are certainly on the disk if no other sync follows: twice the interval
/// between two syncs of a bag [s].
const SETTLED_SECS: f64 = 2.0;

/// Actions whose records are not yet on the disk.
#[derive(Debug, Default)]
pub struct Echoes {
    waiting: Vec<(u64, u64, Echo)>,
    syncs: u64,
    synced_bytes: u64,
    synced: Option<Stopwatch>,
}

impl Echoes {
    /// Sends the echo of a recorded action, with the action's time [s] and its deviation from the requested time [s].
    ///
    /// A recording that is starting also contains the action: it starts with all records that wait for it.
    pub fn add(
        &mut self,
        act: Awaited,
        label: String,
        (t, off_secs): (f64, Option<f64>),
        (stage, clients): (RecordingStage, &[Arc<Client>]),
    ) {
        let is_recorded = matches!(stage, RecordingStage::NotBegun | RecordingStage::Open);
        let on_disk = is_recorded.then_some(false);
        let echo = Echo { reference: act.reference, label, t, off_secs, on_disk };
        send(act.client, &echo, clients);
        if is_recorded {
            self.waiting.push((self.syncs + SYNCS, act.client, echo));
        }
    }

    /// Sends the echoes of actions that are now on the disk.
    pub fn look(&mut self, disk: &Disk, clients: &[Arc<Client>]) {
        if disk.bytes > self.synced_bytes {
            self.syncs += 1;
            self.synced = Some(Stopwatch::start());
        }
        self.synced_bytes = disk.bytes;
        let is_settled =
            self.synced.is_some_and(|synced| synced.elapsed().as_secs_f64() >= SETTLED_SECS);
        // In a session in which nothing else happens, only one sync follows.
        let syncs = self.syncs + u64::from(is_settled);
        for (_, client, mut echo) in self.waiting.extract_if(.., |(due, _, _)| *due <= syncs) {
            echo.on_disk = Some(true);
            send(client, &echo, clients);
        }
    }
}

fn send(client: u64, echo: &Echo, clients: &[Arc<Client>]) {
    if let Some(client) = clients.iter().find(|each| each.number == client) {
        client.outbox.urgent(message(&FromServer::Echo(echo.clone())));
    }
}

#[cfg(test)]
mod tests {
    use axum::extract::ws::Message;
    use teampulse_core::data::EventKind;
    use teampulse_core::time::Time;

    use super::*;
    use crate::access::Grant;
    use crate::outbox::Next;
    use crate::wire::Right;

    /// What a client hears of an action in a recording at a stage, and after a number of syncs: `on_disk` of each echo.
    async fn heard(stage: RecordingStage, syncs: u64) -> Vec<Option<bool>> {
        let client = Arc::new(Client::new(Grant { right: Right::Control, address: None }));
        let clients = [client.clone()];
        let act = Awaited {
            client: client.number,
            reference: "a".to_owned(),
            kind: EventKind::Marker,
            at: Time::EPOCH,
            is_timed: false,
        };
        let mut echoes = Echoes::default();
        echoes.add(act, "tap".to_owned(), (0.0, None), (stage, &clients));
        for bytes in 1..=syncs {
            echoes.look(&Disk { stage: RecordingStage::Open, bytes, ..Disk::default() }, &clients);
        }
        client.outbox.end("over");
        let mut heard = Vec::new();
        while let Next::Message(Message::Text(text)) = client.outbox.next().await {
            let echo: serde_json::Value = serde_json::from_str(&text).unwrap();
            heard.push(echo["on_disk"].as_bool());
        }
        heard
    }

    #[tokio::test]
    async fn an_action_before_the_first_sync_is_on_the_disk_after_the_second() {
        for stage in [RecordingStage::NotBegun, RecordingStage::Open] {
            assert_eq!(heard(stage, 1).await, [Some(false)]);
            assert_eq!(heard(stage, 2).await, [Some(false), Some(true)]);
        }
    }

    #[tokio::test]
    async fn an_action_in_a_session_without_a_bag_is_never_on_the_disk() {
        assert_eq!(heard(RecordingStage::Nothing, 2).await, [None]);
    }
}
