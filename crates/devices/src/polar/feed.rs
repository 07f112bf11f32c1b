use std::time::Duration;

use super::control::Command;
use super::frame::{Frame, PpInterval};
use super::layout::Layout;
use super::session::Selection;
use super::timeline::{Before, Timeline};
use super::{Measurement, SettingKind, SettingsList};
use crate::gatt::Request;
use crate::outbox::Outbox;
use crate::watchdog::Watchdog;
use crate::{Channel, Event, Reading, Stream};

/// The time within which the first ECG of an H10 arrives after a connection, which may take 20 to 30 s.
const FIRST_PATIENCE: Duration = Duration::from_secs(30);
const PATIENCE: Duration = Duration::from_secs(3);
/// The time after a start without a first frame, after which the start is requested once more: a device that is already
/// measuring answers so, and continues.
const DOUBT: Duration = Duration::from_secs(10);
/// The time within which pulse intervals arrive: optical sensors send the first after about 25 s, then one every few
/// seconds.
const INTERVAL_PATIENCE: Duration = Duration::from_secs(30);

/// The assumed rate of devices that do not state one.
const DEFAULT_RATE_HZ: f64 = 130.0;

/// One selected measurement, with its settings, timeline and watchdog.
#[derive(Debug)]
pub(super) struct Feed {
    pub selection: Selection,
    /// The number of restarts since the last frame.
    pub restarts: u32,
    /// Whether the device reported that the measurement was on before it was started.
    pub was_already_on: bool,
    /// Whether the device was asked to start once more, to find out whether it is measuring.
    pub is_doubted: bool,
    /// When to ask the device to start once more.
    doubted_at: Option<Duration>,
    settings: SettingsList,
    factor: f64,
    rate_hz: f64,
    described: Option<(Layout, f64, f64)>,
    timeline: Timeline,
    intervals: u64,
    /// Whether the last intervals had times.
    stamps_intervals: Option<bool>,
    /// `Some` while the measurement runs.
    watchdog: Option<Watchdog>,
}

impl Feed {
    pub fn new(selection: Selection) -> Self {
        // The PPG rate that a Verity Sense states may be wrong by more than a factor of two.
        let nominal_is_true = selection.measurement != Measurement::Ppg;
        Self {
            selection,
            restarts: 0,
            was_already_on: false,
            is_doubted: false,
            doubted_at: None,
            settings: SettingsList::default(),
            factor: 1.0,
            rate_hz: DEFAULT_RATE_HZ,
            described: None,
            timeline: Timeline::new(DEFAULT_RATE_HZ, nominal_is_true),
            intervals: 0,
            stamps_intervals: None,
            watchdog: None,
        }
    }

    /// Stores the settings; returns the command that starts the measurement with them.
    pub fn configure(&mut self, settings: SettingsList) -> Command {
        self.settings = settings;
        if let Some(rate @ 1..) = self.settings.values(SettingKind::Rate).first() {
            self.rate_hz = f64::from(*rate);
            self.timeline.set_rate(self.rate_hz);
        }
        self.start_command()
    }

    pub fn start_command(&self) -> Command {
        Command::Start(self.selection.measurement, self.settings.clone())
    }

    /// Records that the measurement was started, so that frames are expected.
    pub fn run(&mut self, factor: Option<f64>, now: Duration) {
        self.factor = factor.unwrap_or(self.factor);
        self.watchdog = Some(Watchdog::new(now, FIRST_PATIENCE));
        // After the second start request no third is needed, and pulse intervals take half a minute in any case.
        let is_again = std::mem::take(&mut self.is_doubted) || self.was_already_on;
        let is_slow = self.selection.measurement == Measurement::PpInterval;
        self.doubted_at = (!is_again && !is_slow).then_some(now.saturating_add(DOUBT));
    }

    /// Whether it is time to ask the device once more to start, to find out whether it is measuring; once per start.
    pub fn doubt(&mut self, now: Duration) -> bool {
        let is_due = self.doubted_at.take_if(|at| *at <= now).is_some();
        self.is_doubted |= is_due;
        is_due
    }

    /// Prepares a restart; returns how long the measurement was silent, if it was running.
    pub fn halt(&mut self, now: Duration) -> Option<Duration> {
        let watchdog = self.watchdog.take()?;
        (self.is_doubted, self.doubted_at) = (false, None);
        self.restarts += 1;
        Some(watchdog.quiet(now))
    }

    /// Resets the state when the link or the session ends.
    pub fn forget(&mut self) {
        self.restarts = 0;
        self.was_already_on = false;
        (self.is_doubted, self.doubted_at) = (false, None);
        self.watchdog = None;
    }

    /// Records that the link was lost.
    pub fn lose_link(&mut self) {
        self.timeline.lose_link();
    }

    pub fn is_silent(&self, now: Duration) -> bool {
        self.watchdog.is_some_and(|watchdog| watchdog.has_expired(now))
    }

    pub fn deadline(&self) -> Option<Duration> {
        let silent = self.watchdog.map(|watchdog| watchdog.deadline());
        silent.into_iter().chain(self.doubted_at).min()
    }

