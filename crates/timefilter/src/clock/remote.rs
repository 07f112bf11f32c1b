//! The clock model of another computer, which timestamps its own messages.

mod line;
mod envelope;
mod bursts;
mod rejected;
mod backlog;
mod shift;
mod doubt;

use std::collections::VecDeque;

use self::backlog::Backlogs;
use self::bursts::Bursts;
use self::doubt::Doubt;
use self::envelope::{Envelope, Found};
use self::line::LinearFit;
use self::rejected::RejectedDelays;
use self::shift::Shift;
use super::{ClockEvent, ClockKind, ClockModel, ClockState, Corrected, Probe, StampOf, Stamps};

/// How far ahead a computer may be and still be trusted [ns]: synchronised clocks differ by less.
const TRUSTED_AHEAD_NANOS: i64 = 2_000_000;
/// How far behind a computer may seem and still be trusted [ns]: its messages may have been in transit for
/// that long.
const TRUSTED_BEHIND_NANOS: i64 = 50_000_000;
/// How much earlier than all messages before it one may be and still belong to the same clock [ns].
const SOONER_NANOS: i64 = 100_000_000;
/// How much later than the fastest message one may be and still be accepted [ns].
const LATER_NANOS: i64 = 1_000_000_000;
/// How long timestamps must agree before their clock counts as known [ns].
const KNOWN_NANOS: i64 = 500_000_000;
/// How long all timestamps must deviate before the clock counts as having jumped [ns].
const JUMPED_NANOS: i64 = 3_000_000_000;
/// The delay that even the fastest message may have, which one-way timestamps cannot show [ns].
const PATH_NANOS: f64 = 10e6;
/// The delay that a device's sample may have before its computer timestamps it [ns]: the sensor's path,
/// excluding batching.
const SENSED_NANOS: f64 = 300e6;
/// The most reports that are queued.
const MOST_EVENTS: usize = 16;

/// The model of another computer that timestamps its messages.
///
/// Its fastest messages show its offset: if their timestamps are later than their arrival the clock is
/// ahead, and if even they seem old it is behind, or the path is long. A clock less than 2 ms ahead and
/// less than 50 ms behind is trusted: its timestamps are used unchanged. The timestamps of any other clock
/// are shifted by the estimated offset. With probes the offset is known to within half the round trip, and
/// an offset of more than 2 ms, or of more than its uncertainty, is corrected.
///
/// Timestamps later than their arrival mean a clock that is ahead: only the delay is then unknown, and
/// assumed to be below 10 ms. Timestamps earlier than their arrival mean either a clock that is behind or
/// messages that are sent late, which cannot be distinguished without probes: the stated uncertainty is
/// then that whole time plus the delay. Pending corrections increase it, and so do recent messages and
/// bursts of probes that contradict the fitted line, as after a jump.
///
/// The shift follows offset and skew by slewing, so that within an epoch time order is preserved. A timestamp
/// is rejected, and has no effect on the model, if it is more than 0.1 s earlier than the fastest messages
/// allow or more than one second later. Two kinds of late messages are accepted: those that continue their
/// stream in order (a network backlog), and the first message of a stream, if it is at most five seconds late, or not
/// later than the backlog of other streams that is arriving, and the clock is known from probes (its receiver held it
/// until they were answered). If all timestamps are
/// rejected for three seconds, the clock has jumped. A timestamp of zero counts as missing.
///
/// Timestamps of when a device took a measurement ([`StampOf::Measured`]) precede their arrival by the
/// device's delay, so they can show that a clock is ahead but never that it is behind. Without probes and
/// without messages that state when they were sent they are used unchanged, and nothing is known about the
/// clock.
///
/// No reading is placed more than 2 ms after its arrival.
#[derive(Clone, Debug, Default)]
pub struct Remote {
    envelope: Envelope,
    bursts: Bursts,
    rejected: RejectedDelays,
    backlogs: Backlogs,
    shift: Shift,
    doubt: Doubt,
    /// Whether any timestamp referred to the sending of its message.
    has_send_stamps: bool,
    /// Whether the clock is trusted; `None` until it is known.
    trusted: Option<bool>,
    epoch: u32,
    now: i64,
    events: VecDeque<ClockEvent>,
}

