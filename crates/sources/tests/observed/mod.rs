//! Emulated devices whose wearers are numbers, so that what they measure encodes when it was measured; each with a
//! record of the requests that it received.

use std::sync::{Arc, Mutex, MutexGuard};

use teampulse_emulators::devices::{
    Advertisement, AttError, H10, H10Settings, Incident, Myo, Notice, Peripheral, Service, Strap,
    StrapSettings, Verity, VerityIncident, VeritySettings, Wearer,
};
use teampulse_sources::emulated::bluetooth::EmulatedDevice;

/// How many times a second the ECG counts up [Hz].
pub const COUNTS_HZ: f64 = 1000.0;

/// How fast the light of a pulse wave counts up.
pub const LIGHT_OF_SECS: f64 = 0.1;

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

/// A wearer with that heart.
struct Heart;

impl Wearer for Heart {
    fn beats(&mut self, after_secs: f64, until_secs: f64) -> Vec<f64> {
        let since = beats().skip_while(|secs| *secs <= after_secs);
        since.take_while(|secs| *secs <= until_secs).collect()
    }

    /// The time as a voltage within the range of an H10.
    fn ecg_uv(&mut self, secs: f64) -> f64 {
        (secs * COUNTS_HZ).rem_euclid(16_000.0)
    }

    /// The time as light, which changes little from sample to sample.
    fn light(&mut self, secs: f64) -> f64 {
        secs * LIGHT_OF_SECS
    }

    fn muscles(&mut self, secs: f64) -> [f64; 8] {
        // Every sample its number, 5 ms apart.
        let number = (secs * 200.0).round();
        let (low, high) = (number.rem_euclid(100.0), (number / 100.0).floor().rem_euclid(100.0));
        [low, high, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0]
    }
}

/// The requests that a device received, and what is to happen to it.
#[derive(Debug, Default)]
pub struct Course {
    /// How often a client connected to it and sent a request.
    pub connections: usize,
    /// How often it was disconnected on request.
    pub disconnections: usize,
    /// Whether its link is to be lost.
    pub drop: bool,
    /// The values written to it.
    pub written: Vec<Vec<u8>>,
    is_connected: bool,
    is_dropped: bool,
}

impl Course {
    fn asked(&mut self) {
        if !self.is_connected {
            self.connections += 1;
            self.is_connected = true;
            // What was to be lost is the link before.
            self.drop = false;
        }
    }
}

/// A course that a device shares with its test.
#[derive(Clone, Debug, Default)]
pub struct SharedCourse(Arc<Mutex<Course>>);

impl SharedCourse {
    pub fn lock(&self) -> MutexGuard<'_, Course> {
        self.0.lock().expect("nobody panicked")
    }
}

/// A device whose course is recorded.
struct Observed<P> {
    device: P,
    course: SharedCourse,
}

impl<P: Peripheral> Peripheral for Observed<P> {
    fn advertisement(&self) -> Advertisement {
        self.device.advertisement()
    }

    fn services(&self) -> &'static [Service] {
        self.device.services()
    }

    fn mtu(&self) -> u16 {
        self.device.mtu()
    }

    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError> {
        self.course.lock().asked();
        self.device.subscribe(characteristic)
    }

    fn unsubscribe(&mut self, characteristic: u128) {
        self.device.unsubscribe(characteristic);
    }

    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError> {
        self.course.lock().asked();
        self.device.read(characteristic)
    }

    fn write(&mut self, characteristic: u128, value: &[u8]) -> Result<(), AttError> {
        let mut course = self.course.lock();
        course.asked();
        course.written.push(value.to_vec());
        self.device.write(characteristic, value)
    }

    fn disconnect(&mut self) {
        let mut course = self.course.lock();
        let was_dropped = std::mem::take(&mut course.is_dropped);
        course.disconnections += usize::from(!was_dropped);
        course.is_connected = false;
        self.device.disconnect();
    }

    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let mut sent = self.device.until(secs, wearer);
        let mut course = self.course.lock();
        if std::mem::take(&mut course.drop) && course.is_connected {
            course.is_dropped = true;
            sent.push(Notice::LinkLost);
        }
        sent
    }
}

fn worn(address: &str, device: impl Peripheral + 'static) -> (EmulatedDevice, SharedCourse) {
    let course = SharedCourse::default();
    let observed = Observed { device, course: course.clone() };
    let device = EmulatedDevice {
        address: address.into(),
        peripheral: Box::new(observed),
        wearer: Box::new(Heart),
        incidents: Vec::new(),
    };
    (device, course)
}

/// An H10 with faults.
pub fn h10(address: &str, incidents: Vec<Incident>) -> (EmulatedDevice, SharedCourse) {
    worn(address, H10::new(H10Settings { incidents, ..H10Settings::default() }))
}

/// A Verity Sense with faults.
pub fn verity(address: &str, incidents: Vec<VerityIncident>) -> (EmulatedDevice, SharedCourse) {
    worn(address, Verity::new(VeritySettings { incidents, ..VeritySettings::default() }))
}

/// A strap of any maker.
pub fn strap(address: &str) -> (EmulatedDevice, SharedCourse) {
    worn(address, Strap::new(StrapSettings::default()))
}

/// A Myo.
pub fn armband(address: &str) -> (EmulatedDevice, SharedCourse) {
    worn(address, Myo::default())
}
