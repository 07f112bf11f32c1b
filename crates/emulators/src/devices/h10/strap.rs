use super::characteristic::Characteristic;
use super::control::{self, Asked, FEATURES, Kind};
use super::settings::{Fault, H10Settings, Incident};
use super::stream::Stream;
use crate::devices::battery::Battery;
use crate::devices::faults::in_order;
use crate::devices::heart_rate::BeatDetector;
use crate::devices::pmd::{self, ALREADY_IN_STATE, INVALID_MTU};
use crate::devices::{AttError, Wearer};
use crate::noise::Noise;

/// The time after which an H10 that is off the skin and has no streams closes its link \[s\] (known issues of Polar's
/// SDK).
const OFF_SKIN_SECS: f64 = 45.0;

/// The delay of an answer \[s\].
const ANSWER_SECS: f64 = 0.02;

/// An output of an H10.
#[derive(Clone, Debug, PartialEq)]
pub enum Sent {
    /// A notification or indication, at a time \[s\].
    Value(f64, Characteristic, Vec<u8>),
    /// The strap ends the link, at a time \[s\].
    LinkLost(f64),
}

/// An H10. Times are true seconds since it was switched on, and never go back.
#[derive(Debug)]
pub struct H10 {
    settings: H10Settings,
    now_secs: f64,
    subscribed: Vec<Characteristic>,
    streams: Vec<Stream>,
    beats: BeatDetector,
    battery: Battery,
    answers: Vec<(f64, Vec<u8>)>,
    armed: Vec<Fault>,
    stalled: bool,
    off_since_secs: Option<f64>,
    set_by_ns: u64,
    noise: Noise,
}

impl H10 {
    /// Creates an H10 that is switched on, with no client connected.
    pub fn new(mut settings: H10Settings) -> Self {
        settings.incidents = in_order(settings.incidents, |incident| incident.at_secs);
        Self {
            noise: Noise::seeded(settings.seed),
            battery: Battery::new(settings.battery_percent, settings.drain_percent_per_hour),
            settings,
            now_secs: 0.0,
            subscribed: Vec::new(),
            streams: Vec::new(),
            beats: BeatDetector::default(),
            answers: Vec::new(),
            armed: Vec::new(),
            stalled: false,
            off_since_secs: None,
            set_by_ns: 0,
        }
    }

    /// Ends the link: subscriptions end, and active streams continue.
    pub fn disconnect(&mut self) {
        self.subscribed.clear();
        self.answers.clear();
    }

    /// Whether any stream is active; an active stream continues until the battery is empty.
    pub fn is_streaming(&self) -> bool {
        !self.streams.is_empty()
    }

    /// Enables notifications or indications.
    pub fn subscribe(&mut self, characteristic: Characteristic) -> Result<(), AttError> {
        use Characteristic::{Battery, Control, Data, HeartRate};
        if !matches!(characteristic, HeartRate | Battery | Control | Data) {
            return Err(AttError::NotPermitted);
        }
        if !self.subscribed.contains(&characteristic) {
            self.subscribed.push(characteristic);
        }
        Ok(())
    }

    /// Disables notifications or indications.
    pub fn unsubscribe(&mut self, characteristic: Characteristic) {
        self.subscribed.retain(|one| *one != characteristic);
    }

    /// Reads a value. The value of the control point is always the features.
    pub fn read(&self, characteristic: Characteristic) -> Result<Vec<u8>, AttError> {
        match characteristic {
            Characteristic::Battery => Ok(vec![self.battery.percent(self.now_secs)]),
            Characteristic::SensorLocation => Ok(vec![1]), // the chest
            Characteristic::Manufacturer => Ok(b"Polar Electro Oy\0".to_vec()),
            Characteristic::Model => Ok(b"H10\0".to_vec()),
            Characteristic::Serial => Ok(self.settings.serial.clone().into_bytes()),
            Characteristic::Firmware => Ok(b"5.0.0\0".to_vec()),
            Characteristic::Control => Ok(FEATURES.to_vec()),
            Characteristic::HeartRate | Characteristic::Data => Err(AttError::NotPermitted),
        }
    }

