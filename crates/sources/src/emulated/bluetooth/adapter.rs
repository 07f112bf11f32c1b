#![expect(
    clippy::unused_self,
    clippy::used_underscore_binding,
    reason = "methods of an interface have the receiver and the arguments that it defines"
)]

use std::collections::HashMap;
use std::sync::Arc;

use zbus::message::Header;
use zbus::{OwnedObjectPath, Variant, interface};

use super::central::{ADAPTER_PATH, Central};
use super::device::Handle;
use super::error::BluezError;

pub(super) const ADAPTER: &str = "org.bluez.Adapter1";

/// `org.bluez.Adapter1`: the radio.
pub(super) struct Adapter {
    pub central: Arc<Central>,
    pub devices: Vec<Handle>,
}

impl Adapter {
    async fn announce(&self, discovering: bool) -> Result<(), BluezError> {
        let value = Variant::from(discovering);
        Ok(self.central.changed(ADAPTER_PATH, ADAPTER, "Discovering", value).await?)
    }
}

#[interface(name = "org.bluez.Adapter1", introspection_docs = false)]
impl Adapter {
    async fn start_discovery(&self, #[zbus(header)] header: Header<'_>) -> Result<(), BluezError> {
        if !self.central.is_powered() {
            return Err(BluezError::Failed("Resource Not Ready".into()));
        }
        let client = sender(&header);
        let (is_new, count) =
            self.central.discoverers(|clients| (clients.insert(client), clients.len()));
        match (is_new, count) {
            (false, _) => Err(BluezError::InProgress("Operation already in progress".into())),
            (true, 1) => self.announce(true).await,
            (true, _) => Ok(()),
        }
    }

    async fn stop_discovery(&self, #[zbus(header)] header: Header<'_>) -> Result<(), BluezError> {
        let client = sender(&header);
        let (was_on, count) =
            self.central.discoverers(|clients| (clients.remove(&client), clients.len()));
        match (was_on, count) {
            (false, _) => Err(BluezError::Failed("No discovery started".into())),
            (true, 0) => self.announce(false).await,
            (true, _) => Ok(()),
        }
    }

    fn set_discovery_filter(&self, _properties: HashMap<String, Variant<'_>>) {}

    fn get_discovery_filters(&self) -> Vec<&'static str> {
        vec!["UUIDs", "RSSI", "Pathloss", "Transport", "DuplicateData"]
    }

    async fn remove_device(&self, device: OwnedObjectPath) -> Result<(), BluezError> {
        let found = self.devices.iter().find(|one| one.path() == device.as_str());
        let found = found.ok_or_else(|| BluezError::DoesNotExist("Does Not Exist".into()))?;
        found.remove().await
    }

    #[zbus(property)]
    fn address(&self) -> &'static str {
        "00:1A:7D:DA:71:13"
    }

    #[zbus(property)]
    fn address_type(&self) -> &'static str {
        "public"
    }

    #[zbus(property)]
    fn name(&self) -> &'static str {
        "teampulse"
    }

    #[zbus(property)]
    fn alias(&self) -> &'static str {
        "teampulse"
    }

    #[zbus(property)]
    fn class(&self) -> u32 {
        0
    }

    #[zbus(property)]
    fn powered(&self) -> bool {
        self.central.is_powered()
    }

    #[zbus(property)]
    fn set_powered(&self, on: bool) {
        self.central.power(on);
    }

    #[zbus(property)]
    fn discoverable(&self) -> bool {
        false
    }

    #[zbus(property)]
    fn discoverable_timeout(&self) -> u32 {
        0
    }

    #[zbus(property)]
    fn pairable(&self) -> bool {
        false
    }

    #[zbus(property)]
    fn pairable_timeout(&self) -> u32 {
        0
    }

    #[zbus(property)]
    fn discovering(&self) -> bool {
        self.central.is_discovering()
    }

    #[zbus(property, name = "UUIDs")]
    fn uuids(&self) -> Vec<String> {
        Vec::new()
    }

    #[zbus(property)]
    fn modalias(&self) -> &'static str {
        "usb:v1D6Bp0246d0542"
    }

    #[zbus(property)]
    fn roles(&self) -> Vec<&'static str> {
        vec!["central"]
    }
}

/// The caller.
pub(super) fn sender(header: &Header<'_>) -> String {
    header.sender().map(ToString::to_string).unwrap_or_default()
}
