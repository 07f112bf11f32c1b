use std::collections::VecDeque;
use std::time::Duration;

use super::control::{Command, ControlMessage, Features, Response, Status};
use super::feed::Feed;
use super::frame::Frame;
use super::{CONTROL, DATA, Measurement, SettingKind, SettingsList};
use crate::gatt::{Request, Uuid};
use crate::heart_rate::{self, HeartRateReceiver};
use crate::outbox::Outbox;
use crate::standard::StandardServices;
use crate::{Error, Event, GattSession, Output, Session};

/// How long a command waits for its answer, and how many times it is sent.
const ANSWER_PATIENCE: Duration = Duration::from_secs(5);
const MOST_ATTEMPTS: u32 = 3;

/// The pause between the stop and the start of a stream that was already on.
const PAUSE: Duration = Duration::from_secs(1);

/// The longest time that stopping may take.
const STOP_PATIENCE: Duration = Duration::from_secs(3);

/// A measurement to start. Options that are `None` take the largest value that the device offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection {
    /// What to measure.
    pub measurement: Measurement,
    /// The sampling rate \[Hz\], if the device offers it.
    pub rate_hz: Option<u32>,
    /// The range in the measurement's unit (g, deg/s, G), if the device offers it.
    pub range: Option<u32>,
}

impl Selection {
    /// Selects a measurement with the greatest rate and range.
    pub const fn of(measurement: Measurement) -> Self {
        Self { measurement, rate_hz: None, range: None }
    }

    /// Chooses one value for each setting that is offered.
    fn choose(&self, offered: &SettingsList) -> SettingsList {
        let choose = |(kind, values): &(SettingKind, Vec<u32>)| {
            let wanted = match kind {
                SettingKind::Rate => self.rate_hz,
                SettingKind::Range => self.range,
                _ => None,
            };
            let greatest = *values.iter().max()?;
            let value = wanted.filter(|value| values.contains(value)).unwrap_or(greatest);
            self.measurement.is_configured_by(*kind).then(|| (*kind, vec![value]))
        };
        SettingsList(offered.0.iter().filter_map(choose).collect())
    }
}

/// A session with a Polar H10, Verity Sense or OH1: the selected measurements, and heart rate.
///
/// ```
/// use std::time::Duration;
/// use teampulse_devices::polar::{self, Measurement, PolarSession, Selection};
/// use teampulse_devices::{GattSession, Output, Session};
///
/// let mut strap = PolarSession::new(&[Selection::of(Measurement::Ecg)]);
/// strap.start(Duration::ZERO);
/// # let bytes = [0; 16];
/// strap.receive(polar::DATA, &bytes, Duration::from_secs(1)); // a notification
/// while let Some(output) = strap.poll() {
///     match output {
///         Output::Request(request) => println!("do {request:?}"),
///         Output::Reading(reading) => println!("{reading:?}"),
///         other => println!("{other:?}"),
///     }
/// }
/// ```
#[derive(Debug)]
pub struct PolarSession {
    out: Outbox<Request>,
    standard: StandardServices,
    heart_rate: HeartRateReceiver,
    feeds: Vec<Feed>,
    features: Option<Features>,
    /// The deadline for the features, and how often they were requested; `None` once they are known.
    features_by: Option<(Duration, u32)>,
    commands: VecDeque<Command>,
    /// The time until which commands wait.
    pause_until: Duration,
    pending: Option<Pending>,
    stop_by: Option<Duration>,
}

/// The command that is waiting for its answer.
#[derive(Debug)]
struct Pending {
    command: Command,
    parameters: Vec<u8>,
    deadline: Duration,
    attempts: u32,
}

impl PolarSession {
    /// Creates a session that has not started. A measurement that is selected twice counts once.
    pub fn new(selections: &[Selection]) -> Self {
        let mut feeds: Vec<Feed> = Vec::new();
        for selection in selections {
            if feeds.iter().all(|feed| feed.selection.measurement != selection.measurement) {
                feeds.push(Feed::new(*selection));
            }
        }
        Self {
            out: Outbox::default(),
            standard: StandardServices::default(),
            heart_rate: HeartRateReceiver::default(),
            feeds,
            features: None,
            features_by: None,
            commands: VecDeque::new(),
            pause_until: Duration::ZERO,
            pending: None,
            stop_by: None,
        }
    }

    fn receive_control(&mut self, value: &[u8], now: Duration) {
        match ControlMessage::decode(value) {
            Ok(ControlMessage::Features(features)) => self.receive_features(features, now),
            Ok(ControlMessage::Response(response)) => self.receive_response(&response, now),
            Ok(ControlMessage::Stopped(measurements)) => {
                for measurement in measurements {
                    self.restart(measurement, now);
                }
            }
            Err(_) => self.out.discarded("control point", value.len()),
        }
        self.send_next(now);
    }