    /// The settings of the strap.
    pub const fn settings(&self) -> &H10Settings {
        &self.settings
    }

    /// Writes a command; its answer is sent a little later.
    pub fn write(&mut self, characteristic: Characteristic, value: &[u8]) -> Result<(), AttError> {
        if characteristic != Characteristic::Control {
            return Err(AttError::NotPermitted);
        }
        if !self.subscribed.contains(&Characteristic::Control) {
            return Err(AttError::NotSubscribed);
        }
        let asked = control::parse(value);
        let result = if asked.is_ok() && self.strikes(Fault::FalseAnswer) {
            Ok(Vec::new())
        } else {
            asked.and_then(|asked| self.carry_out(asked))
        };
        let answer = pmd::answer(value, result);
        let at_secs = self.now_secs + ANSWER_SECS + self.delay_secs();
        self.answers.push((at_secs, answer));
        Ok(())
    }

    /// Returns the delay of the next answer \[s\].
    fn delay_secs(&mut self) -> f64 {
        let delay =
            |fault: &Fault| if let Fault::LateAnswer(secs) = fault { Some(*secs) } else { None };
        let secs = self.armed.iter().find_map(delay);
        secs.filter(|secs| self.strikes(Fault::LateAnswer(*secs))).unwrap_or(0.0)
    }

    /// Returns the parameters of the answer, or the status of a refusal.
    fn carry_out(&mut self, asked: Asked) -> Result<Vec<u8>, u8> {
        match asked {
            Asked::Settings(kind) => Ok(kind.offered()),
            Asked::Start(..) if self.settings.mtu < pmd::MTU => Err(INVALID_MTU),
            Asked::Start(kind, _) if self.has(kind) => Err(ALREADY_IN_STATE),
            Asked::Start(kind, rate_hz) => {
                let began_secs = self.now_secs + self.settings.start_delay_secs;
                self.streams.push(Stream::new(kind, rate_hz, began_secs, self.quartz()));
                self.stalled = false;
                Ok(Vec::new())
            }
            Asked::Stop(kind) if !self.has(kind) => Err(ALREADY_IN_STATE),
            Asked::Stop(kind) => {
                self.streams.retain(|stream| stream.kind != kind);
                Ok(Vec::new())
            }
        }
    }

    fn has(&self, kind: Kind) -> bool {
        self.streams.iter().any(|stream| stream.kind == kind)
    }

    fn quartz(&self) -> f64 {
        1.0 + self.settings.clock_fast
    }

    /// Returns what the strap sends until a time \[s\], in order of time.
    pub fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Sent> {
        let mut sent = Vec::new();
        while let Some((at_secs, next)) = self.next().filter(|(at_secs, _)| *at_secs <= secs) {
            self.now_secs = self.now_secs.max(at_secs);
            match next {
                Next::Incident => self.suffer(),
                Next::Answer => sent.extend(self.answer()),
                Next::HeartRate => sent.extend(self.heart_rate(wearer)),
                Next::Battery => sent.extend(self.battery_level()),
                Next::Frame(at) => sent.extend(self.frame(at, wearer)),
                Next::LinkLost => {
                    self.disconnect();
                    self.off_since_secs = Some(f64::INFINITY);
                    sent.push(Sent::LinkLost(at_secs));
                }
            }
        }
        self.now_secs = self.now_secs.max(secs);
        sent
    }

