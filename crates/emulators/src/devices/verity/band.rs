use super::control::{self, Asked, FEATURES, Kind};
use super::pulses::Pulses;
use super::stream::Stream;
use super::{VerityFault, VerityIncident, VeritySettings};
use crate::devices::battery::Battery;
use crate::devices::faults::in_order;
use crate::devices::pmd::{ALREADY_IN_STATE, answer};
use crate::devices::{AttError, Characteristic, Notice, Wearer};
use crate::noise::Noise;

/// The delay of an answer \[s\].
const ANSWER_SECS: f64 = 0.02;
/// The time between two notifications of the heart rate \[s\], and how many times longer it is while intervals are
/// measured.
const HEART_RATE_SECS: f64 = 1.0;
const SLOW_HEART_RATE_SECS: u64 = 5;
/// The time over which a heart rate is averaged \[s\].
const HEART_RATE_OF_SECS: f64 = 5.0;

/// A Verity Sense or OH1. Times are true seconds since it was switched on, and never go back.
///
/// Streams continue when the link is lost, like those of an H10: the documents do not mention this.
#[derive(Debug)]
pub struct Verity {
    settings: VeritySettings,
    now_secs: f64,
    subscribed: Vec<Characteristic>,
    streams: Vec<Stream>,
    pulses: Option<Pulses>,
    heart_rates: u64,
    heart_rate_bpm: u8,
    battery: Battery,
    answers: Vec<(f64, Vec<u8>)>,
    armed: Vec<VerityFault>,
    is_stalled: bool,
    is_moving: bool,
    is_off: bool,
    noise: Noise,
}

enum Next {
    Incident,
    Answer,
    HeartRate,
    Battery,
    Frames(usize),
    Pulses,
}

impl Verity {
    /// Creates a sensor that is switched on, with no client connected.
    pub fn new(mut settings: VeritySettings) -> Self {
        settings.incidents = in_order(settings.incidents, |incident| incident.at_secs);
        Self {
            noise: Noise::seeded(settings.seed),
            battery: Battery::new(settings.battery_percent, settings.drain_percent_per_hour),
            settings,
            now_secs: 0.0,
            subscribed: Vec::new(),
            streams: Vec::new(),
            pulses: None,
            heart_rates: 0,
            heart_rate_bpm: 0,
            answers: Vec::new(),
            armed: Vec::new(),
            is_stalled: false,
            is_moving: false,
            is_off: false,
        }
    }

    /// The settings of the sensor.
    pub const fn settings(&self) -> &VeritySettings {
        &self.settings
    }

    /// Whether any stream is active.
    pub fn is_streaming(&self) -> bool {
        !self.streams.is_empty() || self.pulses.is_some()
    }

    pub(super) fn lose_link(&mut self) {
        self.subscribed.clear();
        self.answers.clear();
    }

    pub(super) fn listen(&mut self, characteristic: Characteristic) -> Result<(), AttError> {
        use Characteristic::{Battery, Control, Data, HeartRate};
        if !matches!(characteristic, HeartRate | Battery | Control | Data) {
            return Err(AttError::NotPermitted);
        }
        if !self.subscribed.contains(&characteristic) {
            self.subscribed.push(characteristic);
        }
        Ok(())
    }

    pub(super) fn unlisten(&mut self, characteristic: Characteristic) {
        self.subscribed.retain(|one| *one != characteristic);
    }

    pub(super) fn value(&self, characteristic: Characteristic) -> Result<Vec<u8>, AttError> {
        match characteristic {
            Characteristic::Battery => Ok(vec![self.battery.percent(self.now_secs)]),
            Characteristic::SensorLocation => Ok(vec![0]), // the arm has no assigned number
            Characteristic::Manufacturer => Ok(b"Polar Electro Oy\0".to_vec()),
            Characteristic::Model => Ok(self.settings.model.number().to_vec()),
            Characteristic::Serial => Ok(self.settings.serial.clone().into_bytes()),
            Characteristic::Firmware => Ok(b"2.1.0\0".to_vec()),
            Characteristic::Control => Ok(FEATURES.to_vec()),
            Characteristic::HeartRate | Characteristic::Data => Err(AttError::NotPermitted),
        }
    }