    fn receive_features(&mut self, features: Features, now: Duration) {
        if self.features.replace(features).is_some() || self.stop_by.is_some() {
            return;
        }
        self.features_by = None;
        if features.has(Measurement::Ecg) {
            self.heart_rate.expect_intervals(&mut self.out);
        }
        for feed in &mut self.feeds {
            let measurement = feed.selection.measurement;
            if !features.has(measurement) {
                let reason = "the device can't measure this".to_owned();
                self.out.event(Event::Refused { stream: measurement.stream(), reason });
            } else if measurement == Measurement::PpInterval {
                self.commands.push_back(feed.configure(SettingsList::default()));
            } else {
                self.commands.push_back(Command::Settings(measurement));
            }
        }
        self.send_next(now);
    }

    fn receive_response(&mut self, response: &Response, now: Duration) {
        let answers = |pending: &mut Pending| {
            pending.command.code() == response.command
                && pending.command.measurement() as u8 == response.measurement & 0x3f
        };
        let Some(mut pending) = self.pending.take_if(answers) else {
            return; // of an earlier connection or attempt
        };
        pending.parameters.extend(&response.parameters);
        if response.more && pending.parameters.len() < MOST_PARAMETERS {
            pending.deadline = now.saturating_add(ANSWER_PATIENCE);
            self.pending = Some(pending);
            return;
        }
        let parameters = SettingsList::decode(&pending.parameters).unwrap_or_default();
        match (pending.command, response.status) {
            (Command::Stop(_), _) => {}
            (Command::Settings(measurement), Status::SUCCESS) => {
                self.receive_offer(measurement, &parameters);
            }
            (Command::Start(measurement, _), status) => {
                self.receive_start(measurement, status, &parameters, now);
            }
            (command, status) => self.refuse(command.measurement(), status),
        }
    }

    fn receive_offer(&mut self, measurement: Measurement, offered: &SettingsList) {
        let Some(feed) = find(&mut self.feeds, measurement) else { return };
        let start = feed.configure(feed.selection.choose(offered));
        self.commands.push_front(start);
    }

    fn receive_start(
        &mut self,
        measurement: Measurement,
        status: Status,
        parameters: &SettingsList,
        now: Duration,
    ) {
        let Some(feed) = find(&mut self.feeds, measurement) else { return };
        match status {
            Status::SUCCESS => feed.run(parameters.factor(), now),
            // The device is measuring, and its first frame just takes long.
            status if feed.is_doubted && status != Status::SUCCESS => feed.is_doubted = false,
            Status::ALREADY_IN_STATE if feed.was_already_on => feed.run(None, now),
            Status::ALREADY_IN_STATE => {
                feed.was_already_on = true;
                self.commands.push_front(feed.start_command());
                self.commands.push_front(Command::Stop(measurement));
            }
            Status::INVALID_MTU | Status::IN_CHARGER => {
                self.end(Err(Error::Refused(status.text())));
            }
            _ => self.refuse(measurement, status),
        }
    }

    fn refuse(&mut self, measurement: Measurement, status: Status) {
        let reason = status.text().to_owned();
        self.out.event(Event::Refused { stream: measurement.stream(), reason });
    }

    /// Restarts a measurement that fell silent or that the device stopped.
    fn restart(&mut self, measurement: Measurement, now: Duration) {
        let Some(feed) = find(&mut self.feeds, measurement) else { return };
        let Some(quiet) = feed.halt(now) else { return };
        let stream = measurement.stream();
        self.out.event(Event::Stalled { stream, quiet });
        if feed.restarts > MOST_ATTEMPTS {
            return self.end(Err(Error::Silent(stream)));
        }
        self.commands.push_back(Command::Stop(measurement));
        self.commands.push_back(feed.start_command());
    }

    fn receive_data(&mut self, value: &[u8], now: Duration) {
        let Ok(frame) = Frame::decode(value) else {
            self.out.discarded("data", value.len());
            return;
        };
        if let Some(feed) = find(&mut self.feeds, frame.measurement) {
            feed.receive(&frame, now, &mut self.out);
        }
    }

    fn send_next(&mut self, now: Duration) {
        if self.out.is_done() || self.pending.is_some() || now < self.pause_until {
            return;
        }
        let Some(command) = self.commands.pop_front() else {
            if self.stop_by.is_some() {
                self.end(Ok(()));
            }
            return;
        };
        self.out.request(Request::Write(CONTROL, command.encode()));
        // A start after a stop waits for a pause.
        if matches!(command, Command::Stop(_)) && self.stop_by.is_none() {
            self.pause_until = now.saturating_add(PAUSE);
        }
        let deadline = now.saturating_add(ANSWER_PATIENCE);
        self.pending = Some(Pending { command, parameters: Vec::new(), deadline, attempts: 1 });
    }

