#![expect(
    clippy::unused_self,
    clippy::used_underscore_binding,
    clippy::needless_pass_by_value,
    reason = "methods of an interface have the receiver and the arguments that it defines"
)]

use std::collections::HashMap;

use teampulse_emulators::devices::{Entry, Property, Service};
use zbus::message::Header;
use zbus::{ObjectPath, OwnedObjectPath, Variant, interface};

use super::adapter::sender;
use super::device::Handle;
use super::error::BluezError;

pub(super) const CHARACTERISTIC: &str = "org.bluez.GattCharacteristic1";

/// `org.bluez.GattService1`: a service of a connected device.
pub(super) struct GattService {
    pub device: Handle,
    pub service: Service,
}

#[interface(name = "org.bluez.GattService1", introspection_docs = false)]
impl GattService {
    #[zbus(property, name = "UUID")]
    fn uuid(&self) -> String {
        text(self.service.uuid)
    }

    #[zbus(property)]
    fn device(&self) -> zbus::fdo::Result<OwnedObjectPath> {
        path(self.device.path().to_owned())
    }

    #[zbus(property)]
    fn primary(&self) -> bool {
        true
    }

    #[zbus(property)]
    fn includes(&self) -> Vec<OwnedObjectPath> {
        Vec::new()
    }
}

/// `org.bluez.GattCharacteristic1`: a characteristic of a connected device.
pub(super) struct GattCharacteristic {
    pub device: Handle,
    /// The handle of the service that contains the characteristic.
    pub service: u16,
    pub entry: Entry,
}

impl GattCharacteristic {
    fn has(&self, property: Property) -> bool {
        self.entry.properties.contains(&property)
    }

    fn require(&self, properties: &[Property], refusal: &str) -> Result<(), BluezError> {
        if properties.iter().any(|property| self.has(*property)) {
            return Ok(());
        }
        Err(BluezError::NotPermitted(refusal.into()))
    }
}

#[interface(name = "org.bluez.GattCharacteristic1", introspection_docs = false)]
impl GattCharacteristic {
    async fn read_value(
        &self,
        _options: HashMap<String, Variant<'_>>,
    ) -> Result<Vec<u8>, BluezError> {
        self.require(&[Property::Read], "Read not permitted")?;
        let value = self.device.connected()?.peripheral.read(self.entry.uuid)?;
        self.device.value(self.entry.uuid, value.clone()).await?;
        Ok(value)
    }

    fn write_value(
        &self,
        value: Vec<u8>,
        _options: HashMap<String, Variant<'_>>,
    ) -> Result<(), BluezError> {
        let written = [Property::Write, Property::WriteWithoutResponse];
        self.require(&written, "Write not permitted")?;
        Ok(self.device.connected()?.peripheral.write(self.entry.uuid, &value)?)
    }

    fn start_notify(&self, #[zbus(header)] header: Header<'_>) -> Result<(), BluezError> {
        if !self.has(Property::Notify) && !self.has(Property::Indicate) {
            return Err(BluezError::NotSupported("Operation is not supported".into()));
        }
        self.device.listen(self.entry.uuid, sender(&header))
    }

    fn stop_notify(&self, #[zbus(header)] header: Header<'_>) -> Result<(), BluezError> {
        if self.device.unlisten(self.entry.uuid, &sender(&header)) {
            return Ok(());
        }
        Err(BluezError::Failed("No notify session started".into()))
    }

    #[zbus(property, name = "UUID")]
    fn uuid(&self) -> String {
        text(self.entry.uuid)
    }

    #[zbus(property)]
    fn service(&self) -> zbus::fdo::Result<OwnedObjectPath> {
        path(self.device.service_path(self.service))
    }

    #[zbus(property)]
    fn value(&self) -> Vec<u8> {
        self.device.state().values.get(&self.entry.uuid).cloned().unwrap_or_default()
    }

    #[zbus(property)]
    fn notifying(&self) -> bool {
        self.device.state().listeners.contains_key(&self.entry.uuid)
    }

    #[zbus(property)]
    fn flags(&self) -> Vec<&'static str> {
        let name = |property: &Property| match property {
            Property::Read => "read",
            Property::Write => "write",
            Property::WriteWithoutResponse => "write-without-response",
            Property::Notify => "notify",
            Property::Indicate => "indicate",
        };
        self.entry.properties.iter().map(name).collect()
    }

    #[zbus(property, name = "MTU")]
    fn mtu(&self) -> u16 {
        self.device.state().peripheral.mtu()
    }
}

/// A UUID as written by BlueZ.
pub(super) fn text(uuid: u128) -> String {
    teampulse_devices::gatt::Uuid(uuid).to_string()
}

fn path(text: String) -> zbus::fdo::Result<OwnedObjectPath> {
    Ok(ObjectPath::try_from(text)?.into())
}
