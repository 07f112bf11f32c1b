//! One epoch of a device's clock: the time between two resets, over which its readings are continuous.

mod raised;

use self::raised::{RAISED_BINS, Raised};
use super::beat::{Beat, Teeth};
use super::comb::Comb;
use super::envelope::{BIN_NANOS, Envelope};
use super::fit::{Fit, Point};
use super::line::OffsetMap;

pub(super) use self::raised::RAISED_LONG;

/// How long an epoch counts as young [s]: its first packets may all have been delayed, so that a clock seems to run
/// ahead while the envelope only converges.
const YOUNG_SECS: f64 = 30.0;
/// The age of an epoch from which it is known how early a packet is [s].
const SURE_SECS: f64 = 10.0;
/// The largest deviation that is never a jump [s].
const STEADY_SECS: f64 = 0.25;
/// The largest deviation that is never a jump in a young epoch, and the age beyond which a packet is not
/// from this epoch [s].
const LOOSE_SECS: f64 = 10.0;
/// A bin whose lowest delay exceeds the line by more than this multiple of the spread, and by more than the
/// constant below [s], is raised: it is excluded until the reason is clear.
const GATE_SPREADS: f64 = 6.0;
const GATE_SECS: f64 = 0.004;
/// A bin within this multiple of the line's stated uncertainty, which grows during silences, is not raised
/// either.
const GATE_ERRORS: f64 = 1.5;
const GATE_MOST_SECS: f64 = 0.02;
/// The number of bins after which the rate of a clock that is not a quartz is known well enough for a lower gate.
const GATE_BINS: usize = 60;
/// The error of the skew with which a line is extrapolated over a silence, and the shortest pause that
/// counts as one [s].
const SILENT_SKEW: f64 = 20e-6;
const SILENT_SECS: f64 = 30.0;
/// The number of consecutive bins below the line, by more than the gate, that show that all earlier ones were
/// delayed.
const FALLEN_BINS: usize = 3;

/// The interval between fits once an epoch is no longer young [bins].
const FIT_EVERY: i64 = 2;
/// The additional uncertainty of a young epoch's line [s²], divided by the epoch's age: at most `YOUNG_ERROR`, and less
/// if delays scatter little (`YOUNG_SPREADS` [s per s of the line's spread]) and packets are many (`YOUNG_DELAYS` [per
/// s of the spread of delays]): the smallest of `n` delays exceeds the shortest possible one by an `n`-th of their
/// range.
const YOUNG_ERROR: f64 = 0.15;
const YOUNG_SPREADS: f64 = 55.0;
const YOUNG_DELAYS: f64 = 15.0;
/// The number of bins from which the scatter of delays is known.
const YOUNG_BINS: usize = 8;
/// The share of the scatter's contribution that applies again after a silence.
const YOUNG_AGAIN: f64 = 0.55;
/// The slowest slew rate of the output, reached once the fit has settled: 0.5 ms per second.
const SLOWEST_SLEW: f64 = 0.5e-3;
/// The fastest slew rate of the output, while the fit is new [s/s].
const FASTEST_SLEW: f64 = 0.4;

/// A packet: the unwrapped device time of its last sample, and its arrival [ns].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packet {
    pub device: i64,
    pub arrival: i64,
}

impl Packet {
    /// The session time `since` after this packet by the device's clock; `offset` is session time minus device time,
    /// both since this packet [ns].
    pub fn session(self, since: i64, offset: f64) -> i64 {
        self.arrival.saturating_add(since).saturating_add(offset.round() as i64)
    }
}

/// What a packet implies about the clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// The clock runs on unchanged.
    Runs,
    /// The packet does not fit the clock: it is early by this much [s].
    Astray(f64),
    /// The clock was set forward by this much [s], as the packets of [`Epoch::raised`] show.
    Set(f64),
}

/// The state of an epoch.
#[derive(Clone, Debug)]
pub(super) struct Epoch {
    origin: Packet,
    envelope: Envelope,
    fit: Fit,
    line: OffsetMap,
    /// The number of the open bin, and its lowest point.
    bin: i64,
    lowest: Option<(Point, Packet)>,
    delays: Delays,
    raised: Raised,
    fallen: usize,
    /// The device time of the last bin, and the length of the silence before the bins that are not fitted
    /// yet [s].
    last: f64,
    silent: f64,
    /// The device time of the first bin after the last silence [s].
    resumed: f64,
    beat: Beat,
    teeth: Teeth,
    /// Whether the line follows the teeth.
    on_teeth: bool,
    /// The number of packets taken.
    taken: u64,
}

