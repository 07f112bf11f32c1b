use super::Verity;
use crate::devices::h10::SERVICES;
use crate::devices::pmd::{MTU, POLAR};
use crate::devices::{
    Advertisement, AttError, Characteristic, Notice, Peripheral, Service, Wearer, assigned,
};

impl Peripheral for Verity {
    fn advertisement(&self) -> Advertisement {
        let settings = self.settings();
        Advertisement {
            name: format!("{} {}", settings.model.name(), settings.serial),
            services: vec![assigned(0x180d), assigned(0xfeee)],
            manufacturer: Some((POLAR, vec![0x33, 0, 0, 0])),
        }
    }

    fn services(&self) -> &'static [Service] {
        SERVICES
    }

    fn mtu(&self) -> u16 {
        MTU
    }

    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError> {
        let known = Characteristic::of(characteristic).ok_or(AttError::NotPermitted)?;
        self.listen(known)
    }

    fn unsubscribe(&mut self, characteristic: u128) {
        if let Some(known) = Characteristic::of(characteristic) {
            self.unlisten(known);
        }
    }

    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError> {
        let known = Characteristic::of(characteristic).ok_or(AttError::NotPermitted)?;
        self.value(known)
    }

    fn write(&mut self, characteristic: u128, value: &[u8]) -> Result<(), AttError> {
        match Characteristic::of(characteristic) {
            Some(Characteristic::Control) => self.command(value),
            _ => Err(AttError::NotPermitted),
        }
    }

    fn disconnect(&mut self) {
        self.lose_link();
    }

    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        self.sent_until(secs, wearer)
    }
}