    /// Returns what happens next, and when; if several happen at the same time, the first of them.
    fn next(&self) -> Option<(f64, Next)> {
        let incident = self.settings.incidents.first().map(|one| (one.at_secs, Next::Incident));
        let answer = self.answers.first().map(|(at_secs, _)| (*at_secs, Next::Answer));
        let heart_rate = (self.beats.due_secs(), Next::HeartRate);
        let battery = (self.battery.due_secs(), Next::Battery);
        let frames = self.streams.iter().enumerate();
        let frames = frames.map(|(at, stream)| (stream.due_secs(), Next::Frame(at)));
        let off = self.off_since_secs.filter(|_| !self.is_streaming());
        let lost = off.map(|since_secs| (since_secs + OFF_SKIN_SECS, Next::LinkLost));
        let all = incident.into_iter().chain(answer).chain([heart_rate, battery]);
        let all = all.chain(frames).chain(lost);
        all.min_by(|(one, _), (other, _)| one.total_cmp(other))
    }

    fn suffer(&mut self) {
        let Incident { fault, .. } = self.settings.incidents.remove(0);
        match fault {
            Fault::Stall => self.stalled = true,
            Fault::ClockSet(by_ns) => self.set_by_ns += by_ns,
            Fault::StrapOff => self.off_since_secs = Some(self.now_secs),
            Fault::StrapOn => self.off_since_secs = None,
            fault => self.armed.push(fault),
        }
    }

    /// Whether a pending fault occurs now; it is then no longer pending.
    fn strikes(&mut self, fault: Fault) -> bool {
        let found = self.armed.iter().position(|armed| *armed == fault);
        found.map(|at| self.armed.remove(at)).is_some()
    }

    fn answer(&mut self) -> Option<Sent> {
        let (at_secs, answer) = self.answers.remove(0);
        let lost = self.strikes(Fault::LostAnswer);
        (!lost).then_some(Sent::Value(at_secs, Characteristic::Control, answer))
    }

    fn heart_rate(&mut self, wearer: &mut dyn Wearer) -> Option<Sent> {
        let worn = if self.off_since_secs.is_none() { Some(wearer) } else { None };
        let value = self.beats.measure(self.now_secs, worn, None, self.quartz());
        self.send(Characteristic::HeartRate, value)
    }

    fn battery_level(&mut self) -> Option<Sent> {
        let level = self.battery.report(self.now_secs);
        self.send(Characteristic::Battery, vec![level])
    }

    fn send(&self, characteristic: Characteristic, value: Vec<u8>) -> Option<Sent> {
        let heard = self.subscribed.contains(&characteristic);
        heard.then_some(Sent::Value(self.now_secs, characteristic, value))
    }

    fn frame(&mut self, at: usize, wearer: &mut dyn Wearer) -> Vec<Sent> {
        let (quartz, set_by_ns, at_secs) = (self.quartz(), self.set_by_ns, self.now_secs);
        let Some(stream) = self.streams.get_mut(at) else { return Vec::new() };
        let mut frame = if self.off_since_secs.is_some() {
            stream.frame(&mut OffSkin(&mut self.noise), quartz, set_by_ns)
        } else {
            stream.frame(wearer, quartz, set_by_ns)
        };
        let lost = self.strikes(Fault::LostFrame);
        if lost || self.stalled || !self.subscribed.contains(&Characteristic::Data) {
            return Vec::new();
        }
        self.corrupt(&mut frame);
        let times = if self.strikes(Fault::RepeatedFrame) { 2 } else { 1 };
        vec![Sent::Value(at_secs, Characteristic::Data, frame); times]
    }

    fn corrupt(&mut self, frame: &mut [u8]) {
        let byte =
            |fault: &Fault| if let Fault::CorruptByte(at) = fault { Some(*at) } else { None };
        let Some(at) = self.armed.iter().find_map(byte) else { return };
        self.strikes(Fault::CorruptByte(at));
        if let Some(byte) = frame.get_mut(at) {
            *byte ^= 0x40;
        }
    }
}

enum Next {
    Incident,
    Answer,
    HeartRate,
    Battery,
    Frame(usize),
    LinkLost,
}

/// Electrodes in the air, which record noise of a few millivolts.
struct OffSkin<'a>(&'a mut Noise);

impl Wearer for OffSkin<'_> {
    fn ecg_uv(&mut self, _: f64) -> f64 {
        3000.0 * self.0.normal()
    }
}