impl Epoch {
    /// The memory that an epoch allocates [B].
    pub const BYTES: usize = Envelope::BYTES + OffsetMap::BYTES + Teeth::LIVE_BYTES;

    /// Starts an epoch with its first packet; the skews of clocks of this kind have the standard deviation
    /// `usual_skew`.
    pub fn begin(first: Packet, usual_skew: f64) -> Epoch {
        let point = Point { device: 0.0, delay: 0.0 };
        Epoch {
            origin: first,
            envelope: Envelope::new(usual_skew),
            fit: Fit::level(point),
            line: OffsetMap::level(0.0),
            bin: 0,
            lowest: Some((point, first)),
            delays: Delays::default(),
            raised: Raised::default(),
            fallen: 0,
            last: 0.0,
            silent: 0.0,
            resumed: 0.0,
            beat: Beat::default(),
            teeth: Teeth::live(),
            on_teeth: false,
            taken: 1,
        }
    }

    /// Takes a packet, unless it is astray. If `vouched`, sample indices show that the clock runs on, so
    /// delays are not taken for a clock reset. Packets come every `period` [s] of device time, or
    /// irregularly (0).
    pub fn take(&mut self, packet: Packet, vouched: bool, period: f64) -> Verdict {
        let point = self.point(packet);
        let ahead = self.ahead(packet);
        let before = seconds(self.line.frontier()) - point.device;
        let limit = self.limit(point.device);
        if ahead > limit || before > LOOSE_SECS || ahead.abs() > 1e9 {
            return Verdict::Astray(ahead);
        }
        let bin = packet.arrival.saturating_sub(self.origin.arrival) / BIN_NANOS;
        self.beat.push(packet, period);
        let verdict = if bin > self.bin { self.close(vouched) } else { Verdict::Runs };
        self.bin = self.bin.max(bin);
        self.delays.push(-ahead);
        self.taken += 1;
        if self.lowest.is_none_or(|(lowest, _)| point.delay < lowest.delay) {
            self.lowest = Some((point, packet));
            if point.device < LOOSE_SECS && point.delay < self.fit.at(point.device) {
                self.refit(Some(point));
            }
        }
        verdict
    }

    /// The packets that show the new time after a clock reset.
    pub fn raised(&self) -> &[Packet] {
        &self.raised.packets[RAISED_BINS - self.raised.bins.min(RAISED_BINS)..]
    }

    /// The number of consecutive raised bins, and the additional uncertainty of the line due to them [s].
    pub fn raised_secs(&self) -> (usize, f64) {
        (self.raised.bins, self.raised.unclear())
    }

    /// The interval between the link events that packets beat with [s]; 0 if there are none.
    pub fn beat_interval(&self) -> f64 {
        self.beat.interval()
    }

    /// The comb on which the waits of packets lie. There is none for numbered samples, whose period is not known well
    /// enough.
    pub fn comb(&self) -> Comb {
        if self.envelope.is_of_quartz() { self.beat.comb() } else { Comb::NONE }
    }

    /// The packet with which the epoch began.
    pub fn origin(&self) -> Packet {
        self.origin
    }

    /// Device time since the epoch began [ns].
    fn since(&self, device: i64) -> i64 {
        device.saturating_sub(self.origin.device)
    }

    /// Fixes the map up to a device time since the epoch began [ns].
    pub fn settle(&mut self, since: i64) {
        self.line.settle(since);
    }

    /// The session time of a device time since the epoch began, before the fixed latency is subtracted
    /// [ns].
    pub fn at(&self, since: i64) -> i64 {
        self.origin.session(since, self.line.at(since))
    }

    /// The offset of device time from arrivals, positive when ahead, as far as delays show it [s].
    pub fn offset_secs(&self) -> f64 {
        let origin = i128::from(self.origin.device) - i128::from(self.origin.arrival);
        origin as f64 / 1e9 - self.line.at(self.line.frontier()) / 1e9
    }

