//! Actions of clients, as read back from the session.

use std::sync::Arc;

use teampulse_core::clock::Stopwatch;

use crate::client::Client;
use crate::context::Disk;
use crate::hub::{Awaited, message};
use crate::wire::{Echo, FromServer, RecordingStage};

/// How many syncs must follow a record before it is surely on the disk: the first may have begun before it.
const SYNCS: u64 = 2;

/// How long after a sync all records before it are surely on the disk, if there are no further syncs: twice the time
/// between two syncs of a bag [s].
const SETTLED_SECS: f64 = 2.0;

/// Actions whose records are not yet on the disk.
#[derive(Debug, Default)]
pub struct Echoes {
    waiting: Vec<(u64, u64, Echo)>,
    syncs: u64,
    synced_bytes: u64,
    synced: Option<Stopwatch>,
    is_recorded: bool,
}

impl Echoes {
    /// Sends the echo of an action that is among the records, with its time [s] and how far that is off [s].
    pub fn add(
        &mut self,
        act: Awaited,
        label: String,
        (t, off_secs): (f64, Option<f64>),
        clients: &[Arc<Client>],
    ) {
        let on_disk = self.is_recorded.then_some(false);
        let echo = Echo { reference: act.reference, label, t, off_secs, on_disk };
        send(act.client, &echo, clients);
        if self.is_recorded {
            self.waiting.push((self.syncs + SYNCS, act.client, echo));
        }
    }

    /// Sends the echoes of actions that are on the disk by now.
    pub fn look(&mut self, disk: &Disk, clients: &[Arc<Client>]) {
        self.is_recorded = disk.stage == RecordingStage::Open;
        if disk.bytes > self.synced_bytes {
            self.syncs += 1;
            self.synced = Some(Stopwatch::start());
        }
        self.synced_bytes = disk.bytes;
        let is_settled =
            self.synced.is_some_and(|synced| synced.elapsed().as_secs_f64() >= SETTLED_SECS);
        // In a session in which nothing else happens there is one sync only.
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