    pub fn receive(&mut self, frame: &Frame<'_>, now: Duration, out: &mut Outbox<Request>) {
        let placed = if frame.measurement == Measurement::PpInterval {
            self.receive_intervals(frame, out)
        } else {
            self.receive_samples(frame, now, out)
        };
        if placed.is_none() {
            return out.discarded(frame.measurement.stream(), frame.payload.len());
        }
        self.restarts = 0;
        self.doubted_at = None;
        if let Some(watchdog) = &mut self.watchdog {
            let intervals = frame.measurement == Measurement::PpInterval;
            *watchdog = Watchdog::new(now, if intervals { INTERVAL_PATIENCE } else { PATIENCE });
        }
    }

    fn receive_samples(
        &mut self,
        frame: &Frame<'_>,
        now: Duration,
        out: &mut Outbox<Request>,
    ) -> Option<()> {
        let layout = frame.layout().ok()?;
        let values = frame.samples().ok()?.values;
        let samples = values.len() / layout.channels.len();
        let timestamp_ns = i64::try_from(frame.timestamp_ns).ok()?;
        if samples == 0 {
            return None;
        }
        let stream = frame.measurement.stream();
        let place = self.timeline.place(timestamp_ns, samples as u64, now)?;
        self.describe(frame, layout, out);
        match place.before {
            Before::Nothing => {}
            Before::Lost(lost) => out.event(Event::Gap { stream, samples: Some(lost) }),
            Before::ClockSet => {
                out.event(Event::ClockSet { stream });
                out.event(Event::Gap { stream, samples: None });
            }
        }
        let device_time_ns = Some(place.first_ns);
        let period_ns = Some(place.period_ns);
        out.reading(Reading { stream, index: place.index, device_time_ns, period_ns, values });
        Some(())
    }

    /// Describes the stream of a frame. Only compressed frames are multiplied by the factor.
    fn describe(&mut self, frame: &Frame<'_>, layout: Layout, out: &mut Outbox<Request>) {
        let factor = if frame.compressed { self.factor } else { 1.0 };
        let description = (layout, factor, self.rate_hz);
        if self.described != Some(description) {
            self.described = Some(description);
            let channels = layout.channels_with_factor(factor);
            let name = frame.measurement.stream();
            out.stream(Stream {
                rate_hz: Some(self.rate_hz),
                has_clock: true,
                in_runs: true,
                ..Stream::irregular(name, channels)
            });
        }
    }

    fn receive_intervals(&mut self, frame: &Frame<'_>, out: &mut Outbox<Request>) -> Option<()> {
        let intervals = PpInterval::decode_all(frame.payload);
        let stream = frame.measurement.stream();
        if frame.compressed || frame.kind != 0 || intervals.is_empty() {
            return None;
        }
        let last_ns = i64::try_from(frame.timestamp_ns).ok().filter(|last_ns| *last_ns != 0);
        let has_clock = last_ns.is_some();
        if self.stamps_intervals.replace(has_clock) != Some(has_clock) {
            let pulses = Stream::irregular(stream, interval_channels());
            out.stream(Stream { has_clock, by_beats: !has_clock, ..pulses });
        }
        if let Some(last_ns) = last_ns {
            for (device_time_ns, pulse) in dated(last_ns, &intervals) {
                self.read_intervals(Some(device_time_ns), &[pulse], out);
            }
        } else {
            self.read_intervals(None, &intervals, out);
        }
        Some(())
    }

    fn read_intervals(
        &mut self,
        device_time_ns: Option<i64>,
        pulses: &[PpInterval],
        out: &mut Outbox<Request>,
    ) {
        let (stream, index) = (Measurement::PpInterval.stream(), self.intervals);
        let values = pulses.iter().copied().flat_map(interval_values).collect();
        self.intervals += pulses.len() as u64;
        out.reading(Reading { stream, index, device_time_ns, period_ns: None, values });
    }
}

/// Returns each pulse with its time; the frame states the time of the last one.
fn dated(last_ns: i64, pulses: &[PpInterval]) -> impl Iterator<Item = (i64, PpInterval)> {
    let after = |pulse: &PpInterval| i64::from(pulse.interval_ms) * 1_000_000;
    let after_first: i64 = pulses.iter().skip(1).map(after).sum();
    let first_ns = last_ns.saturating_sub(after_first);
    pulses.iter().enumerate().scan(first_ns, move |at_ns, (place, pulse)| {
        *at_ns = at_ns.saturating_add(if place == 0 { 0 } else { after(pulse) });
        Some((*at_ns, *pulse))
    })
}

fn interval_channels() -> Vec<Channel> {
    vec![
        Channel::new("pp_interval", "ms"),
        Channel::new("error", "ms"),
        Channel::new("heart_rate", "1/min"),
        Channel::new("moving", ""),
        Channel::new("contact", ""),
    ]
}

fn interval_values(pulse: PpInterval) -> [f64; 5] {
    let flag = |is: bool| f64::from(u8::from(is));
    let heart_rate = if pulse.heart_rate_bpm == 0 { f64::NAN } else { pulse.heart_rate_bpm.into() };
    [
        pulse.interval_ms.into(),
        pulse.error_ms.into(),
        heart_rate,
        flag(pulse.moving),
        pulse.contact.map_or(f64::NAN, flag),
    ]
}