    /// Reads the features again if the control point stayed silent.
    fn ask_features(&mut self, now: Duration) {
        let Some((_, attempts)) = self.features_by.filter(|(by, _)| *by <= now) else { return };
        if attempts == MOST_ATTEMPTS {
            return self.end(Err(Error::NoAnswer("which measurements it has")));
        }
        self.features_by = Some((now.saturating_add(ANSWER_PATIENCE), attempts + 1));
        self.out.request(Request::Read(CONTROL));
    }

    /// Repeats the command that was not answered.
    fn repeat(&mut self, now: Duration) {
        let Some(pending) = self.pending.as_mut().filter(|pending| pending.deadline <= now) else {
            return;
        };
        if pending.attempts == MOST_ATTEMPTS {
            return self.end(Err(Error::NoAnswer("commands")));
        }
        pending.attempts += 1;
        pending.deadline = now.saturating_add(ANSWER_PATIENCE);
        pending.parameters.clear();
        self.out.request(Request::Write(CONTROL, pending.command.encode()));
    }

    fn end(&mut self, result: Result<(), Error>) {
        self.commands.clear();
        self.pending = None;
        self.stop_by = None;
        self.features_by = None;
        for feed in &mut self.feeds {
            feed.forget();
        }
        self.out.done(result);
    }
}

/// The largest size of the parameters in a continued answer [bytes].
const MOST_PARAMETERS: usize = 4096;

fn find(feeds: &mut [Feed], measurement: Measurement) -> Option<&mut Feed> {
    feeds.iter_mut().find(|feed| feed.selection.measurement == measurement)
}

impl Session for PolarSession {
    type Request = Request;

    fn start(&mut self, now: Duration) {
        self.out.reopen();
        self.features = None;
        self.features_by = Some((now.saturating_add(ANSWER_PATIENCE), 1));
        self.commands.clear();
        self.pause_until = now;
        self.pending = None;
        self.stop_by = None;
        for feed in &mut self.feeds {
            feed.forget();
            feed.lose_link();
        }
        for request in
            [Request::Subscribe(CONTROL), Request::Subscribe(DATA), Request::Read(CONTROL)]
        {
            self.out.request(request);
        }
        self.heart_rate.start(&mut self.out);
        self.standard.start(&mut self.out);
    }

    fn tick(&mut self, now: Duration) {
        if self.out.is_done() {
            return;
        }
        if self.stop_by.is_some_and(|by| by <= now) {
            return self.end(Ok(()));
        }
        self.ask_features(now);
        self.repeat(now);
        let doubted =
            self.feeds.iter_mut().filter_map(|feed| feed.doubt(now).then(|| feed.start_command()));
        self.commands.extend(doubted);
        let silent = |feed: &Feed| feed.is_silent(now).then_some(feed.selection.measurement);
        for measurement in self.feeds.iter().filter_map(silent).collect::<Vec<_>>() {
            self.restart(measurement, now);
        }
        self.send_next(now);
    }

    fn next_tick(&self) -> Option<Duration> {
        if self.out.is_done() {
            return None;
        }
        let answer = self.pending.as_ref().map(|pending| pending.deadline);
        let pause =
            (self.pending.is_none() && !self.commands.is_empty()).then_some(self.pause_until);
        let feeds = self.feeds.iter().filter_map(Feed::deadline);
        let features = self.features_by.map(|(by, _)| by);
        feeds.chain(features).chain(answer).chain(pause).chain(self.stop_by).min()
    }

    fn stop(&mut self, now: Duration) {
        if self.out.is_done() {
            return;
        }
        self.features_by = None;
        self.commands.clear();
        // Measurements that seem to be off are stopped, too: they may be on from an earlier connection.
        for feed in &mut self.feeds {
            feed.forget();
            let measurement = feed.selection.measurement;
            if self.features.is_some_and(|features| features.has(measurement)) {
                self.commands.push_back(Command::Stop(measurement));
            }
        }
        self.pending = None;
        self.pause_until = now;
        self.stop_by = Some(now.saturating_add(STOP_PATIENCE));
        self.send_next(now);
    }

    fn poll(&mut self) -> Option<Output<Request>> {
        self.out.next()
    }
}

impl GattSession for PolarSession {
    fn receive(&mut self, characteristic: Uuid, value: &[u8], now: Duration) {
        if self.out.is_done() || self.standard.receive(characteristic, value, &mut self.out) {
            return;
        }
        match characteristic {
            CONTROL => self.receive_control(value, now),
            DATA => self.receive_data(value, now),
            heart_rate::MEASUREMENT => {
                self.heart_rate.receive(value, now, &mut self.out);
            }
            _ => {}
        }
    }

    fn fail(&mut self, characteristic: Uuid, _now: Duration) {
        // A command that failed is repeated at its deadline.
        let is_command = characteristic == CONTROL && self.features.is_some();
        if (characteristic == CONTROL || characteristic == DATA) && !is_command {
            self.end(Err(Error::Missing("Polar Measurement Data service")));
        }
    }
}
