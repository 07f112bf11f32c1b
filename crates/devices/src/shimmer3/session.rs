use std::collections::VecDeque;
use std::time::Duration;

use super::calibration::Calibration;
use super::channels::BATTERY_V;
use super::framer::{Frame, Framer};
use super::gsr::GsrRange;
use super::packets::Packets;
use super::setup::{Parsed, Reply, Step, inquiry_header};
use super::{Sensors, TICKS_HZ};
use crate::outbox::Outbox;
use crate::watchdog::Watchdog;
use crate::{ByteSession, Channel, Error, Event, Identity, Output, Reading, Session, Stream};

/// The time after a stop within which data of an earlier session may still arrive.
const DRAIN: Duration = Duration::from_millis(300);

const ANSWER_PATIENCE: Duration = Duration::from_secs(1);
const PATIENCE: Duration = Duration::from_secs(2);
const MOST_RESTARTS: u32 = 3;
const STOP_PATIENCE: Duration = Duration::from_millis(500);

/// The largest number of bytes kept; the longest reply is a calibration.
const MOST_KEPT: usize = 1024;

const STOP: u8 = 0x20;
const CHECKSUM: u8 = 0x8b;

/// The sensors to read, and their rate.
#[derive(Clone, Debug, PartialEq)]
pub struct ShimmerSettings {
    /// The sampling rate \[Hz\]; the device uses 32768 Hz divided by a whole number. More than 256 Hz from several
    /// sensors exceeds what the radio can carry.
    pub rate_hz: f64,
    /// The sensors to read.
    pub sensors: Sensors,
    /// The range of the skin conductance.
    pub gsr_range: GsrRange,
}

impl Default for ShimmerSettings {
    fn default() -> Self {
        let sensors = Sensors::GSR | Sensors::PPG;
        Self { rate_hz: 128.0, sensors, gsr_range: GsrRange::Automatic }
    }
}

impl ShimmerSettings {
    fn interval_ticks(&self) -> u16 {
        (f64::from(TICKS_HZ) / self.rate_hz).round().clamp(1.0, 65535.0) as u16
    }
}

/// A session with a Shimmer3.
///
/// ```
/// use std::time::Duration;
/// use teampulse_devices::shimmer3::{ShimmerSession, ShimmerSettings};
/// use teampulse_devices::{ByteSession, Output, Session};
///
/// let mut shimmer = ShimmerSession::new(ShimmerSettings::default());
/// shimmer.start(Duration::ZERO);
/// assert_eq!(shimmer.poll(), Some(Output::Request(vec![0x20]))); // stop what may be left
/// assert_eq!(shimmer.poll(), Some(Output::Request(vec![0x8b, 0]))); // and its checksums
/// let drained = shimmer.next_tick().expect("it waits for what is left");
/// shimmer.tick(drained);
/// assert_eq!(shimmer.poll(), Some(Output::Request(vec![0x3f]))); // which hardware?
/// ```
#[derive(Debug)]
pub struct ShimmerSession {
    settings: ShimmerSettings,
    out: Outbox<Vec<u8>>,
    state: State,
    steps: VecDeque<Step>,
    kept: Vec<u8>,
    is_wide: bool,
    is_checked: bool,
    interval_ticks: u16,
    calibrations: Vec<u8>,
    packets: Packets,
    batteries: u64,
    restarts: u32,
}

#[derive(Debug)]
enum State {
    Idle,
    /// Until this time, arriving data belong to an earlier session.
    Draining(Duration),
    /// The first step waits for its reply until this time.
    Asking(Duration),
    Streaming(Box<Framer>, Watchdog),
    Stopping(Box<Framer>, Duration),
}

impl ShimmerSession {
    /// Creates a session that has not started.
    pub fn new(settings: ShimmerSettings) -> Self {
        Self {
            interval_ticks: settings.interval_ticks(),
            packets: Packets::new(settings.gsr_range),
            settings,
            out: Outbox::default(),
            state: State::Idle,
            steps: VecDeque::new(),
            kept: Vec::new(),
            is_wide: false,
            is_checked: false,
            calibrations: Vec::new(),
            batteries: 0,
            restarts: 0,
        }
    }