impl ClockModel for Remote {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let arrival = stamps.arrival;
        self.pass(arrival);
        let arrived = |disbelieved| Corrected {
            measured: arrival,
            period_nanos: stamps.period_nanos,
            disbelieved,
        };
        let Some(source) = stamps.source.filter(|source| *source != 0) else {
            return arrived(false);
        };
        if source < 0 {
            self.doubt.disbelieve();
            return arrived(true);
        }
        if stamps.stamp_of == StampOf::Kept {
            let measured = self.shift.of(source).min(arrival.saturating_add(TRUSTED_AHEAD_NANOS));
            return Corrected { measured, ..arrived(false) };
        }
        let last = source.saturating_add(stamps.span_nanos() as i64);
        let delay = arrival.saturating_sub(last);
        self.has_send_stamps |= stamps.stamp_of == StampOf::Sent;
        let is_held_up = self.is_held_up(stamps, last, delay);
        if !is_held_up {
            self.consider(delay, stamps.stamp_of);
            let believed = self.believes(delay);
            self.backlogs.judged(stamps.stream, last, believed);
            if !believed {
                self.doubt.disbelieve();
                return arrived(true);
            }
        }
        let shows = !is_held_up && self.is_path_delay(delay, stamps.stamp_of);
        if let Some(offset) = self.offset().filter(|_| shows) {
            self.compare(delay, offset);
            self.envelope.push(arrival, delay);
        }
        let shifted = self.shift.apply(source);
        let measured = shifted.min(arrival.saturating_add(TRUSTED_AHEAD_NANOS));
        Corrected { measured, period_nanos: stamps.period_nanos, disbelieved: false }
    }

    fn probe(&mut self, probe: &Probe) {
        self.pass(probe.arrival);
        self.bursts.push(probe);
    }

    fn tick(&mut self, now: i64) {
        self.pass(now);
    }

    fn state(&self) -> ClockState {
        let (kind, known) = match self.probed() {
            Some(probed) => (ClockKind::TwoWay, Some(probed)),
            None => (ClockKind::Remote, self.envelope.line().map(LinearFit::reversed)),
        };
        let nanos = known.map_or(f64::NAN, |line| line.at(self.now) as f64);
        let steady = match kind {
            ClockKind::TwoWay => self.bursts.knows_skew(),
            _ => self.envelope.knows_skew(),
        };
        ClockState {
            kind,
            epoch: self.epoch,
            offset_secs: nanos * 1e-9,
            skew_ppm: known.filter(|_| steady).map_or(f64::NAN, |line| line.slope * 1e6),
            jitter_secs: self.envelope.spread_nanos() * 1e-9,
            uncertainty_secs: self.uncertainty_nanos() * 1e-9,
        }
    }

    fn next_event(&mut self) -> Option<ClockEvent> {
        self.events.pop_front()
    }
}

impl Remote {
    /// The most memory that one instance uses, itself included [B]; a growing vector briefly exists twice.
    pub const MOST_BYTES: usize = size_of::<Remote>()
        + 2 * (Envelope::BYTES
            + Bursts::BYTES
            + Shift::BYTES
            + Backlogs::BYTES
            + MOST_EVENTS * size_of::<ClockEvent>());

    /// Advances the model to `now`.
    fn pass(&mut self, now: i64) {
        self.now = self.now.max(now);
        match self.envelope.pass(self.now) {
            Found::LinearFit => self.judge(),
            // If probes show that the clock is unchanged, the path has become longer.
            Found::Elsewhere(delay) if self.probed().is_none() => self.jump(delay),
            Found::Elsewhere(_) | Found::Nothing => {}
        }
        if self.bursts.pass(self.now) {
            if let Some(nanos) = self.bursts.take_set() {
                self.envelope.shift(self.now, nanos.saturating_neg());
            }
            self.judge();
        }
    }

