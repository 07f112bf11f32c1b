use super::Myo;
use crate::devices::peripheral::Property::{Indicate, Notify, Read, Write, WriteWithoutResponse};
use crate::devices::{
    Advertisement, AttError, Entry, Notice, Peripheral, Property, Service, Wearer, assigned,
};

const MANUFACTURER: u128 = assigned(0x2a29);
const BATTERY: u128 = assigned(0x2a19);

/// The information characteristic: serial number (last byte first), unlock pose, classifier, SKU, reserved.
const INFORMATION: [u8; 20] =
    [0x8e, 0x32, 0x94, 0x85, 0x3b, 0xd2, 5, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];

/// The firmware characteristic: version 1.5.1970 on hardware of revision D.
const FIRMWARE: [u16; 4] = [1, 5, 1970, 2];

/// The services, with the handles of a Myo (dl-myo's profile).
const SERVICES: &[Service] = &[
    Service {
        handle: 0x0c,
        uuid: assigned(0x180a),
        characteristics: &[Entry { handle: 0x0d, uuid: MANUFACTURER, properties: &[Read] }],
    },
    Service {
        handle: 0x0f,
        uuid: assigned(0x180f),
        characteristics: &[Entry { handle: 0x10, uuid: BATTERY, properties: &[Read, Notify] }],
    },
    Service {
        handle: 0x13,
        uuid: uuid(0x0001),
        characteristics: &[
            entry(0x14, 0x0101, &[Read]),
            entry(0x16, 0x0201, &[Read]),
            entry(0x18, 0x0401, &[Write, WriteWithoutResponse]),
        ],
    },
    Service {
        handle: 0x1a,
        uuid: uuid(0x0002),
        characteristics: &[entry(0x1b, 0x0402, &[Notify]), entry(0x1e, 0x0502, &[Indicate])],
    },
    Service {
        handle: 0x21,
        uuid: uuid(0x0003),
        characteristics: &[entry(0x22, 0x0103, &[Indicate])],
    },
    Service {
        handle: 0x25,
        uuid: uuid(0x0004),
        characteristics: &[entry(0x26, 0x0104, &[Notify])],
    },
    Service {
        handle: 0x29,
        uuid: uuid(0x0005),
        characteristics: &[
            entry(0x2a, 0x0105, &[Notify]),
            entry(0x2d, 0x0205, &[Notify]),
            entry(0x30, 0x0305, &[Notify]),
            entry(0x33, 0x0405, &[Notify]),
        ],
    },
];

const fn entry(handle: u16, number: u16, properties: &'static [Property]) -> Entry {
    Entry { handle, uuid: uuid(number), properties }
}

/// Returns the UUID of a Myo's service or characteristic.
const fn uuid(number: u16) -> u128 {
    0xd506_0000_a904_deb9_4748_2c7f_4a12_4842 | (number as u128) << 96
}

/// Returns the number within the UUID of a Myo's characteristic.
fn number(of: u128) -> Option<u16> {
    let number = (of >> 96) as u16;
    (uuid(number) == of).then_some(number)
}

/// Whether a characteristic permits subscribing.
fn notifies(characteristic: u128) -> bool {
    let mut entries = SERVICES.iter().flat_map(|service| service.characteristics);
    entries.any(|entry| {
        entry.uuid == characteristic
            && (entry.properties.contains(&Notify) || entry.properties.contains(&Indicate))
    })
}

impl Peripheral for Myo {
    fn advertisement(&self) -> Advertisement {
        let services = vec![uuid(0x0001)];
        Advertisement { name: "My Myo".into(), services, manufacturer: None }
    }

    fn services(&self) -> &'static [Service] {
        SERVICES
    }

    fn mtu(&self) -> u16 {
        23
    }

    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError> {
        if !notifies(characteristic) {
            return Err(AttError::NotPermitted);
        }
        if let Some(number) = number(characteristic) {
            self.subscribe(number);
        }
        Ok(())
    }

    fn unsubscribe(&mut self, characteristic: u128) {
        if let Some(number) = number(characteristic) {
            self.unsubscribe(number);
        }
    }

    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError> {
        match (characteristic, number(characteristic)) {
            (MANUFACTURER, _) => Ok(b"Thalmic Labs".to_vec()),
            (BATTERY, _) => Ok(vec![66]),
            (_, Some(0x0101)) => Ok(INFORMATION.to_vec()),
            (_, Some(0x0201)) => Ok(FIRMWARE.iter().flat_map(|part| part.to_le_bytes()).collect()),
            _ => Err(AttError::NotPermitted),
        }
    }

    fn write(&mut self, characteristic: u128, value: &[u8]) -> Result<(), AttError> {
        if number(characteristic) != Some(0x0401) {
            return Err(AttError::NotPermitted);
        }
        if self.write(value) { Ok(()) } else { Err(AttError::Length) }
    }

    fn disconnect(&mut self) {
        self.disconnect();
    }

    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let notice = |(number, value)| Notice::Value(uuid(number), value);
        self.until(secs, wearer).into_iter().map(notice).collect()
    }
}
