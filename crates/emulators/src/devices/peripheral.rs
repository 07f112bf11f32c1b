use super::Wearer;

/// A device that is reached over Bluetooth Low Energy: what it advertises, and its table of characteristics (GATT).
///
/// Characteristics are identified by their UUIDs. Times are true seconds since the device was switched on, and never go
/// back.
pub trait Peripheral: Send {
    /// Returns what the device advertises while no client is connected.
    fn advertisement(&self) -> Advertisement;

    /// Returns the services, in the order of their handles.
    fn services(&self) -> &'static [Service];

    /// Returns the MTU of the device's links; a value is at least 3 bytes smaller.
    fn mtu(&self) -> u16;

    /// Enables notifications or indications of a characteristic.
    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError>;

    /// Disables notifications or indications of a characteristic.
    fn unsubscribe(&mut self, characteristic: u128);

    /// Reads the value of a characteristic.
    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError>;

    /// Writes the value of a characteristic.
    fn write(&mut self, characteristic: u128, value: &[u8]) -> Result<(), AttError>;

    /// Ends the link, and all subscriptions with it.
    fn disconnect(&mut self);

    /// Returns what the device sends until a time \[s\], in order of time.
    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice>;
}

/// What a device advertises.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Advertisement {
    /// The advertised name.
    pub name: String,
    /// The advertised services, by which clients recognise the device.
    pub services: Vec<u128>,
    /// The number of a company (assigned numbers, 7.1), and that company's data.
    pub manufacturer: Option<(u16, Vec<u8>)>,
}

/// A service of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Service {
    /// The handle of its declaration.
    pub handle: u16,
    /// The UUID of the service.
    pub uuid: u128,
    /// The characteristics of the service, in the order of their handles.
    pub characteristics: &'static [Entry],
}

/// A characteristic of a service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The handle of the declaration; the value has the next handle.
    pub handle: u16,
    /// The UUID of the characteristic.
    pub uuid: u128,
    /// What the characteristic permits.
    pub properties: &'static [Property],
}

/// What a characteristic permits (Core specification, vol. 3, part G, 3.3.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Reading.
    Read,
    /// Writing with response.
    Write,
    /// Writing without response.
    WriteWithoutResponse,
    /// Subscribing; values are not confirmed.
    Notify,
    /// Subscribing; values are confirmed.
    Indicate,
}

/// Why a request failed, as reported over the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttError {
    /// The characteristic was written before it was subscribed to.
    #[error("the client has not subscribed to the characteristic")]
    NotSubscribed,
    /// The characteristic can't be read, written or subscribed to.
    #[error("the characteristic does not permit this")]
    NotPermitted,
    /// The value has the wrong length.
    #[error("the length of the value is wrong")]
    Length,
}

/// What a device sends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// A notification or indication: the characteristic, and its value.
    Value(u128, Vec<u8>),
    /// The device ends the link.
    LinkLost,
}

/// Returns the UUID of a number assigned by the Bluetooth SIG (Core specification, vol. 3, part B, 2.5.1).
pub const fn assigned(number: u16) -> u128 {
    0x0000_0000_0000_1000_8000_0080_5f9b_34fb | (number as u128) << 96
}
