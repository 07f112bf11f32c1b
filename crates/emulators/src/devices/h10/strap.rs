use super::control::{self, ALREADY_IN_STATE, Asked, FEATURES, INVALID_MTU, Kind, SUCCESS};
use super::stream::Stream;
use crate::devices::Wearer;
use crate::noise::Noise;

/// Between two notifications of the heart rate \[s\].
const HEART_RATE_SECS: f64 = 1.0;

/// Off the skin an H10 without streams ends its link after this \[s\] (known issues of Polar's SDK).
const OFF_SKIN_SECS: f64 = 45.0;

/// The least MTU with which it streams: a frame is one packet.
const LEAST_MTU: u16 = 232;

/// An answer comes after this \[s\].
const ANSWER_SECS: f64 = 0.02;

/// What can be read, written or subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Characteristic {
    /// Heart Rate Measurement, 0x2A37.
    HeartRate,
    /// Battery Level, 0x2A19.
    Battery,
    /// Manufacturer Name, 0x2A29.
    Manufacturer,
    /// Model Number, 0x2A24.
    Model,
    /// The control point of the PMD service, FB005C81.
    Control,
    /// The data of the PMD service, FB005C82.
    Data,
}

/// Why a request failed, as the link says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AttError {
    /// Written before it was subscribed to.
    #[error("the client has not subscribed to the characteristic")]
    NotSubscribed,
    /// It can't be read, or can't be written.
    #[error("the characteristic does not permit this")]
    NotPermitted,
}

/// What an H10 is like.
#[derive(Clone, Debug)]
pub struct H10Settings {
    /// How much faster than true its clock runs: 0.02 for 2 %.
    pub clock_fast: f64,
    /// The first frame begins this long after its start \[s\]; up to 30 s are known.
    pub start_delay_secs: f64,
    /// The MTU of the link.
    pub mtu: u16,
    /// What goes wrong, in the order of time.
    pub incidents: Vec<Incident>,
    /// Of the noise off the skin.
    pub seed: u64,
}

impl Default for H10Settings {
    fn default() -> Self {
        let (clock_fast, start_delay_secs) = (0.0, 0.0);
        Self { clock_fast, start_delay_secs, mtu: LEAST_MTU, incidents: Vec::new(), seed: 1 }
    }
}

/// Something that goes wrong at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// From when on \[s\].
    pub at_secs: f64,
    /// What.
    pub fault: Fault,
}

/// What may go wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The next frame is not sent.
    LostFrame,
    /// The next frame is sent twice.
    RepeatedFrame,
    /// A bit of this byte of the next frame is flipped.
    CorruptByte(usize),
    /// No frame is sent until the stream is started again.
    Stall,
    /// The clock is set forward \[ns\].
    ClockSet(u64),
    /// The next answer is not sent.
    LostAnswer,
    /// The strap is taken off: it measures noise and no beats.
    StrapOff,
    /// It is put on again.
    StrapOn,
}

/// What an H10 sends.
#[derive(Clone, Debug, PartialEq)]
pub enum Sent {
    /// A notification or indication, at a time \[s\].
    Value(f64, Characteristic, Vec<u8>),
    /// It ends the link, at a time \[s\].
    LinkLost(f64),
}

/// An H10. Times are true seconds since it was switched on, and never go back.
#[derive(Debug)]
pub struct H10 {
    settings: H10Settings,
    now_secs: f64,
    subscribed: Vec<Characteristic>,
    streams: Vec<Stream>,
    heart_rate_secs: f64,
    last_beat_secs: Option<f64>,
    answers: Vec<(f64, Vec<u8>)>,
    armed: Vec<Fault>,
    stalled: bool,
    off_since_secs: Option<f64>,
    set_by_ns: u64,
    noise: Noise,
}

impl H10 {
    /// Switched on, with nobody connected.
    pub fn new(settings: H10Settings) -> Self {
        Self {
            noise: Noise::seeded(settings.seed),
            settings,
            now_secs: 0.0,
            subscribed: Vec::new(),
            streams: Vec::new(),
            heart_rate_secs: 0.0,
            last_beat_secs: None,
            answers: Vec::new(),
            armed: Vec::new(),
            stalled: false,
            off_since_secs: None,
            set_by_ns: 0,
        }
    }

    /// The link was lost: subscriptions end, and what streams goes on streaming.
    pub fn disconnect(&mut self) {
        self.subscribed.clear();
        self.answers.clear();
    }

    /// Whether anything streams: it would go on until the battery is empty.
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

