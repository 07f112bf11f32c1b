use crate::gatt::{Request, Uuid};
use crate::outbox::Outbox;
use crate::{Channel, Event, Identity, Reading, Stream};

/// The Battery Level characteristic, in percent (Battery Service 1.1, 3.1).
pub(crate) const BATTERY_LEVEL: Uuid = Uuid::short(0x2a19);

/// The characteristics of Device Information Service 1.1, table 3.1.
const INFORMATION: [(Uuid, Identity); 4] = [
    (Uuid::short(0x2a29), Identity::Manufacturer),
    (Uuid::short(0x2a24), Identity::Model),
    (Uuid::short(0x2a25), Identity::Serial),
    (Uuid::short(0x2a26), Identity::Firmware),
];

/// The services that any Bluetooth device may have: Device Information (0x180A) and Battery (0x180F).
///
/// A device without one of them is no error. An unchanged battery level is not reported again, as `BlueZ` also delivers
/// each value that is read as a notification.
#[derive(Debug, Default)]
pub(crate) struct StandardServices {
    batteries: u64,
    last_percent: Option<u8>,
}

impl StandardServices {
    pub fn start(&mut self, out: &mut Outbox<Request>) {
        self.last_percent = None;
        out.stream(Stream::irregular("battery", vec![Channel::new("charge", "%")]));
        for (characteristic, _) in INFORMATION {
            out.request(Request::Read(characteristic));
        }
        out.request(Request::Subscribe(BATTERY_LEVEL));
        out.request(Request::Read(BATTERY_LEVEL));
    }

    /// Handles a value; returns whether it belongs to one of these services.
    pub fn receive(&mut self, from: Uuid, value: &[u8], out: &mut Outbox<Request>) -> bool {
        if from == BATTERY_LEVEL {
            self.receive_battery(value, out);
            return true;
        }
        let Some((_, part)) = INFORMATION.iter().find(|(uuid, _)| *uuid == from) else {
            return false;
        };
        // Several manufacturers end their strings with a zero byte.
        let text = String::from_utf8_lossy(value);
        let value = text.trim_end_matches('\0').trim().to_owned();
        if !value.is_empty() {
            out.event(Event::Identified { part: *part, value });
        }
        true
    }

    fn receive_battery(&mut self, value: &[u8], out: &mut Outbox<Request>) {
        let &[percent @ 0..=100, ..] = value else {
            out.discarded("battery", value.len());
            return;
        };
        if self.last_percent.replace(percent) == Some(percent) {
            return;
        }
        out.reading(Reading::untimed("battery", self.batteries, vec![f64::from(percent)]));
        self.batteries += 1;
    }
}
