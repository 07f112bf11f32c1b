use std::time::Duration;

use super::command::{Command, EmgMode, Vibration};
use super::emg::Emg;
use super::{CLASSIFIER, COMMAND, EMG, FIRMWARE, IMU, INFORMATION, MOTION};
use crate::cursor::signed;
use crate::gatt::{Request, Uuid};
use crate::outbox::Outbox;
use crate::standard::StandardServices;
use crate::watchdog::Watchdog;
use crate::{Channel, Error, Event, GattSession, Identity, Output, Reading, Session, Stream};

const PATIENCE: Duration = Duration::from_secs(2);
const MOST_RESTARTS: u32 = 3;

/// How often the command to stay awake is repeated; without it, a Myo sleeps after 30 s.
const KEEP_AWAKE: Duration = Duration::from_secs(15);

const EMG_HZ: f64 = 200.0;
const IMU_HZ: f64 = 50.0;

/// The data that a Myo sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MyoSettings {
    /// Whether and how to send EMG at 200 Hz.
    pub emg: EmgMode,
    /// Whether to send orientation, acceleration and rotation at 50 Hz, and taps.
    pub imu: bool,
    /// Whether to send the poses that the armband recognises.
    pub poses: bool,
    /// Whether the armband vibrates when it is connected.
    pub vibrates: bool,
}

impl Default for MyoSettings {
    fn default() -> Self {
        Self { emg: EmgMode::Raw, imu: true, poses: true, vibrates: true }
    }
}

/// A session with a Myo.
///
/// ```
/// use std::time::Duration;
/// use teampulse_devices::myo::{EMG, MyoSession, MyoSettings};
/// use teampulse_devices::{GattSession, Output, Session};
///
/// let mut myo = MyoSession::new(MyoSettings::default());
/// myo.start(Duration::ZERO);
/// myo.receive(EMG[0], &[7; 16], Duration::from_millis(10));
/// let mut samples = 0;
/// while let Some(output) = myo.poll() {
///     if let Output::Reading(reading) = output {
///         samples += reading.values.len() / 8;
///     }
/// }
/// assert_eq!(samples, 2);
/// ```
#[derive(Debug)]
pub struct MyoSession {
    settings: MyoSettings,
    out: Outbox<Request>,
    standard: StandardServices,
    emg: Emg,
    imu_samples: u64,
    /// `Some` while samples are expected.
    watchdog: Option<Watchdog>,
    keep_awake_at: Option<Duration>,
    restarts: u32,
}

impl MyoSession {
    /// Creates a session that has not started.
    pub fn new(settings: MyoSettings) -> Self {
        Self {
            settings,
            out: Outbox::default(),
            standard: StandardServices::default(),
            emg: Emg::default(),
            imu_samples: 0,
            watchdog: None,
            keep_awake_at: None,
            restarts: 0,
        }
    }

    /// Sends a command besides those of the session, such as a vibration.
    pub fn command(&mut self, command: Command) {
        self.out.request(Request::Write(COMMAND, command.encode()));
    }

    fn set_mode(&mut self) {
        let MyoSettings { emg, imu, poses, .. } = self.settings;
        self.command(Command::StayAwake(true));
        self.command(Command::SetMode { emg, imu, poses });
    }

    fn describe(&mut self) {
        if self.settings.emg != EmgMode::Off {
            let names = ["emg1", "emg2", "emg3", "emg4", "emg5", "emg6", "emg7", "emg8"];
            let channels = names.map(|name| Channel::new(name, "")).to_vec();
            let emg = Stream::irregular("emg", channels);
            self.out.stream(Stream { rate_hz: Some(EMG_HZ), in_runs: true, ..emg });
        }
        if self.settings.imu {
            for (name, names, unit, scale) in IMU_STREAMS {
                let channel = |name: &&'static str| Channel::new(name, unit).scaled(scale);
                let channels = names.iter().map(channel).collect();
                let stream = Stream::irregular(name, channels);
                self.out.stream(Stream { rate_hz: Some(IMU_HZ), ..stream });
            }
        }
    }

    fn subscribe(&mut self) {
        let emg = EMG.into_iter().filter(|_| self.settings.emg != EmgMode::Off);
        let imu = [IMU, MOTION].into_iter().filter(|_| self.settings.imu);
        let poses = [CLASSIFIER].into_iter().filter(|_| self.settings.poses);
        for characteristic in emg.chain(imu).chain(poses) {
            self.out.request(Request::Subscribe(characteristic));
        }
    }

    fn receive_imu(&mut self, value: &[u8]) -> bool {
        if value.len() != 20 {
            self.out.discarded("imu", value.len());
            return false;
        }
        let mut numbers = value.chunks(2).map(|pair| f64::from(signed(pair)));
        for (stream, names, ..) in IMU_STREAMS {
            let values = numbers.by_ref().take(names.len()).collect();
            self.out.reading(Reading::untimed(stream, self.imu_samples, values));
        }
        self.imu_samples += 1;
        true
    }

    fn receive_classifier(&mut self, value: &[u8]) {
        let name = match value {
            [1, ..] => "arm_synced",
            [2, ..] => "arm_unsynced",
            [3, pose, 0, ..] => match pose {
                0 => "pose_rest",
                1 => "pose_fist",
                2 => "pose_wave_in",
                3 => "pose_wave_out",
                4 => "pose_fingers_spread",
                5 => "pose_double_tap",
                _ => "pose_unknown",
            },
            [3, _, _, ..] => "pose_unknown",
            [4, ..] => "unlocked",
            [5, ..] => "locked",
            [6, ..] => "sync_failed",
            _ => return self.out.discarded("classifier", value.len()),
        };
        self.out.event(Event::Marker { name, device_time_ns: None });
    }

