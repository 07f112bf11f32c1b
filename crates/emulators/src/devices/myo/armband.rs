use schemars::JsonSchema;
use serde::Deserialize;

use crate::devices::Wearer;
use crate::devices::faults::in_order;

/// The time after which a Myo sleeps, unless a command keeps it awake \[s\] (Open-Myo 3).
const AWAKE_SECS: f64 = 30.0;

/// The time between two EMG notifications, of two samples each \[s\].
const EMG_SECS: f64 = 0.01;

/// The time between two IMU notifications \[s\].
const IMU_SECS: f64 = 0.02;

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MyoIncident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: MyoFault,
}

/// A fault, or another occurrence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MyoFault {
    /// The next EMG notifications are lost.
    LostEmg(u32),
    /// The armband sends nothing until its mode is set again.
    Stall,
    /// The armband recognises a pose.
    Pose(u8),
}

/// A value sent by a Myo, with the number of its characteristic (`0x0105`).
pub type MyoSent = (u16, Vec<u8>);

/// A Myo. Times are true seconds since it was switched on, and never go back.
#[derive(Debug, Default)]
pub struct Myo {
    incidents: Vec<MyoIncident>,
    vibrations: u32,
    now_secs: f64,
    /// The modes of EMG, IMU and classifier.
    mode: [u8; 3],
    subscribed: Vec<u16>,
    awake_until_secs: f64,
    emg_sent: u64,
    imu_sent: u64,
    to_lose: u32,
    is_stalled: bool,
}

impl Myo {
    /// Creates a Myo that is switched on and at rest, with faults in any order.
    pub fn new(incidents: Vec<MyoIncident>) -> Self {
        let incidents = in_order(incidents, |incident| incident.at_secs);
        Self { incidents, ..Self::default() }
    }

    /// The number of vibrations so far.
    pub const fn vibrations(&self) -> u32 {
        self.vibrations
    }

    /// Enables notifications of a characteristic.
    pub fn subscribe(&mut self, characteristic: u16) {
        if !self.subscribed.contains(&characteristic) {
            self.subscribed.push(characteristic);
        }
    }

    /// Disables notifications of a characteristic.
    pub fn unsubscribe(&mut self, characteristic: u16) {
        self.subscribed.retain(|one| *one != characteristic);
    }

    /// Ends the link: subscriptions end, and active streams continue.
    pub fn disconnect(&mut self) {
        self.subscribed.clear();
    }

    /// Carries out a command; returns `false` if its length is wrong.
    pub fn write(&mut self, command: &[u8]) -> bool {
        let [code, length, payload @ ..] = command else { return false };
        if payload.len() != usize::from(*length) {
            return false;
        }
        self.awake_until_secs = self.now_secs + AWAKE_SECS;
        match (code, payload) {
            (0x01, [emg, imu, classifier]) => {
                self.mode = [*emg, *imu, *classifier];
                self.is_stalled = false;
            }
            (0x03, [_]) => self.vibrations += 1,
            _ => {}
        }
        true
    }

    /// Whether any data are being sent, which drains the battery.
    pub fn is_streaming(&self) -> bool {
        self.mode != [0; 3]
    }

    /// Returns what the armband sends until a time \[s\].
    pub fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<MyoSent> {
        let mut sent = Vec::new();
        loop {
            let emg_secs = (self.emg_sent + 1) as f64 * EMG_SECS;
            let imu_secs = (self.imu_sent + 1) as f64 * IMU_SECS;
            let incident_secs = self.incidents.first().map_or(f64::INFINITY, |one| one.at_secs);
            let next_secs = emg_secs.min(imu_secs).min(incident_secs);
            if next_secs > secs {
                self.now_secs = secs;
                return sent;
            }
            self.now_secs = next_secs;
            if incident_secs <= next_secs {
                sent.extend(self.suffer());
            } else if emg_secs <= next_secs {
                sent.extend(self.emg(wearer));
            } else {
                sent.extend(self.imu(wearer));
            }
        }
    }

    fn suffer(&mut self) -> Option<MyoSent> {
        match self.incidents.remove(0).fault {
            MyoFault::LostEmg(count) => self.to_lose += count,
            MyoFault::Stall => self.is_stalled = true,
            MyoFault::Pose(pose) => return self.send(0x0103, self.mode[2] == 1, vec![3, pose, 0]),
        }
        None
    }

    fn send(&self, characteristic: u16, is_on: bool, value: Vec<u8>) -> Option<MyoSent> {
        let awake = self.now_secs <= self.awake_until_secs && !self.is_stalled;
        let sends = is_on && awake && self.subscribed.contains(&characteristic);
        sends.then_some((characteristic, value))
    }

    /// Returns two EMG samples, on the four characteristics in turn.
    fn emg(&mut self, wearer: &mut dyn Wearer) -> Option<MyoSent> {
        let characteristic = 0x0105 + 0x0100 * (self.emg_sent % 4) as u16;
        self.emg_sent += 1;
        let samples =
            [self.now_secs - EMG_SECS / 2.0, self.now_secs].map(|secs| wearer.muscles(secs));
        let value =
            samples.as_flattened().iter().map(|uv| uv.round().clamp(-128.0, 127.0) as i8 as u8);
        let value = value.collect();
        if self.to_lose > 0 {
            self.to_lose -= 1;
            return None;
        }
        self.send(characteristic, matches!(self.mode[0], 2 | 3), value)
    }

    /// Returns the IMU data: upright and still, with the acceleration of the wearer.
    fn imu(&mut self, wearer: &mut dyn Wearer) -> Option<MyoSent> {
        self.imu_sent += 1;
        let acceleration =
            wearer.acceleration_mg(self.now_secs).map(|mg| (mg * 2.048).round() as i16);
        let [x, y, z] = acceleration;
        let numbers = [16384, 0, 0, 0, x, y, z, 0, 0, 0];
        let value = numbers.iter().flat_map(|number: &i16| number.to_le_bytes()).collect();
        self.send(0x0402, matches!(self.mode[1], 1 | 3), value)
    }
}
