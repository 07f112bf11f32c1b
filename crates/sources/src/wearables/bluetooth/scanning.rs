//! One scan shared by all searches for a device: `BlueZ` refuses a second scan from the same program.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::timeout;
use zbus::{Connection, Variant};

use super::bus::{Bus, Object, PATIENCE, Refusal, State, call};
use super::objects::{ADAPTER, Objects};

/// How often the scan is requested again: an adapter that was switched off and on has forgotten the request.
const AGAIN: Duration = Duration::from_secs(10);

/// The number of searches that need a scan, and of connections being made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Demand {
    scans: usize,
    connections: usize,
}

impl Demand {
    /// Whether to scan: many adapters can't connect while they scan.
    fn wants_scan(self) -> bool {
        self.scans > 0 && self.connections == 0
    }
}

/// Keeps the scan on.
pub(super) struct Scan<'a>(&'a Bus);

/// Keeps the scan paused.
pub(super) struct Pause<'a>(&'a Bus);

impl Bus {
    /// Scans until the returned value is dropped.
    pub fn scan(&self) -> Scan<'_> {
        self.demand.send_modify(|demand| demand.scans += 1);
        Scan(self)
    }

    /// Pauses all scans until the returned value is dropped.
    pub fn pause_scan(&self) -> Pause<'_> {
        self.demand.send_modify(|demand| demand.connections += 1);
        Pause(self)
    }
}

impl Drop for Scan<'_> {
    fn drop(&mut self) {
        self.0.demand.send_modify(|demand| demand.scans -= 1);
    }
}

impl Drop for Pause<'_> {
    fn drop(&mut self) {
        self.0.demand.send_modify(|demand| demand.connections -= 1);
    }
}

/// Returns the adapter to use: the first one that is powered.
pub(super) fn adapter(objects: &Objects) -> Option<&str> {
    let works = objects.adapters.iter().filter(|(_, adapter)| adapter.powered != Some(false));
    works.map(|(path, _)| path.as_str()).next()
}

/// Switches scanning on and off on demand, until the bus is dropped.
pub(super) async fn run(
    connection: Connection,
    state: Arc<State>,
    mut demand: watch::Receiver<Demand>,
) {
    let mut scanning: Option<String> = None;
    loop {
        let wanted = demand.borrow_and_update().wants_scan();
        if wanted {
            let found = state.until(AGAIN, |objects| adapter(objects).map(str::to_owned)).await;
            let Ok(found) = found else { return };
            if let Some(path) = found {
                // A request that fails is repeated; whatever waits for a device reports that it was not found.
                drop(switch_on(&connection, &path).await);
                scanning = Some(path);
            }
        } else if let Some(path) = scanning.take() {
            drop(ask(&connection, &path, "StopDiscovery").await);
        }
        let change = demand.changed();
        let changed =
            if wanted { timeout(AGAIN, change).await.unwrap_or(Ok(())) } else { change.await };
        if changed.is_err() {
            return;
        }
    }
}

async fn switch_on(connection: &Connection, adapter: &str) -> Result<(), Refusal> {
    let filter = BTreeMap::from([("Transport", Variant::from("le"))]);
    call(connection, Object::bluez(adapter, ADAPTER), "SetDiscoveryFilter", &filter, PATIENCE)
        .await?;
    ask(connection, adapter, "StartDiscovery").await
}

async fn ask(connection: &Connection, adapter: &str, method: &str) -> Result<(), Refusal> {
    call(connection, Object::bluez(adapter, ADAPTER), method, &(), PATIENCE).await.map(drop)
}