    fn identify(&mut self, characteristic: Uuid, value: &[u8]) {
        if let (INFORMATION, Some(serial)) = (characteristic, value.first_chunk::<6>()) {
            let digits: Vec<String> =
                serial.iter().rev().map(|byte| format!("{byte:02X}")).collect();
            let value = digits.join(":");
            self.out.event(Event::Identified { part: Identity::Serial, value });
        } else if let (FIRMWARE, Some(version)) = (characteristic, value.first_chunk::<6>()) {
            let numbers: Vec<String> =
                version.chunks(2).map(|pair| signed(pair).to_string()).collect();
            let value = numbers.join(".");
            self.out.event(Event::Identified { part: Identity::Firmware, value });
        } else {
            self.out.discarded("information", value.len());
        }
    }

    fn feed(&mut self, now: Duration) {
        self.restarts = 0;
        if let Some(watchdog) = &mut self.watchdog {
            watchdog.feed(now);
        }
    }

    fn wake(&mut self, now: Duration) {
        let Some(watchdog) = self.watchdog.as_mut().filter(|dog| dog.has_expired(now)) else {
            return;
        };
        let stream = if self.settings.emg == EmgMode::Off { "orientation" } else { "emg" };
        self.out.event(Event::Stalled { stream, quiet: watchdog.quiet(now) });
        if self.restarts == MOST_RESTARTS {
            return self.end(Err(Error::Silent(stream)));
        }
        self.restarts += 1;
        *watchdog = Watchdog::new(now, PATIENCE);
        self.set_mode();
    }

    fn end(&mut self, result: Result<(), Error>) {
        self.watchdog = None;
        self.keep_awake_at = None;
        self.out.done(result);
    }
}

/// A stream of the IMU, in the order of the notification: its name, channels, unit, and the size of one step.
type ImuStream = (&'static str, &'static [&'static str], &'static str, f64);
const IMU_STREAMS: [ImuStream; 3] = [
    ("orientation", &["w", "x", "y", "z"], "", 1.0 / 16384.0),
    ("acceleration", &["x", "y", "z"], "g", 1.0 / 2048.0),
    ("gyroscope", &["x", "y", "z"], "deg/s", 1.0 / 16.0),
];

impl Session for MyoSession {
    type Request = Request;

    fn start(&mut self, now: Duration) {
        self.out.reopen();
        self.restarts = 0;
        self.emg.lose_link(&mut self.out);
        if self.imu_samples > 0 {
            let gap = |(stream, ..): ImuStream| Event::Gap { stream, samples: None };
            IMU_STREAMS.map(gap).into_iter().for_each(|gap| self.out.event(gap));
        }
        self.describe();
        self.subscribe();
        self.set_mode();
        if self.settings.vibrates {
            self.command(Command::Vibrate(Vibration::Short));
        }
        self.out.request(Request::Read(INFORMATION));
        self.out.request(Request::Read(FIRMWARE));
        self.standard.start(&mut self.out);
        let sends = self.settings.emg != EmgMode::Off || self.settings.imu;
        self.watchdog = sends.then_some(Watchdog::new(now, PATIENCE));
        self.keep_awake_at = Some(now.saturating_add(KEEP_AWAKE));
    }

    fn tick(&mut self, now: Duration) {
        self.wake(now);
        if self.keep_awake_at.is_some_and(|at| at <= now) {
            self.keep_awake_at = Some(now.saturating_add(KEEP_AWAKE));
            self.set_mode();
        }
    }

    fn next_tick(&self) -> Option<Duration> {
        let watchdog = self.watchdog.map(|watchdog| watchdog.deadline());
        [watchdog, self.keep_awake_at].into_iter().flatten().min()
    }

    fn stop(&mut self, _now: Duration) {
        self.command(Command::SetMode { emg: EmgMode::Off, imu: false, poses: false });
        self.command(Command::StayAwake(false));
        self.end(Ok(()));
    }

    fn poll(&mut self) -> Option<Output<Request>> {
        self.out.next()
    }
}

impl GattSession for MyoSession {
    fn receive(&mut self, characteristic: Uuid, value: &[u8], now: Duration) {
        if self.out.is_done() || self.standard.receive(characteristic, value, &mut self.out) {
            return;
        }
        let fed = match characteristic {
            IMU => self.receive_imu(value),
            CLASSIFIER => {
                self.receive_classifier(value);
                false
            }
            MOTION => {
                self.out.event(Event::Marker { name: "tap", device_time_ns: None });
                false
            }
            INFORMATION | FIRMWARE => {
                self.identify(characteristic, value);
                false
            }
            _ => {
                let turn = EMG.iter().position(|emg| *emg == characteristic);
                turn.is_some_and(|turn| self.emg.receive(turn, value, &mut self.out))
            }
        };
        if fed {
            self.feed(now);
        }
    }

    fn fail(&mut self, characteristic: Uuid, _now: Duration) {
        if characteristic == COMMAND {
            self.end(Err(Error::Missing("Myo command characteristic")));
        } else if EMG.contains(&characteristic) {
            let reason = "a characteristic can't be subscribed to".to_owned();
            self.out.event(Event::Refused { stream: "emg", reason });
        }
    }
}