    /// Reads a value. That of the control point is always the features.
    pub fn read(&self, characteristic: Characteristic) -> Result<Vec<u8>, AttError> {
        match characteristic {
            Characteristic::Battery => Ok(vec![87]),
            Characteristic::Manufacturer => Ok(b"Polar Electro Oy\0".to_vec()),
            Characteristic::Model => Ok(b"H10\0".to_vec()),
            Characteristic::Control => Ok(FEATURES.to_vec()),
            Characteristic::HeartRate | Characteristic::Data => Err(AttError::NotPermitted),
        }
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
        let result = asked.and_then(|asked| self.carry_out(asked));
        let mut answer = vec![0xf0];
        answer.extend(value.iter().chain(&[0, 0]).take(2));
        match result {
            Ok(parameters) => {
                answer.extend([SUCCESS, 0]);
                answer.extend(parameters);
            }
            Err(status) => answer.push(status),
        }
        self.answers.push((self.now_secs + ANSWER_SECS, answer));
        Ok(())
    }

    /// The parameters of the answer, or the status of a refusal.
    fn carry_out(&mut self, asked: Asked) -> Result<Vec<u8>, u8> {
        match asked {
            Asked::Settings(kind) => Ok(kind.offered()),
            Asked::Start(..) if self.settings.mtu < LEAST_MTU => Err(INVALID_MTU),
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

    /// What it sends until then, in the order of time.
    pub fn until(&mut self, secs: f64, wearer: &mut dyn Wearer) -> Vec<Sent> {
        let mut sent = Vec::new();
        while let Some((at_secs, next)) = self.next().filter(|(at_secs, _)| *at_secs <= secs) {
            self.now_secs = self.now_secs.max(at_secs);
            match next {
                Next::Incident => self.suffer(),
                Next::Answer => sent.extend(self.answer()),
                Next::HeartRate => sent.extend(self.heart_rate(wearer)),
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

    /// What happens next, and when; the first of what happens together.
    fn next(&self) -> Option<(f64, Next)> {
        let incident = self.settings.incidents.first().map(|one| (one.at_secs, Next::Incident));
        let answer = self.answers.first().map(|(at_secs, _)| (*at_secs, Next::Answer));
        let heart_rate = (self.heart_rate_secs + HEART_RATE_SECS, Next::HeartRate);
        let frames = self.streams.iter().enumerate();
        let frames = frames.map(|(at, stream)| (stream.due_secs(), Next::Frame(at)));
        let off = self.off_since_secs.filter(|_| !self.is_streaming());
        let lost = off.map(|since_secs| (since_secs + OFF_SKIN_SECS, Next::LinkLost));
        let all = incident.into_iter().chain(answer).chain([heart_rate]).chain(frames).chain(lost);
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

    /// Whether a fault that waits for its moment strikes now.
    fn strikes(&mut self, fault: Fault) -> bool {
        let found = self.armed.iter().position(|armed| *armed == fault);
        found.map(|at| self.armed.remove(at)).is_some()
    }

    fn answer(&mut self) -> Option<Sent> {
        let (at_secs, answer) = self.answers.remove(0);
        let lost = self.strikes(Fault::LostAnswer);
        (!lost).then_some(Sent::Value(at_secs, Characteristic::Control, answer))
    }

    /// The rate of the last beats, and every interval since the last notification.
    fn heart_rate(&mut self, wearer: &mut dyn Wearer) -> Option<Sent> {
        let from_secs = std::mem::replace(&mut self.heart_rate_secs, self.now_secs);
        let mut value = vec![0x10, 0];
        if self.off_since_secs.is_none() {
            for beat_secs in wearer.beats(from_secs, self.now_secs) {
                if let Some(last_secs) = self.last_beat_secs.replace(beat_secs) {
                    let interval_secs = (beat_secs - last_secs) * self.quartz();
                    value.extend(((interval_secs * 1024.0).round() as u16).to_le_bytes());
                    value[1] = (60.0 / interval_secs).round().clamp(0.0, 255.0) as u8;
                }
            }
        } else {
            self.last_beat_secs = None;
        }
        if value.len() == 2 {
            value[0] = 0;
        }
        let heard = self.subscribed.contains(&Characteristic::HeartRate);
        heard.then_some(Sent::Value(self.now_secs, Characteristic::HeartRate, value))
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
    Frame(usize),
    LinkLost,
}

/// What electrodes in the air see: noise of some millivolts.
struct OffSkin<'a>(&'a mut Noise);

impl Wearer for OffSkin<'_> {
    fn ecg_uv(&mut self, _: f64) -> f64 {
        3000.0 * self.0.normal()
    }
}
