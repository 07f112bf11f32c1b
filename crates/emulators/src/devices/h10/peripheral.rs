use super::characteristic::{Characteristic, measurement_data};
use super::{H10, Sent};
use crate::devices::peripheral::Property::{Indicate, Notify, Read, Write};
use crate::devices::pmd::POLAR;
use crate::devices::{
    Advertisement, AttError, Entry, Notice, Peripheral, Property, Service, Wearer, assigned,
};

/// The services in the order of an H10; the handles are chosen here.
pub(in crate::devices) const SERVICES: &[Service] = &[
    Service {
        handle: 0x000e,
        uuid: assigned(0x180d),
        characteristics: &[
            entry(0x000f, Characteristic::HeartRate, &[Notify]),
            entry(0x0012, Characteristic::SensorLocation, &[Read]),
        ],
    },
    Service {
        handle: 0x0020,
        uuid: assigned(0x180a),
        characteristics: &[
            entry(0x0021, Characteristic::Manufacturer, &[Read]),
            entry(0x0023, Characteristic::Model, &[Read]),
            entry(0x0025, Characteristic::Serial, &[Read]),
            entry(0x0029, Characteristic::Firmware, &[Read]),
        ],
    },
    Service {
        handle: 0x0030,
        uuid: assigned(0x180f),
        characteristics: &[entry(0x0031, Characteristic::Battery, &[Read, Notify])],
    },
    Service {
        handle: 0x0040,
        uuid: measurement_data(0),
        characteristics: &[
            entry(0x0041, Characteristic::Control, &[Read, Write, Indicate]),
            entry(0x0044, Characteristic::Data, &[Notify]),
        ],
    },
];

const fn entry(
    handle: u16,
    characteristic: Characteristic,
    properties: &'static [Property],
) -> Entry {
    Entry { handle, uuid: characteristic.uuid(), properties }
}

impl Peripheral for H10 {
    fn advertisement(&self) -> Advertisement {
        Advertisement {
            name: format!("Polar H10 {}", self.settings().serial),
            services: vec![assigned(0x180d), assigned(0xfeee)],
            manufacturer: Some((POLAR, vec![0x33, 0, 0, 0])),
        }
    }

    fn services(&self) -> &'static [Service] {
        SERVICES
    }

    fn mtu(&self) -> u16 {
        self.settings().mtu
    }

    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError> {
        let known = Characteristic::of(characteristic).ok_or(AttError::NotPermitted)?;
        self.subscribe(known)
    }

    fn unsubscribe(&mut self, characteristic: u128) {
        if let Some(known) = Characteristic::of(characteristic) {
            self.unsubscribe(known);
        }
    }

    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError> {
        let known = Characteristic::of(characteristic).ok_or(AttError::NotPermitted)?;
        H10::read(self, known)
    }

    fn write(&mut self, characteristic: u128, value: &[u8]) -> Result<(), AttError> {
        let known = Characteristic::of(characteristic).ok_or(AttError::NotPermitted)?;
        self.write(known, value)
    }

    fn disconnect(&mut self) {
        self.disconnect();
    }

    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let notice = |sent| match sent {
            Sent::Value(_, characteristic, value) => Notice::Value(characteristic.uuid(), value),
            Sent::LinkLost(_) => Notice::LinkLost,
        };
        self.until(secs, wearer).into_iter().map(notice).collect()
    }
}