    /// Whether the delay of a message, by its timestamp, fits the known clock.
    fn believes(&self, delay: i64) -> bool {
        match self.offset() {
            Some(offset) => {
                let late = delay.saturating_add(offset.at(self.now));
                (-SOONER_NANOS..=LATER_NANOS).contains(&late)
            }
            None => (-TRUSTED_AHEAD_NANOS..=LATER_NANOS).contains(&delay),
        }
    }

    /// Whether a message is too late to be accepted on its own, but continues its stream in order, or begins
    /// it while the clock is known from probes.
    fn is_held_up(&mut self, stamps: &Stamps, last: i64, delay: i64) -> bool {
        let ahead = match (self.offset(), stamps.stamp_of) {
            (Some(offset), _) => offset.at(self.now),
            (None, StampOf::Measured) => 0,
            (None, _) => return false,
        };
        let late = delay.saturating_add(ahead);
        if late <= LATER_NANOS {
            return false;
        }
        let (stream, is_probed) = (stamps.stream, self.probed().is_some());
        (is_probed && self.backlogs.begins(stream, last, self.now, late))
            || self.backlogs.goes_on(stream, last, self.now, late)
    }

    /// Whether a delay is that of the path between the computers, as far as is known.
    fn is_path_delay(&self, delay: i64, stamp_of: StampOf) -> bool {
        let Some(fastest) = self.envelope.line() else { return stamp_of == StampOf::Sent };
        stamp_of == StampOf::Sent || !self.has_send_stamps || delay < fastest.at(self.now)
    }

    /// Establishes the clock from a delay, or detects that it has changed.
    fn consider(&mut self, delay: i64, stamp_of: StampOf) {
        let known = self.offset().is_some();
        if known && self.believes(delay) {
            return self.rejected.forget();
        }
        let ahead = delay.saturating_add(self.offset().map_or(0, |offset| offset.at(self.now)));
        if stamp_of == StampOf::Measured && ahead >= -TRUSTED_AHEAD_NANOS {
            return;
        }
        let patience = if known { JUMPED_NANOS } else { KNOWN_NANOS };
        match self.rejected.push(self.now, delay, patience) {
            Some(lowest) if known => self.jump(lowest),
            Some(lowest) => {
                self.envelope = Envelope::new(self.now, lowest);
                self.rejected.forget();
                self.judge();
            }
            None => {}
        }
    }

    /// Compares a delay with the known offset.
    fn compare(&mut self, delay: i64, offset: LinearFit) {
        let fastest = self.envelope.line().map_or(delay, |line| line.at(self.now));
        let late = delay.saturating_sub(fastest) as f64;
        let ahead = delay.saturating_add(offset.at(self.now)).saturating_neg() as f64;
        self.doubt.push(self.now, late, ahead.max(-late));
    }

    /// Handles a jump of the clock; `delay` is the new delay of the fastest messages.
    fn jump(&mut self, delay: i64) {
        let before = self.offset().map_or(0, |offset| offset.at(self.now));
        let secs = delay.saturating_add(before).saturating_neg() as f64 * 1e-9;
        self.envelope = Envelope::new(self.now, delay);
        self.bursts = Bursts::default();
        self.doubt = Doubt::default();
        self.rejected.forget();
        self.backlogs.forget();
        let was_off = self.trusted.take() == Some(false);
        self.begin_epoch(secs);
        self.judge();
        if was_off && self.trusted == Some(true) {
            self.report(ClockEvent::Trusted);
        }
    }

    fn begin_epoch(&mut self, secs: f64) {
        self.epoch = self.epoch.saturating_add(1);
        self.shift = Shift::default();
        self.report(ClockEvent::Jumped { epoch: self.epoch, secs });
    }