    /// Stops any earlier session, and begins.
    fn begin(&mut self, now: Duration) {
        self.kept.clear();
        self.is_checked = false;
        self.out.request(vec![STOP]);
        self.out.request(vec![CHECKSUM, 0]);
        self.state = State::Draining(now.saturating_add(DRAIN));
        let [low, high] = self.settings.interval_ticks().to_le_bytes();
        let [first, second, third, _] = self.settings.sensors.0.to_le_bytes();
        let optical = u8::from(self.settings.sensors.has(Sensors::PPG));
        self.steps = VecDeque::from([
            Step::new([0x3f], Reply::Hardware),
            Step::new([0x2e], Reply::Firmware),
            Step::optional([0xa3, 0], Reply::Nothing),
            Step::optional([0x2c], Reply::Calibration),
            Step::optional([0x95], Reply::Battery),
            Step::new([0x05, low, high], Reply::Nothing),
            Step::new([0x08, first, second, third], Reply::Nothing),
            Step::new([0x21, self.settings.gsr_range as u8], Reply::Nothing),
            Step::new([0x5e, optical], Reply::Nothing),
            Step::new([0x01], Reply::Inquiry),
            Step::optional([CHECKSUM, 2], Reply::Checksum),
        ]);
    }

    fn restart(&mut self, failure: Error, now: Duration) {
        if self.restarts == MOST_RESTARTS {
            return self.end(Err(failure));
        }
        self.restarts += 1;
        self.begin(now);
    }

    /// Sends the next request; starts streaming after the last.
    fn ask(&mut self, now: Duration) {
        if let Some(step) = self.steps.front() {
            self.out.request(step.command.clone());
            self.state = State::Asking(now.saturating_add(ANSWER_PATIENCE));
            return;
        }
        let Some(length) = self.packets.packet_length() else {
            return self.end(Err(Error::Refused("a channel is unknown")));
        };
        self.out.request(vec![0x07]);
        let framer = Framer::new(length, self.interval_ticks.into(), self.is_checked);
        self.state = State::Streaming(Box::new(framer), Watchdog::new(now, PATIENCE));
    }

    fn receive_replies(&mut self, bytes: &[u8], now: Duration) {
        for piece in bytes.chunks(MOST_KEPT) {
            self.kept.extend_from_slice(piece);
            while let (State::Asking(_), Some(step)) = (&self.state, self.steps.front()) {
                let reply = step.reply;
                match reply.parse(&self.kept, self.is_wide) {
                    Parsed::NotYet => break,
                    Parsed::Skip { bytes, noise } => {
                        self.kept.drain(..bytes);
                        if noise {
                            self.out.discarded("reply", bytes);
                        }
                    }
                    Parsed::Refused(bytes) => {
                        self.kept.drain(..bytes);
                        self.skip(now);
                    }
                    Parsed::Done(body, bytes) => {
                        self.kept.drain(..bytes);
                        self.steps.pop_front();
                        self.receive_reply(reply, &body);
                        self.ask(now);
                    }
                }
            }
            if let State::Streaming(..) = self.state {
                let rest = std::mem::take(&mut self.kept);
                self.receive_stream(&rest, now);
            }
        }
    }

    /// Skips a step that was refused or not answered.
    fn skip(&mut self, now: Duration) {
        match self.steps.pop_front() {
            Some(step) if step.optional => self.ask(now),
            _ => self.restart(Error::Refused("a setting"), now),
        }
    }

    fn receive_reply(&mut self, reply: Reply, body: &[u8]) {
        match (reply, body) {
            (Reply::Checksum, _) => self.is_checked = true,
            (Reply::Hardware, [version, ..]) => {
                self.is_wide = *version == 10;
                let model = match version {
                    3 => "Shimmer3".to_owned(),
                    10 => "Shimmer3R".to_owned(),
                    version => format!("Shimmer hardware {version}"),
                };
                self.out.event(Event::Identified { part: Identity::Model, value: model });
            }
            (Reply::Firmware, [_, _, major, major_high, minor, release]) => {
                let major = u16::from_le_bytes([*major, *major_high]);
                let value = format!("{major}.{minor}.{release}");
                self.out.event(Event::Identified { part: Identity::Firmware, value });
            }
            (Reply::Battery, [low, high, ..]) => {
                self.receive_battery(u16::from_le_bytes([*low, *high]));
            }
            (Reply::Calibration, body) => self.calibrations = body.to_vec(),
            (Reply::Inquiry, [low, high, ..]) => {
                let channels = body.get(inquiry_header(self.is_wide)..).unwrap_or_default();
                self.receive_inquiry(u16::from_le_bytes([*low, *high]), channels);
            }
            _ => {}
        }
    }

    fn receive_inquiry(&mut self, interval_ticks: u16, channels: &[u8]) {
        self.interval_ticks = interval_ticks.max(2);
        let rate_hz = f64::from(TICKS_HZ) / f64::from(self.interval_ticks);
        let calibrations = calibrations(&self.calibrations);
        for stream in self.packets.describe(channels, &calibrations, self.interval_ticks.into()) {
            self.out.stream(Stream { rate_hz: Some(rate_hz), ..stream });
        }
    }

