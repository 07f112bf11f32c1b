//! A heart rate strap of any make: it has the Heart Rate service and measures nothing else.

use schemars::JsonSchema;
use serde::Deserialize;

use super::battery::Battery;
use super::faults::in_order;
use super::heart_rate::BeatDetector;
use super::peripheral::Property::{Notify, Read};
use super::{Advertisement, AttError, Entry, Notice, Peripheral, Service, Wearer, assigned};

const MEASUREMENT: u128 = assigned(0x2a37);
const LOCATION: u128 = assigned(0x2a38);
const MANUFACTURER: u128 = assigned(0x2a29);
const MODEL: u128 = assigned(0x2a24);
const BATTERY: u128 = assigned(0x2a19);

const SERVICES: &[Service] = &[
    Service {
        handle: 0x000a,
        uuid: assigned(0x180d),
        characteristics: &[
            Entry { handle: 0x000b, uuid: MEASUREMENT, properties: &[Notify] },
            Entry { handle: 0x000e, uuid: LOCATION, properties: &[Read] },
        ],
    },
    Service {
        handle: 0x0010,
        uuid: assigned(0x180f),
        characteristics: &[Entry { handle: 0x0011, uuid: BATTERY, properties: &[Read, Notify] }],
    },
    Service {
        handle: 0x0014,
        uuid: assigned(0x180a),
        characteristics: &[
            Entry { handle: 0x0015, uuid: MANUFACTURER, properties: &[Read] },
            Entry { handle: 0x0017, uuid: MODEL, properties: &[Read] },
        ],
    },
];

/// The properties of an emulated strap.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StrapSettings {
    /// The advertised name.
    pub name: String,
    /// How much too fast the clock runs: 0.02 for 2 %.
    pub clock_fast: f64,
    /// The battery charge when the strap is switched on \[%\].
    pub battery_percent: f64,
    /// How fast the battery drains.
    pub drain_percent_per_hour: f64,
    /// The faults, in any order.
    #[serde(rename = "faults")]
    pub incidents: Vec<StrapIncident>,
}

impl Default for StrapSettings {
    fn default() -> Self {
        Self {
            name: "Heart Strap".into(),
            clock_fast: 0.0,
            battery_percent: 70.0,
            drain_percent_per_hour: 0.2,
            incidents: Vec::new(),
        }
    }
}

/// A fault at a given time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrapIncident {
    /// When the fault begins \[s\].
    pub at_secs: f64,
    /// The fault.
    pub fault: StrapFault,
}

/// The possible faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StrapFault {
    /// The next measurement is not sent, and its intervals are lost.
    LostMeasurement,
    /// The strap is taken off: it reports no contact and no beats.
    Off,
    /// The strap is put on again.
    On,
}

/// A strap that sends heart rate, intervals between beats and contact with the skin, once a second.
#[derive(Debug)]
pub struct Strap {
    settings: StrapSettings,
    subscribed: Vec<u128>,
    beats: BeatDetector,
    battery: Battery,
    to_lose: u32,
    is_off: bool,
    now_secs: f64,
}

impl Strap {
    /// Creates a strap that is switched on, with no client connected.
    pub fn new(mut settings: StrapSettings) -> Self {
        settings.incidents = in_order(settings.incidents, |incident| incident.at_secs);
        let battery = Battery::new(settings.battery_percent, settings.drain_percent_per_hour);
        let beats = BeatDetector::default();
        let subscribed = Vec::new();
        Self { settings, subscribed, beats, battery, to_lose: 0, is_off: false, now_secs: 0.0 }
    }

    fn suffer(&mut self) {
        match self.settings.incidents.remove(0).fault {
            StrapFault::LostMeasurement => self.to_lose += 1,
            StrapFault::Off => self.is_off = true,
            StrapFault::On => self.is_off = false,
        }
    }

    fn measure(&mut self, wearer: &mut dyn Wearer) -> Option<Notice> {
        let worn = if self.is_off { None } else { Some(wearer) };
        let (contact, quartz) = (Some(!self.is_off), 1.0 + self.settings.clock_fast);
        let value = self.beats.measure(self.now_secs, worn, contact, quartz);
        if self.to_lose > 0 {
            self.to_lose -= 1;
            return None;
        }
        self.send(MEASUREMENT, value)
    }

    fn send(&self, characteristic: u128, value: Vec<u8>) -> Option<Notice> {
        let heard = self.subscribed.contains(&characteristic);
        heard.then_some(Notice::Value(characteristic, value))
    }
}

impl Peripheral for Strap {
    fn advertisement(&self) -> Advertisement {
        let (name, services) = (self.settings.name.clone(), vec![assigned(0x180d)]);
        Advertisement { name, services, manufacturer: None }
    }

    fn services(&self) -> &'static [Service] {
        SERVICES
    }

    fn mtu(&self) -> u16 {
        23
    }

    fn subscribe(&mut self, characteristic: u128) -> Result<(), AttError> {
        if !matches!(characteristic, MEASUREMENT | BATTERY) {
            return Err(AttError::NotPermitted);
        }
        if !self.subscribed.contains(&characteristic) {
            self.subscribed.push(characteristic);
        }
        Ok(())
    }

    fn unsubscribe(&mut self, characteristic: u128) {
        self.subscribed.retain(|one| *one != characteristic);
    }

    fn read(&mut self, characteristic: u128) -> Result<Vec<u8>, AttError> {
        match characteristic {
            LOCATION => Ok(vec![1]), // the chest
            MANUFACTURER => Ok(b"Acme".to_vec()),
            MODEL => Ok(b"Strap".to_vec()),
            BATTERY => Ok(vec![self.battery.percent(self.now_secs)]),
            _ => Err(AttError::NotPermitted),
        }
    }

    fn write(&mut self, _: u128, _: &[u8]) -> Result<(), AttError> {
        Err(AttError::NotPermitted)
    }

    fn disconnect(&mut self) {
        self.subscribed.clear();
    }

    fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let mut sent = Vec::new();
        loop {
            let incident_secs =
                self.settings.incidents.first().map_or(f64::INFINITY, |one| one.at_secs);
            let (beats_secs, battery_secs) = (self.beats.due_secs(), self.battery.due_secs());
            let next_secs = incident_secs.min(beats_secs).min(battery_secs);
            if next_secs > secs {
                self.now_secs = self.now_secs.max(secs);
                return sent;
            }
            self.now_secs = self.now_secs.max(next_secs);
            if incident_secs <= next_secs {
                self.suffer();
            } else if beats_secs <= next_secs {
                sent.extend(self.measure(wearer));
            } else {
                let level = self.battery.report(self.now_secs);
                sent.extend(self.send(BATTERY, vec![level]));
            }
        }
    }
}
