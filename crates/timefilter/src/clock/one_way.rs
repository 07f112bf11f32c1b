//! The clock model of a device that timestamps its data and cannot be probed.

pub(super) mod astray;

use std::collections::VecDeque;

use self::astray::Astray;
use super::counter::Unwrap;
use super::envelope::USUAL_SKEW;
use super::epoch::{Epoch, Packet, Verdict};
use super::trains::{IndexCheck, Trains};
use super::{
    ClockEvent, ClockKind, ClockModel, ClockState, Corrected, KnownDevice, Latency, Stamps,
};

/// How close to zero a restarted clock must be, in addition to the preceding silence [ns].
const NEAR_ZERO_NANOS: i64 = 10_000_000_000;
/// A clock that is set back this far has restarted at a fixed date [s].
const FAR_BACK_SECS: f64 = 86_400.0;
/// The longest batch [ns].
const LONGEST_BATCH_NANOS: f64 = 3.6e12;
/// The most reports that are queued.
const MOST_EVENTS: usize = 16;

/// The prior knowledge of a device's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneWaySettings {
    /// The fixed latency of the device.
    pub latency: Latency,
    /// The time after which its counter wraps [ns]; `None` if it does not.
    pub wraps_nanos: Option<i64>,
    /// The standard deviation of the skew of such clocks [ppm, clamped to 0.001 to 100,000; NaN counts as
    /// the value for quartz].
    pub usual_skew_ppm: f64,
}

impl OneWaySettings {
    /// The settings of a quartz clock that does not wrap.
    pub fn new(latency: Latency) -> OneWaySettings {
        OneWaySettings { latency, wraps_nanos: None, usual_skew_ppm: USUAL_SKEW * 1e6 }
    }

    /// The settings clamped to their ranges.
    pub(super) fn sound(self) -> OneWaySettings {
        let skew_ppm = self.usual_skew_ppm;
        let skew_ppm = if skew_ppm.is_nan() { USUAL_SKEW * 1e6 } else { skew_ppm.clamp(1e-3, 1e5) };
        OneWaySettings { usual_skew_ppm: skew_ppm, ..self }
    }

    /// The settings of a known device.
    pub fn of(device: &KnownDevice) -> OneWaySettings {
        OneWaySettings { wraps_nanos: device.wraps_nanos, ..OneWaySettings::new(device.latency) }
    }
}

/// The model of a device's clock, from the device's timestamps and their arrival.
///
/// The lower envelope of the delays shows the rate of the device's clock; the fixed latency, which timestamps cannot
/// show, is subtracted. The map from device time to session time is strictly increasing in steps of 4 ns or more, and
/// its slope changes by no more than 0.5 ms per second once it has settled. It steps only when the clock was set or
/// restarted: that starts a new epoch, and is reported. While this is undecided, a packet that does not fit is placed
/// at its arrival and marked as disbelieved.
#[derive(Clone, Debug)]
pub struct OneWay {
    settings: OneWaySettings,
    unwrap: Unwrap,
    trains: Trains,
    epoch: Option<Epoch>,
    epochs: u32,
    /// The number of clock resets of unknown size.
    courses: u32,
    astray: Astray,
    /// The last reading, by the device's clock, if it does not fit the epoch.
    unfit: Option<Placed>,
    last_arrival: i64,
    /// The duration of the last batch by the device's clock [s].
    span_secs: f64,
    reported_fast: bool,
    /// Whether device time is derived from the sample indices, so that they cannot confirm it.
    counts: bool,
    events: VecDeque<ClockEvent>,
}

/// A reading's position in its epoch, as device time since the start of the epoch [ns].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placed {
    /// The course of the clock that the reading belongs to: epochs between which the clock was set by a known amount
    /// share one.
    pub course: u32,
    pub first: i64,
    pub last: i64,
    pub packet: Packet,
    pub count: u32,
    /// The slot of the reading's stream among those of the device.
    pub train: usize,
}

