use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use teampulse_emulators::devices::{Advertisement, Notice, Peripheral, Service, Wearer};
use tokio::sync::{mpsc, oneshot};
use zbus::Variant;
use zbus::object_server::ResponseDispatchListener;

use super::central::{ADAPTER_PATH, Central};
use super::error::BluezError;
use super::gatt::CHARACTERISTIC;
use super::{EmulatedDevice, LinkFault};

/// A device, shared by the objects on D-Bus and the task of its link.
#[derive(Clone)]
pub(super) struct Handle(Arc<Shared>);

struct Shared {
    path: String,
    address: String,
    central: Arc<Central>,
    advertisement: Advertisement,
    state: Mutex<State>,
    requests: mpsc::Sender<Request>,
}

/// The changing state of a device.
pub(super) struct State {
    pub peripheral: Box<dyn Peripheral>,
    wearer: Box<dyn Wearer + Send>,
    pub is_connected: bool,
    pub is_resolved: bool,
    pub is_trusted: bool,
    pub rssi_dbm: i16,
    /// The last value of each characteristic.
    pub values: BTreeMap<u128, Vec<u8>>,
    /// The clients that subscribed to each characteristic.
    pub listeners: BTreeMap<u128, BTreeSet<String>>,
}

/// A request to the task of a link; `Answer` is sent when it is done.
pub(super) enum Request {
    Connect(Answer),
    /// Disconnects, after the reply to the client has been sent.
    Disconnect(Answer, ResponseDispatchListener),
    Remove(Answer),
    Suffer(LinkFault, Answer),
}

pub(super) type Answer = oneshot::Sender<Result<(), BluezError>>;

/// The largest number of requests that may wait for a device.
const REQUESTS: usize = 64;

impl Handle {
    pub fn new(device: EmulatedDevice, central: &Arc<Central>) -> (Self, mpsc::Receiver<Request>) {
        let (requests, receiver) = mpsc::channel(REQUESTS);
        let EmulatedDevice { address, peripheral, wearer, .. } = device;
        let address = address.to_uppercase();
        let shared = Shared {
            path: format!("{ADAPTER_PATH}/dev_{}", address.replace(':', "_")),
            address,
            central: Arc::clone(central),
            advertisement: peripheral.advertisement(),
            state: Mutex::new(State {
                peripheral,
                wearer,
                is_connected: false,
                is_resolved: false,
                is_trusted: false,
                rssi_dbm: -60,
                values: BTreeMap::new(),
                listeners: BTreeMap::new(),
            }),
            requests,
        };
        (Self(Arc::new(shared)), receiver)
    }

    pub fn path(&self) -> &str {
        &self.0.path
    }

    pub fn address(&self) -> &str {
        &self.0.address
    }

    pub fn central(&self) -> &Arc<Central> {
        &self.0.central
    }

    pub fn advertisement(&self) -> &Advertisement {
        &self.0.advertisement
    }

    pub fn state(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the state of a connected device, or else the error with which BlueZ refuses requests.
    pub fn connected(&self) -> Result<MutexGuard<'_, State>, BluezError> {
        let state = self.state();
        if state.is_connected { Ok(state) } else { Err(BluezError::Failed("Not connected".into())) }
    }

    pub fn services(&self) -> &'static [Service] {
        self.state().peripheral.services()
    }

    /// The path of a service of this device.
    pub fn service_path(&self, handle: u16) -> String {
        format!("{}/service{handle:04x}", self.path())
    }

    pub async fn connect(&self) -> Result<(), BluezError> {
        self.ask(Request::Connect).await
    }

    pub async fn disconnect(&self, replied: ResponseDispatchListener) -> Result<(), BluezError> {
        self.ask(|answer| Request::Disconnect(answer, replied)).await
    }

    pub async fn remove(&self) -> Result<(), BluezError> {
        self.ask(Request::Remove).await
    }

    pub async fn suffer(&self, fault: LinkFault) -> Result<(), BluezError> {
        self.ask(|answer| Request::Suffer(fault, answer)).await
    }

    async fn ask(&self, request: impl FnOnce(Answer) -> Request) -> Result<(), BluezError> {
        let (answer, answered) = oneshot::channel();
        let ended = || BluezError::Failed("the emulation has ended".into());
        self.0.requests.send(request(answer)).await.map_err(|_closed| ended())?;
        answered.await.map_err(|_dropped| ended())?
    }

    /// Subscribes a client to a characteristic.
    pub fn listen(&self, characteristic: u128, client: String) -> Result<(), BluezError> {
        let mut state = self.connected()?;
        state.peripheral.subscribe(characteristic)?;
        state.listeners.entry(characteristic).or_default().insert(client);
        Ok(())
    }

    /// Ends the subscription of a client to a characteristic; returns whether there was one.
    pub fn unlisten(&self, characteristic: u128, client: &str) -> bool {
        let mut state = self.state();
        let Some(listeners) = state.listeners.get_mut(&characteristic) else { return false };
        let was_there = listeners.remove(client);
        if listeners.is_empty() {
            state.listeners.remove(&characteristic);
            state.peripheral.unsubscribe(characteristic);
        }
        was_there
    }

    /// Ends the subscriptions of a client that left the bus.
    pub fn forget(&self, client: &str) {
        let characteristics: Vec<u128> = self.state().listeners.keys().copied().collect();
        for characteristic in characteristics {
            self.unlisten(characteristic, client);
        }
    }

    /// Returns the data that the device has sent since the last call.
    pub fn sent(&self) -> Vec<Notice> {
        let mut state = self.state();
        let secs = self.central().now_secs();
        let State { peripheral, wearer, .. } = &mut *state;
        peripheral.until(secs, wearer.as_mut())
    }

    /// Stores the value of a characteristic and emits its change, as BlueZ does for notifications and reads.
    pub async fn value(&self, characteristic: u128, value: Vec<u8>) -> zbus::Result<()> {
        let Some(path) = self.characteristic_path(characteristic) else { return Ok(()) };
        self.state().values.insert(characteristic, value.clone());
        self.central().changed(&path, CHARACTERISTIC, "Value", Variant::from(value)).await
    }

    fn characteristic_path(&self, characteristic: u128) -> Option<String> {
        self.services().iter().find_map(|service| {
            let entry = service.characteristics.iter().find(|entry| entry.uuid == characteristic);
            entry.map(|entry| self.entry_path(service.handle, entry.handle))
        })
    }

    /// The path of a characteristic of a service.
    pub fn entry_path(&self, service: u16, handle: u16) -> String {
        format!("{}/char{handle:04x}", self.service_path(service))
    }
}