    /// The clock's rate error relative to the session's clock [ppm]; NaN until it can be estimated.
    pub fn skew_ppm(&self) -> f64 {
        if self.envelope.len() < 2 { f64::NAN } else { self.fit.ppm() }
    }

    /// Whether the skew is outside the usual range.
    pub fn is_poor(&self) -> bool {
        self.envelope.is_poor()
    }

    /// The spread of delays [s].
    pub fn jitter_secs(&self) -> f64 {
        self.delays.rms()
    }

    /// Half the width of the 95 % interval of the map over a batch of duration `span` [s], excluding the
    /// fixed latency [s].
    pub fn uncertainty_secs(&self, span: f64) -> f64 {
        let now = self.line.frontier();
        let age = seconds(now);
        let behind = (self.line.at(now) / 1e9 - self.fit.at(age)).abs();
        let of_first = self.fit.uncertainty_at(age - span, age);
        let stated = self.fit.uncertainty_at(age, age).max(of_first);
        let unseen = if self.on_teeth { 0.0 } else { self.beat.unseen_secs() };
        stated + behind + self.young_secs(age) + self.raised.unclear() + unseen
    }

    /// The additional uncertainty at an age [s]: at first, and after a silence, all packets may have been delayed.
    fn young_secs(&self, age: f64) -> f64 {
        let resumed = 1.0 + (age - self.resumed).max(0.0);
        let age = 1.0 + age.max(0.0);
        if self.envelope.len() < YOUNG_BINS {
            return YOUNG_ERROR / age;
        }
        if self.teeth.are_followed() {
            return YOUNG_ERROR * self.teeth.roughness() / age;
        }
        let packets_hz = self.taken as f64 / age;
        let slowest = YOUNG_DELAYS * self.delays.rms() / packets_hz;
        let scattered = YOUNG_SPREADS * self.fit.spread;
        let young = YOUNG_ERROR.min(slowest + scattered) / age;
        young.max(YOUNG_ERROR.min(YOUNG_AGAIN * scattered) / resumed)
    }

    /// A packet's device time and delay in the epoch.
    pub fn point(&self, packet: Packet) -> Point {
        let device = self.since(packet.device);
        let arrival = packet.arrival.saturating_sub(self.origin.arrival);
        Point { device: seconds(device), delay: seconds(arrival.saturating_sub(device)) }
    }

    /// How early a packet arrived relative to the envelope [s]; negative for a delayed packet.
    pub fn ahead(&self, packet: Packet) -> f64 {
        let point = self.point(packet);
        let arrival = seconds(packet.arrival.saturating_sub(self.origin.arrival));
        point.device - self.fit.device_at(arrival)
    }

    /// How early a packet arrived, and the uncertainty of that [s]; `None` in a young epoch.
    pub fn seems_ahead(&self, packet: Packet) -> Option<(f64, f64)> {
        let is_young = seconds(self.line.frontier()) < SURE_SECS;
        (!is_young).then(|| (self.ahead(packet), self.uncertainty_secs(0.0)))
    }

    /// How early a packet, or how late a bin, may be without indicating a jump [s].
    fn limit(&self, age: f64) -> f64 {
        if age < YOUNG_SECS { LOOSE_SECS } else { STEADY_SECS.max(5.0 * self.delays.rms()) }
    }

    /// Closes a bin and adds it to the envelope, unless all of its packets were delayed.
    fn close(&mut self, vouched: bool) -> Verdict {
        let Some((point, packet)) = self.lowest.take() else { return Verdict::Runs };
        self.beat.bin(point);
        let since = point.device - self.last;
        self.last = point.device;
        if since > SILENT_SECS {
            self.silent = since;
            self.resumed = point.device;
        }
        let above = point.delay - self.fit.at(point.device);
        let gate = self.gate(point.device);
        if above > gate {
            let agreed = self.raised.push(point.delay, above, packet);
            self.raised.vouched = vouched;
            let set = agreed && !vouched && above > self.limit(point.device);
            if !self.raised.lasts() {
                return if set { Verdict::Set(-above) } else { Verdict::Runs };
            }
            self.envelope.keep(0);
        }
        self.raised = Raised::default();
        self.fallen = if above < -gate { self.fallen + 1 } else { 0 };
        self.envelope.push(point);
        self.follow(point);
        let was_silent = std::mem::take(&mut self.silent) > 0.0;
        if self.fallen >= FALLEN_BINS {
            self.envelope.keep(self.fallen);
        }
        if self.bin % FIT_EVERY == 0 || was_silent || point.device < YOUNG_SECS || self.fallen > 0 {
            self.refit(None);
        }
        let apart =
            self.line.at(self.line.frontier()) / 1e9 - self.fit.at(seconds(self.line.frontier()));
        if point.device > YOUNG_SECS && apart.abs() > STEADY_SECS {
            self.raised.push(point.delay, above, packet);
            return Verdict::Set(apart);
        }
        Verdict::Runs
    }