    fn receive_battery(&mut self, adc: u16) {
        if self.batteries == 0 {
            let channels = vec![Channel::new("voltage", "V").scaled(BATTERY_V)];
            self.out.stream(Stream::irregular("battery", channels));
        }
        self.out.reading(Reading::untimed("battery", self.batteries, vec![adc.into()]));
        self.batteries += 1;
    }

    fn receive_stream(&mut self, bytes: &[u8], now: Duration) {
        let (State::Streaming(framer, _) | State::Stopping(framer, _)) = &mut self.state else {
            return;
        };
        let mut frames = Vec::new();
        framer.push(bytes, |frame, discarded| frames.push((frame, discarded)));
        for (frame, discarded) in frames {
            if discarded > 0 {
                self.out.discarded("packets", discarded);
            }
            self.receive_frame(frame, now);
        }
    }

    fn receive_frame(&mut self, frame: Frame, now: Duration) {
        match (frame, &mut self.state) {
            (Frame::Packet { ticks, channels }, state) => {
                if let State::Streaming(_, watchdog) = state {
                    watchdog.feed(now);
                }
                self.restarts = 0;
                self.packets.receive(ticks, &channels, now, &mut self.out);
            }
            (Frame::Acknowledged, State::Stopping(..)) => self.end(Ok(())),
            (Frame::Battery { adc, .. }, _) => self.receive_battery(adc),
            _ => {}
        }
    }

    fn end(&mut self, result: Result<(), Error>) {
        self.state = State::Idle;
        self.steps.clear();
        self.kept.clear();
        self.out.done(result);
    }
}

/// Returns the calibrations, in the order of the reply; the sensitivity of the gyroscope is in hundredths.
fn calibrations(bytes: &[u8]) -> [(&'static str, Option<Calibration>); 4] {
    let of = |at: usize, scale| {
        let bytes = bytes.as_chunks::<{ Calibration::BYTES }>().0.get(at)?;
        Calibration::decode(bytes, scale)
    };
    [
        ("acceleration_low_noise", of(0, 1.0)),
        ("gyroscope", of(1, 0.01)),
        ("magnetometer", of(2, 1.0)),
        ("acceleration_wide_range", of(3, 1.0)),
    ]
}

impl Session for ShimmerSession {
    type Request = Vec<u8>;

    fn start(&mut self, now: Duration) {
        self.out.reopen();
        self.restarts = 0;
        self.packets.lose_link(&mut self.out);
        self.begin(now);
    }

    fn tick(&mut self, now: Duration) {
        match &self.state {
            State::Draining(until) if *until <= now => {
                self.kept.clear();
                self.ask(now);
            }
            State::Asking(until) if *until <= now => {
                self.kept.clear();
                match self.steps.front() {
                    Some(step) if step.optional => self.skip(now),
                    _ => self.restart(Error::NoAnswer("commands"), now),
                }
            }
            State::Streaming(_, watchdog) if watchdog.has_expired(now) => {
                let quiet = watchdog.quiet(now);
                self.out.event(Event::Stalled { stream: "packets", quiet });
                self.restart(Error::Silent("packets"), now);
            }
            State::Stopping(_, by) if *by <= now => self.end(Ok(())),
            _ => {}
        }
    }

    fn next_tick(&self) -> Option<Duration> {
        match &self.state {
            State::Idle => None,
            State::Draining(at) | State::Asking(at) | State::Stopping(_, at) => Some(*at),
            State::Streaming(_, watchdog) => Some(watchdog.deadline()),
        }
    }

    fn stop(&mut self, now: Duration) {
        if self.out.is_done() || matches!(self.state, State::Stopping(..)) {
            return;
        }
        self.out.request(vec![STOP]);
        let by = now.saturating_add(STOP_PATIENCE);
        self.state = match std::mem::replace(&mut self.state, State::Idle) {
            State::Streaming(framer, _) => State::Stopping(framer, by),
            _ => State::Stopping(Box::new(Framer::new(4, 2, false)), by),
        };
    }

    fn poll(&mut self) -> Option<Output<Vec<u8>>> {
        self.out.next()
    }
}

impl ByteSession for ShimmerSession {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        match self.state {
            State::Idle | State::Draining(_) => {}
            State::Asking(_) => self.receive_replies(bytes, now),
            State::Streaming(..) | State::Stopping(..) => self.receive_stream(bytes, now),
        }
    }
}