impl Placed {
    /// The position in an epoch that began at this device time [ns].
    pub fn since(self, began: i64) -> Placed {
        let since = |device: i64| device.saturating_sub(began);
        Placed { first: since(self.first), last: since(self.last), ..self }
    }

    /// The duration of the batch [ns].
    pub fn span(&self) -> i64 {
        self.last.saturating_sub(self.first)
    }
}

/// A packet, with the data to decide about one that does not fit.
#[derive(Clone, Copy, Debug)]
struct Sent {
    packet: Packet,
    /// The reading of the clock itself [ns].
    raw: i64,
    /// The duration of the batch [ns].
    span: i64,
}

impl OneWay {
    /// The most memory that one instance uses, itself included [B]; at the start of an epoch, two epochs exist briefly.
    pub const MOST_BYTES: usize =
        size_of::<OneWay>() + 2 * Epoch::BYTES + MOST_EVENTS * size_of::<ClockEvent>();

    /// Creates a model that has no data yet.
    pub fn new(settings: OneWaySettings) -> OneWay {
        let settings = settings.sound();
        OneWay {
            settings,
            unwrap: Unwrap::new(settings.wraps_nanos),
            trains: Trains::default(),
            epoch: None,
            epochs: 0,
            courses: 0,
            astray: Astray::default(),
            unfit: None,
            last_arrival: 0,
            span_secs: 0.0,
            reported_fast: false,
            counts: false,
            events: VecDeque::with_capacity(MOST_EVENTS),
        }
    }

    /// Creates the model of a device whose time is derived from sample indices.
    pub(super) fn counting(settings: OneWaySettings) -> OneWay {
        OneWay { counts: true, ..OneWay::new(settings) }
    }

    /// Locates a reading; `None` if it has no device time or one that is rejected.
    pub(super) fn place(&mut self, stamps: &Stamps) -> Option<Placed> {
        self.unfit = None;
        let (device, wrapped) = self.unwrap.follow(stamps.device?, stamps.arrival);
        let raw = self.unwrap.within_a_turn(device);
        let train = self.trains.of(stamps, device);
        let span = self.span(train, stamps);
        let last = device.saturating_add(span);
        let packet = Packet { device: last, arrival: stamps.arrival };
        let ahead = self.epoch.as_ref().and_then(|epoch| epoch.seems_ahead(packet));
        let mut is_behind = false;
        match self.trains.hold(train, stamps, device, ahead) {
            IndexCheck::Consistent => {}
            IndexCheck::Wait => return None,
            IndexCheck::Set(nanos) => self.shift(nanos, raw),
            IndexCheck::Behind => is_behind = true,
        }
        if let Some((declared_nanos, nanos)) = self.trains.take_wrong(train) {
            // The batch period was wrong, so the fit is invalid.
            self.end_epoch();
            self.report(ClockEvent::WrongRate {
                declared_hz: 1e9 / declared_nanos,
                hz: 1e9 / nanos,
            });
            return self.place(stamps);
        }
        let (vouched, period) = self.trains.vouches(train, stamps);
        let sent = Sent { packet, raw, span };
        let is_taken = if is_behind {
            let secs = self.epoch.as_ref().map_or(0.0, |epoch| epoch.ahead(packet));
            self.doubt(sent, secs)
        } else {
            self.take(sent, vouched && !self.counts, period)
        };
        let (course, count) = (self.courses, stamps.count.max(1));
        let read = Placed { course, first: device, last, packet, count, train };
        if !is_taken {
            self.unfit = Some(read);
            return None;
        }
        if wrapped {
            self.report(ClockEvent::Wrapped);
        }
        self.span_secs = span as f64 / 1e9;
        let epoch = self.epoch.as_mut()?;
        let placed = read.since(epoch.origin().device);
        epoch.settle(placed.last);
        Some(placed)
    }