    /// Decides whether the clock is trusted, and steers the shift accordingly.
    fn judge(&mut self) {
        let Some(offset) = self.offset() else { return };
        let nanos = offset.at(self.now);
        let trusted = self.is_near(nanos);
        if !trusted && self.trusted != Some(false) {
            self.report(ClockEvent::Off { secs: nanos as f64 * 1e-9 });
        }
        if trusted && self.trusted == Some(false) {
            self.report(ClockEvent::Trusted);
        }
        self.trusted = Some(trusted);
        let target = if trusted { LinearFit::default() } else { offset };
        let step = target.at(self.now).saturating_sub(self.shift.newest());
        if self.shift.is_used() && step.saturating_abs() > LATER_NANOS {
            self.begin_epoch(step as f64 * 1e-9);
        }
        self.shift.steer(target.at(self.now), target.slope);
    }

    /// Whether a clock this far ahead needs no correction. A corrected clock must come within half the
    /// limit before it is trusted again.
    fn is_near(&self, ahead: i64) -> bool {
        let (most_ahead, most_behind) = match self.probed() {
            Some(_) => {
                let most = TRUSTED_AHEAD_NANOS.max(self.bursts.uncertainty_nanos() as i64);
                (most, most)
            }
            None if self.has_send_stamps => (TRUSTED_AHEAD_NANOS, TRUSTED_BEHIND_NANOS),
            None => (TRUSTED_AHEAD_NANOS, LATER_NANOS),
        };
        let strictness = if self.trusted == Some(false) { 2 } else { 1 };
        (-most_behind / strictness..=most_ahead / strictness).contains(&ahead)
    }

    /// The uncertainty of a time [ns]: pending corrections, unobservable delays, and contradictions of the
    /// fitted line.
    fn uncertainty_nanos(&self) -> f64 {
        let Some(offset) = self.offset() else { return f64::NAN };
        let ahead = offset.at(self.now) as f64;
        let probes = self.probed().map(|_| &self.bursts);
        let is_observed = probes.is_some() || ahead > 0.0;
        let left = if is_observed && self.trusted == Some(false) { 0.0 } else { ahead.abs() };
        let way = if self.has_send_stamps { PATH_NANOS } else { SENSED_NANOS };
        let line = probes.map_or(way, Bursts::uncertainty_nanos);
        let contradiction = probes.map_or(0.0, |probes| probes.doubt_nanos(self.now));
        let doubt = self.doubt.nanos(probes).max(contradiction);
        (left + line + self.unsteered_nanos() + doubt).max(self.arrival_nanos())
    }

    /// The remaining difference between the shift and its target [ns].
    fn unsteered_nanos(&self) -> f64 {
        let Some(offset) = self.offset().filter(|_| self.shift.is_used()) else { return 0.0 };
        let target = if self.trusted == Some(false) { offset.at(self.now) } else { 0 };
        target.saturating_sub(self.shift.newest()).saturating_abs() as f64
    }

    /// The uncertainty of an arrival time used instead of a timestamp [ns]; 0 if none was used.
    fn arrival_nanos(&self) -> f64 {
        if self.doubt.believes_all() {
            return 0.0;
        }
        let fastest = self.envelope.line().map(|line| line.at(self.now));
        let way = self
            .probed()
            .zip(fastest)
            .map_or(0, |(probed, fastest)| fastest.saturating_add(probed.at(self.now)));
        let spread = self.envelope.spread_nanos();
        PATH_NANOS.max(way as f64) + if spread.is_nan() { 0.0 } else { 2.0 * spread }
    }

    /// The offset of the clock [ns]: from probes if there are any, otherwise from timestamps.
    fn offset(&self) -> Option<LinearFit> {
        self.probed().or_else(|| self.envelope.line().map(LinearFit::reversed))
    }

    /// The offset from probes, unless the probes are answered by a different clock than the one that set the
    /// timestamps.
    fn probed(&self) -> Option<LinearFit> {
        let probed = self.bursts.line()?;
        let fastest = self.envelope.line().map(|line| line.at(self.now));
        let way = fastest.map(|delay| delay.saturating_add(probed.at(self.now)));
        way.is_none_or(|way| (-SOONER_NANOS..=LATER_NANOS).contains(&way)).then_some(probed)
    }

    fn report(&mut self, event: ClockEvent) {
        if self.events.len() == MOST_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

#[cfg(test)]
mod tests;