    /// Handles a command; its answer is sent a little later.
    pub(super) fn command(&mut self, command: &[u8]) -> Result<(), AttError> {
        if !self.subscribed.contains(&Characteristic::Control) {
            return Err(AttError::NotSubscribed);
        }
        let VeritySettings { model, reports_false_rate, .. } = self.settings;
        let asked = control::parse(command, model, reports_false_rate);
        let result = asked.and_then(|asked| self.carry_out(asked));
        self.answers.push((self.now_secs + ANSWER_SECS, answer(command, result)));
        Ok(())
    }

    /// Returns the parameters of the answer, or the status of a refusal.
    fn carry_out(&mut self, asked: Asked) -> Result<Vec<u8>, u8> {
        let VeritySettings { model, reports_false_rate, .. } = self.settings;
        match asked {
            Asked::Settings(kind) => Ok(kind.offered(model, reports_false_rate)),
            Asked::Start(kind) if self.has(kind) => Err(ALREADY_IN_STATE),
            Asked::Start(kind) => {
                if kind == Kind::Intervals {
                    self.pulses = Some(Pulses::new(self.now_secs));
                } else {
                    let stream = Stream::new(kind, model, self.now_secs, self.quartz());
                    self.streams.push(stream);
                }
                self.is_stalled = false;
                Ok(kind.started(model))
            }
            Asked::Stop(kind) if !self.has(kind) => Err(ALREADY_IN_STATE),
            Asked::Stop(Kind::Intervals) => {
                self.pulses = None;
                Ok(Vec::new())
            }
            Asked::Stop(kind) => {
                self.streams.retain(|stream| stream.kind != kind);
                Ok(Vec::new())
            }
        }
    }

    fn has(&self, kind: Kind) -> bool {
        match kind {
            Kind::Intervals => self.pulses.is_some(),
            kind => self.streams.iter().any(|stream| stream.kind == kind),
        }
    }

    fn quartz(&self) -> f64 {
        1.0 + self.settings.clock_fast
    }