    /// The last reading, by the device's clock since it started, if it was rejected because it does not fit the epoch:
    /// the clock may have been set.
    pub(super) fn unfit(&self) -> Option<Placed> {
        self.unfit
    }

    /// Restarts the model because the true sampling rate [Hz] is not the declared one.
    pub(super) fn begin_anew(&mut self, declared_hz: f64, hz: f64) {
        self.resume();
        self.report(ClockEvent::WrongRate { declared_hz, hz });
    }

    /// Starts an epoch with the next reading, because the device paused for an unknown time.
    pub(super) fn resume(&mut self) {
        self.end_epoch();
        self.trains = Trains::default();
    }

    fn end_epoch(&mut self) {
        self.epochs += u32::from(self.epoch.is_some());
        self.courses += u32::from(self.epoch.is_some());
        self.epoch = None;
    }

    /// The settings that the model was created with.
    pub(super) fn settings(&self) -> OneWaySettings {
        self.settings
    }

    /// The latency to subtract [ns].
    pub(super) fn latency_nanos(&self) -> i64 {
        (self.settings.latency.secs * 1e9).round() as i64
    }

    /// The fallback for an unknown time: the arrival, minus the latency and the duration of the batch.
    pub(super) fn arrived(&self, stamps: &Stamps) -> Corrected {
        let before = self.latency_nanos().saturating_add(sane(stamps.span_nanos()) as i64);
        Corrected {
            measured: stamps.arrival.saturating_sub(before),
            period_nanos: stamps.period_nanos,
            disbelieved: stamps.device.is_some(),
        }
    }

    /// The state, reported as a model of this kind.
    pub(super) fn state_as(&self, kind: ClockKind) -> ClockState {
        let latency = self.settings.latency;
        let unknown = ClockState {
            kind,
            epoch: self.epochs,
            offset_secs: f64::NAN,
            skew_ppm: f64::NAN,
            jitter_secs: f64::NAN,
            uncertainty_secs: f64::NAN,
        };
        self.epoch.as_ref().map_or(unknown, |epoch| ClockState {
            offset_secs: epoch.offset_secs() + latency.secs,
            skew_ppm: epoch.skew_ppm(),
            jitter_secs: epoch.jitter_secs(),
            uncertainty_secs: latency
                .uncertainty_secs
                .hypot(epoch.uncertainty_secs(self.span_secs)),
            ..unknown
        })
    }

    /// The epoch of the last placed reading.
    pub(super) fn epoch(&self) -> Option<&Epoch> {
        self.epoch.as_ref()
    }

    /// Places a reading whose first and last samples have these session times, before the latency is
    /// subtracted [ns].
    pub(super) fn between(&mut self, placed: Placed, first: i64, last: i64) -> Corrected {
        let latency = self.latency_nanos();
        let mut measured = first.saturating_sub(latency);
        let end = last.saturating_sub(latency);
        if placed.count > 1 {
            let before = self.trains.end_before(placed.train);
            if measured <= before && before < end {
                measured = before + 1;
            }
            self.trains.ended(placed.train, end);
        }
        let steps = f64::from(placed.count - 1).max(1.0);
        let period_nanos = (i128::from(end) - i128::from(measured)) as f64 / steps;
        Corrected { measured, period_nanos: period_nanos.max(0.0), disbelieved: false }
    }

    /// The time from the first to the last sample of a batch [ns].
    fn span(&mut self, train: usize, stamps: &Stamps) -> i64 {
        let span = sane(stamps.span_nanos());
        if stamps.count < 2 || span < 1.0 {
            return 0;
        }
        let steps = f64::from(stamps.count - 1);
        sane(steps * self.trains.period(train, span / steps)) as i64
    }