    /// Follows the sawtooth of delays that beat with link events.
    fn follow(&mut self, bin: Point) {
        let interval = self.beat.interval();
        if self.teeth.have_height(interval) {
            self.teeth.push(bin);
            return;
        }
        self.teeth.begin(interval);
        for bin in self.envelope.bins() {
            self.teeth.push(bin);
        }
    }

    /// How far above the line a bin must be to count as raised [s].
    fn gate(&self, age: f64) -> f64 {
        if age < YOUNG_SECS {
            return LOOSE_SECS;
        }
        // With beating packets, delays cover the whole sawtooth.
        let stated = GATE_ERRORS * self.fit.uncertainty_at(age, age);
        let is_rate_known = self.envelope.is_of_quartz() || self.envelope.len() >= GATE_BINS;
        let unsure = if is_rate_known { stated.max(SILENT_SKEW * self.silent) } else { f64::MAX };
        let unsure = unsure.min(GATE_MOST_SECS);
        GATE_SECS.max(GATE_SPREADS * self.fit.spread).max(unsure).max(self.beat.height_secs())
    }

    /// Continues the map after the clock was set forward by `nanos` [ns].
    pub fn shift(&mut self, nanos: i64) {
        self.origin.device = self.origin.device.saturating_add(nanos);
        self.lowest = None;
        self.raised = Raised::default();
    }

    fn refit(&mut self, open: Option<Point>) {
        self.lay(open);
        let now = self.line.frontier();
        let age = seconds(now).max(0.0);
        let slew = if age < YOUNG_SECS && self.line.at(now) / 1e9 - self.fit.at(age) > STEADY_SECS {
            FASTEST_SLEW // the first packets were late
        } else {
            (0.5 / age.max(1.0)).clamp(SLOWEST_SLEW, FASTEST_SLEW)
        };
        let within = (age / 4.0).clamp(0.5, 4.0) * 1e9;
        self.line.lead_to(self.fit.at(age) * 1e9, self.fit.slope, within, slew);
    }

    /// Fits a line to the steps of a sawtooth if there is one, otherwise under all bins.
    fn lay(&mut self, open: Option<Point>) {
        self.on_teeth =
            self.teeth.are_followed() && !self.teeth.pass_too_fast(self.envelope.bins());
        if self.on_teeth {
            if let Some(level) = self.teeth.level() {
                self.fit = self.teeth.line(level);
            }
            return;
        }
        // The more packets in a bin, the closer its minimum is to the shortest possible delay.
        let in_bin = self.taken as f64 / (self.envelope.len() + 1) as f64;
        let scatter = self.delays.rms() / in_bin.max(1.0);
        let fit = self.envelope.fit(open, self.fit, scatter, in_bin);
        self.fit = fit.off_by(self.comb().off_level(self.envelope.remembered(&fit), &fit));
    }
}

fn seconds(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}

/// The spread of delays above the envelope.
#[derive(Clone, Copy, Debug, Default)]
struct Delays {
    count: f64,
    square: f64,
}

impl Delays {
    /// Takes one delay [s]. A stall has no more weight than any long delay.
    fn push(&mut self, delay: f64) {
        self.count = (self.count + 1.0).min(1000.0);
        let most = if self.count < 10.0 { 0.1 } else { 4.0 * self.rms() + 0.005 };
        let delay = delay.clamp(-most, most);
        self.square += (delay * delay - self.square) / self.count;
    }

    fn rms(&self) -> f64 {
        self.square.sqrt()
    }
}