    pub(super) fn sent_until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let mut sent = Vec::new();
        while let Some((at_secs, next)) = self.next().filter(|(at_secs, _)| *at_secs <= secs) {
            self.now_secs = self.now_secs.max(at_secs);
            match next {
                Next::Incident => sent.extend(self.suffer()),
                Next::Answer => sent.extend(self.answer()),
                Next::HeartRate => sent.extend(self.heart_rate(wearer)),
                Next::Battery => {
                    let level = self.battery.report(self.now_secs);
                    sent.extend(self.send(Characteristic::Battery, vec![level]));
                }
                Next::Frames(at) => sent.extend(self.frames(at, wearer)),
                Next::Pulses => sent.extend(self.intervals(wearer)),
            }
        }
        self.now_secs = self.now_secs.max(secs);
        sent
    }

    /// Returns what happens next, and when; if several happen at the same time, the first of them.
    fn next(&self) -> Option<(f64, Next)> {
        let incident = self.settings.incidents.first().map(|one| (one.at_secs, Next::Incident));
        let answer = self.answers.first().map(|(at_secs, _)| (*at_secs, Next::Answer));
        let heart_rate_secs = (self.heart_rates + 1) as f64 * HEART_RATE_SECS;
        let always = [(heart_rate_secs, Next::HeartRate), (self.battery.due_secs(), Next::Battery)];
        let frames = self.streams.iter().enumerate();
        let frames = frames.map(|(at, stream)| (stream.due_secs(), Next::Frames(at)));
        let pulses = self.pulses.map(|pulses| (pulses.due_secs(), Next::Pulses));
        let all = incident.into_iter().chain(answer).chain(always).chain(frames).chain(pulses);
        all.min_by(|(one, _), (other, _)| one.total_cmp(other))
    }

    fn suffer(&mut self) -> Option<Notice> {
        let VerityIncident { fault, .. } = self.settings.incidents.remove(0);
        match fault {
            VerityFault::Stall => self.is_stalled = true,
            VerityFault::Moving => self.is_moving = true,
            VerityFault::Still => self.is_moving = false,
            VerityFault::Off => self.is_off = true,
            VerityFault::On => self.is_off = false,
            VerityFault::Stopped => return self.stop_by_itself(),
            fault => self.armed.push(fault),
        }
        None
    }

    /// Returns the report that the sensor stopped by itself: the code of a request for settings, and the stopped
    /// measurements.
    fn stop_by_itself(&mut self) -> Option<Notice> {
        let mut report = vec![0x01];
        report.extend(self.streams.drain(..).map(|stream| stream.kind as u8));
        report.extend(self.pulses.take().map(|_| Kind::Intervals as u8));
        if report.len() > 1 { self.send(Characteristic::Control, report) } else { None }
    }

    /// Whether a pending fault occurs now; it is then no longer pending.
    fn strikes(&mut self, fault: VerityFault) -> bool {
        let found = self.armed.iter().position(|armed| *armed == fault);
        found.map(|at| self.armed.remove(at)).is_some()
    }

    fn answer(&mut self) -> Option<Notice> {
        let (_, answer) = self.answers.remove(0);
        if self.strikes(VerityFault::LostAnswer) {
            return None;
        }
        self.send(Characteristic::Control, answer)
    }

    /// Returns the heart rate alone: the sensor sends no intervals by this service, and does not report contact.
    fn heart_rate(&mut self, wearer: &mut dyn Wearer) -> Option<Notice> {
        self.heart_rates += 1;
        let is_slow = self.pulses.is_some();
        if !is_slow || self.heart_rates.is_multiple_of(SLOW_HEART_RATE_SECS) {
            let beats = wearer.beats(self.now_secs - HEART_RATE_OF_SECS, self.now_secs);
            self.heart_rate_bpm = match beats.as_slice() {
                [first, .., last] if !self.is_off => {
                    let interval_secs = (last - first) / (beats.len() - 1) as f64;
                    (60.0 / interval_secs).round().clamp(0.0, 255.0) as u8
                }
                _ => 0,
            };
        }
        self.send(Characteristic::HeartRate, vec![0, self.heart_rate_bpm])
    }

    fn intervals(&mut self, wearer: &mut dyn Wearer) -> Option<Notice> {
        let worn = if self.is_off { None } else { Some(wearer) };
        let frame = self.pulses.as_mut()?.frame(worn, self.is_moving)?;
        self.data(frame)
    }

    fn frames(&mut self, at: usize, wearer: &mut dyn Wearer) -> Vec<Notice> {
        let quartz = self.quartz();
        let Some(stream) = self.streams.get_mut(at) else { return Vec::new() };
        let frames = if self.is_off {
            stream.frames(&mut OffSkin(&mut self.noise), quartz)
        } else {
            stream.frames(wearer, quartz)
        };
        frames.into_iter().filter_map(|frame| self.data(frame)).collect()
    }

    /// Sends a frame, to which faults may apply.
    fn data(&mut self, mut frame: Vec<u8>) -> Option<Notice> {
        if self.strikes(VerityFault::LostFrame) || self.is_stalled {
            return None;
        }
        let byte = |fault: &VerityFault| match fault {
            VerityFault::CorruptByte(at) => Some(*at),
            _ => None,
        };
        if let Some(at) = self.armed.iter().find_map(byte) {
            self.strikes(VerityFault::CorruptByte(at));
            if let Some(byte) = frame.get_mut(at) {
                *byte ^= 0x40;
            }
        }
        self.send(Characteristic::Data, frame)
    }

    fn send(&self, characteristic: Characteristic, value: Vec<u8>) -> Option<Notice> {
        let is_heard = self.subscribed.contains(&characteristic);
        is_heard.then_some(Notice::Value(characteristic.uuid(), value))
    }
}

/// A sensor in the air, which records the light of the room.
struct OffSkin<'a>(&'a mut Noise);

impl Wearer for OffSkin<'_> {
    fn light(&mut self, _: f64) -> f64 {
        0.5 * self.0.normal()
    }
}