    /// Handles a clock that was set forward by `nanos`.
    fn shift(&mut self, nanos: i64, raw: i64) {
        let Some(epoch) = &mut self.epoch else { return };
        epoch.shift(nanos);
        self.epochs += 1;
        self.trains.begin();
        let secs = nanos as f64 / 1e9;
        self.report_set(secs, (0..NEAR_ZERO_NANOS).contains(&raw) && secs < 0.0);
    }

    fn report_set(&mut self, secs: f64, near_zero: bool) {
        let epoch = self.epochs;
        let restarted = near_zero || secs < -FAR_BACK_SECS;
        self.report(if restarted {
            ClockEvent::Restarted { epoch }
        } else {
            ClockEvent::Jumped { epoch, secs }
        });
    }

    /// Passes a packet to the epoch, or starts a new one; returns whether the packet is accepted.
    fn take(&mut self, sent: Sent, vouched: bool, period: f64) -> bool {
        let Some(epoch) = &mut self.epoch else {
            self.begin(&[sent.packet]);
            return true;
        };
        match epoch.take(sent.packet, vouched, period) {
            Verdict::Runs => {
                let fast = epoch.is_poor() && !self.reported_fast;
                if fast {
                    let ppm = epoch.skew_ppm();
                    self.reported_fast = true;
                    self.report(ClockEvent::Fast { ppm });
                }
            }
            Verdict::Set(secs) => {
                let packets = epoch.raised().to_vec();
                self.begin(&packets);
                self.report(ClockEvent::Jumped { epoch: self.epochs, secs });
                return self.take(sent, vouched, period);
            }
            Verdict::Astray(secs) => return self.doubt(sent, secs),
        }
        self.run_on(sent.packet)
    }

    /// Takes a packet that is early by `secs` [s] according to the epoch, and does not fit it: starts a new
    /// one if enough packets agree. Returns whether the packet is accepted.
    fn doubt(&mut self, sent: Sent, secs: f64) -> bool {
        let Sent { packet, raw, span } = sent;
        if !self.astray.push(packet, span) {
            return false;
        }
        let silence = self.astray.packets[0].arrival.saturating_sub(self.last_arrival);
        let near_zero = silence.saturating_add(NEAR_ZERO_NANOS);
        let packets = self.astray.packets;
        self.begin(&packets);
        self.report_set(secs, (0..near_zero).contains(&raw));
        self.run_on(packet)
    }

    fn run_on(&mut self, packet: Packet) -> bool {
        self.astray = Astray::default();
        self.last_arrival = packet.arrival;
        true
    }

    /// Starts an epoch with its first packets, at least one.
    fn begin(&mut self, packets: &[Packet]) {
        self.epochs += u32::from(self.epoch.is_some());
        self.courses += u32::from(self.epoch.is_some());
        self.trains.begin();
        self.reported_fast = false;
        let Some((first, rest)) = packets.split_first() else { return };
        let mut epoch = Epoch::begin(*first, self.settings.usual_skew_ppm * 1e-6);
        for packet in rest {
            epoch.take(*packet, false, 0.0);
        }
        self.epoch = Some(epoch);
    }

    fn report(&mut self, event: ClockEvent) {
        if self.events.len() < MOST_EVENTS {
            self.events.push_back(event);
        }
    }
}

impl ClockModel for OneWay {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let Some(placed) = self.place(stamps) else { return self.arrived(stamps) };
        let Some(epoch) = &self.epoch else { return self.arrived(stamps) };
        let (first, last) = (epoch.at(placed.first), epoch.at(placed.last));
        self.between(placed, first, last)
    }

    fn state(&self) -> ClockState {
        self.state_as(ClockKind::OneWay)
    }

    fn next_event(&mut self) -> Option<ClockEvent> {
        self.events.pop_front()
    }
}

/// The duration of a batch limited to a usable range [ns].
fn sane(span_nanos: f64) -> f64 {
    if span_nanos > 0.0 { span_nanos.min(LONGEST_BATCH_NANOS) } else { 0.0 }
}

#[cfg(test)]
mod tests;
