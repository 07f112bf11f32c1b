use std::collections::{BTreeSet, HashMap};
use std::sync::{Mutex, PoisonError};

use teampulse_core::clock::Stopwatch;
use zbus::object_server::SignalEmitter;
use zbus::{Connection, Variant};

pub(super) const ADAPTER_PATH: &str = "/org/bluez/hci0";

/// The state shared by the objects: the connection, and which clients are discovering.
#[derive(Debug)]
pub(super) struct Central {
    pub connection: Connection,
    /// The time base of all devices and their wearers.
    pub clock: Stopwatch,
    discovering: Mutex<BTreeSet<String>>,
    powered: Mutex<bool>,
}

impl Central {
    pub fn new(connection: Connection, clock: Stopwatch) -> Self {
        Self { connection, clock, discovering: Mutex::default(), powered: Mutex::new(true) }
    }

    /// The true time of the emulation [s].
    pub fn now_secs(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    pub fn is_discovering(&self) -> bool {
        self.is_powered() && !self.discoverers(|clients| clients.is_empty())
    }

    pub fn is_powered(&self) -> bool {
        *self.powered.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn power(&self, on: bool) {
        *self.powered.lock().unwrap_or_else(PoisonError::into_inner) = on;
        if !on {
            self.discoverers(BTreeSet::clear);
        }
    }

    /// Reads or changes the set of clients that are discovering.
    pub fn discoverers<T>(&self, change: impl FnOnce(&mut BTreeSet<String>) -> T) -> T {
        change(&mut self.discovering.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Emits `PropertiesChanged` for one property of an object.
    pub async fn changed(
        &self,
        path: &str,
        interface: &str,
        property: &str,
        value: Variant<'_>,
    ) -> zbus::Result<()> {
        self.emit(path, interface, HashMap::from([(property, value)]), &[]).await
    }

    /// Emits `PropertiesChanged` for a property of an object that no longer has a value.
    pub async fn invalidated(
        &self,
        path: &str,
        interface: &str,
        property: &str,
    ) -> zbus::Result<()> {
        self.emit(path, interface, HashMap::new(), &[property]).await
    }

    async fn emit(
        &self,
        path: &str,
        interface: &str,
        changed: HashMap<&str, Variant<'_>>,
        invalidated: &[&str],
    ) -> zbus::Result<()> {
        let emitter = SignalEmitter::new(&self.connection, path)?;
        emitter.emit(PROPERTIES, "PropertiesChanged", &(interface, changed, invalidated)).await
    }
}

const PROPERTIES: &str = "org.freedesktop.DBus.Properties";
