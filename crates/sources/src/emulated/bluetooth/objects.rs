#![expect(clippy::unused_self, reason = "methods of an interface have a receiver")]

use std::collections::HashMap;

use zbus::object_server::ResponseDispatchNotifier;
use zbus::{ObjectPath, OwnedObjectPath, Variant, interface};

use super::central::ADAPTER_PATH;
use super::device::Handle;
use super::error::BluezError;
use super::gatt::text;

pub(super) const DEVICE: &str = "org.bluez.Device1";

/// `org.bluez.Device1`: a device that was in range.
pub(super) struct Device(pub Handle);

#[interface(name = "org.bluez.Device1", introspection_docs = false)]
impl Device {
    async fn connect(&self) -> Result<(), BluezError> {
        self.0.connect().await
    }

    async fn disconnect(&self) -> Result<ResponseDispatchNotifier<()>, BluezError> {
        let (reply, replied) = ResponseDispatchNotifier::new(());
        self.0.disconnect(replied).await?;
        Ok(reply)
    }

    fn pair(&self) -> Result<(), BluezError> {
        Err(BluezError::NotSupported("Operation is not supported".into()))
    }

    #[zbus(property)]
    fn address(&self) -> String {
        self.0.address().to_owned()
    }

    #[zbus(property)]
    fn address_type(&self) -> &'static str {
        "public"
    }

    #[zbus(property)]
    fn name(&self) -> String {
        self.0.advertisement().name.clone()
    }

    #[zbus(property)]
    fn alias(&self) -> String {
        self.0.advertisement().name.clone()
    }

    #[zbus(property)]
    fn adapter(&self) -> zbus::fdo::Result<OwnedObjectPath> {
        Ok(ObjectPath::try_from(ADAPTER_PATH)?.into())
    }

    #[zbus(property)]
    fn paired(&self) -> bool {
        false
    }

    #[zbus(property)]
    fn bonded(&self) -> bool {
        false
    }

    #[zbus(property)]
    fn trusted(&self) -> bool {
        self.0.state().is_trusted
    }

    #[zbus(property)]
    fn set_trusted(&self, trusted: bool) {
        self.0.state().is_trusted = trusted;
    }

    #[zbus(property)]
    fn blocked(&self) -> bool {
        false
    }

    #[zbus(property)]
    fn legacy_pairing(&self) -> bool {
        false
    }

    #[zbus(property, name = "RSSI")]
    fn rssi(&self) -> i16 {
        self.0.state().rssi_dbm
    }

    #[zbus(property)]
    fn connected(&self) -> bool {
        self.0.state().is_connected
    }

    #[zbus(property)]
    fn services_resolved(&self) -> bool {
        self.0.state().is_resolved
    }

    #[zbus(property, name = "UUIDs")]
    fn uuids(&self) -> Vec<String> {
        self.0.advertisement().services.iter().map(|uuid| text(*uuid)).collect()
    }

    #[zbus(property)]
    fn manufacturer_data(&self) -> HashMap<u16, Variant<'static>> {
        let data = self.0.advertisement().manufacturer.clone();
        data.into_iter().map(|(company, bytes)| (company, Variant::from(bytes))).collect()
    }

    #[zbus(property)]
    fn service_data(&self) -> HashMap<String, Variant<'static>> {
        HashMap::new()
    }
}
