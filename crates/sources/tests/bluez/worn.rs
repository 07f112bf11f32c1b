//! Emulated devices that are worn by numbers: what they measure says when it was measured.

use teampulse_devices::gatt::Uuid;
use teampulse_devices::{heart_rate, myo, polar};
use teampulse_emulators::devices::{Characteristic, H10, H10Settings, Incident, Myo, Sent, Wearer};

use super::{Device, Peripheral};

/// How often the ECG counts up [Hz].
pub const COUNTS_HZ: f64 = 1000.0;

/// The intervals of a heart that beats unevenly, in steps of 1/1024 s, so that a strap reports them exactly.
pub fn intervals() -> impl Iterator<Item = u32> {
    (0..).map(|beat: u32| 560 + beat.wrapping_mul(7919) % 300)
}

/// Its beats [s].
pub fn beats() -> impl Iterator<Item = f64> {
    intervals().scan(0, |steps, interval| {
        *steps += interval;
        Some(f64::from(*steps) / 1024.0)
    })
}

/// Wears that heart.
struct Heart;

impl Wearer for Heart {
    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let since = beats().skip_while(|secs| *secs <= after_secs);
        since.take_while(|secs| *secs <= until_secs).collect()
    }

    /// The time, within the range of an H10.
    fn ecg_uv(&mut self, secs: f64) -> f64 {
        (secs * COUNTS_HZ).rem_euclid(16_000.0)
    }

    fn muscles(&mut self, secs: f64) -> [f64; 8] {
        // Every sample its number, 5 ms apart.
        let number = (secs * 200.0).round();
        [
            number.rem_euclid(100.0),
            (number / 100.0).floor().rem_euclid(100.0),
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            -1.0,
        ]
    }
}

/// An H10 that is worn.
struct Strap {
    h10: H10,
    wearer: Box<dyn Wearer + Send + Sync>,
}

const CHARACTERISTICS: [(Characteristic, Uuid); 6] = [
    (Characteristic::HeartRate, heart_rate::MEASUREMENT),
    (Characteristic::Battery, Uuid::short(0x2a19)),
    (Characteristic::Manufacturer, Uuid::short(0x2a29)),
    (Characteristic::Model, Uuid::short(0x2a24)),
    (Characteristic::Control, polar::CONTROL),
    (Characteristic::Data, polar::DATA),
];

fn characteristic(of: Uuid) -> Option<Characteristic> {
    CHARACTERISTICS
        .into_iter()
        .find(|(_, uuid)| *uuid == of)
        .map(|(characteristic, _)| characteristic)
}

impl Peripheral for Strap {
    fn characteristics(&self) -> Vec<Uuid> {
        CHARACTERISTICS.iter().map(|(_, uuid)| *uuid).collect()
    }

    fn subscribe(&mut self, of: Uuid) -> bool {
        characteristic(of).is_some_and(|of| self.h10.subscribe(of).is_ok())
    }

    fn read(&mut self, of: Uuid) -> Option<Vec<u8>> {
        self.h10.read(characteristic(of)?).ok()
    }

    fn write(&mut self, of: Uuid, value: &[u8]) -> bool {
        characteristic(of).is_some_and(|of| self.h10.write(of, value).is_ok())
    }

    fn until(&mut self, secs: f64) -> Vec<(Uuid, Vec<u8>)> {
        let sent = self.h10.until(secs, &mut *self.wearer);
        let value = |sent| match sent {
            Sent::Value(_, of, value) => {
                let uuid = CHARACTERISTICS.into_iter().find(|(each, _)| *each == of)?.1;
                Some((uuid, value))
            }
            Sent::LinkLost(_) => None,
        };
        sent.into_iter().filter_map(value).collect()
    }

    fn disconnect(&mut self) {
        self.h10.disconnect();
    }
}

/// An H10 with what goes wrong with it.
pub fn h10(address: &'static str, incidents: Vec<Incident>) -> Device {
    let h10 = H10::new(H10Settings { incidents, ..H10Settings::default() });
    Device {
        address,
        name: "Polar H10 00000001",
        services: vec![heart_rate::SERVICE],
        peripheral: Box::new(Strap { h10, wearer: Box::new(Heart) }),
    }
}

/// An H10.
pub fn strap(address: &'static str) -> Device {
    h10(address, Vec::new())
}

/// A Myo that is worn.
struct Armband(Myo);

const BATTERY: Uuid = Uuid::short(0x2a19);
const NUMBERS: [u16; 9] = [0x0101, 0x0201, 0x0401, 0x0402, 0x0103, 0x0105, 0x0205, 0x0305, 0x0405];

fn number(of: Uuid) -> Option<u16> {
    NUMBERS.into_iter().find(|number| myo::uuid(*number) == of)
}

impl Peripheral for Armband {
    fn characteristics(&self) -> Vec<Uuid> {
        NUMBERS.map(myo::uuid).into_iter().chain([BATTERY]).collect()
    }

    fn subscribe(&mut self, of: Uuid) -> bool {
        number(of).inspect(|number| self.0.subscribe(*number)).is_some()
    }

    fn read(&mut self, of: Uuid) -> Option<Vec<u8>> {
        (of == BATTERY).then_some(vec![55])
    }

    fn write(&mut self, of: Uuid, value: &[u8]) -> bool {
        of == myo::COMMAND && self.0.write(value)
    }

    fn until(&mut self, secs: f64) -> Vec<(Uuid, Vec<u8>)> {
        let sent = self.0.until(secs, &mut Heart).into_iter();
        sent.map(|(number, value)| (myo::uuid(number), value)).collect()
    }

    fn disconnect(&mut self) {}
}

/// A Myo.
pub fn armband(address: &'static str) -> Device {
    Device {
        address,
        name: "Ann's Myo",
        services: vec![myo::SERVICE],
        peripheral: Box::new(Armband(Myo::new(Vec::new()))),
    }
}
