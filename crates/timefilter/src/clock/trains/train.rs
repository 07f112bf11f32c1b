//! One stream of a device.

use super::IndexCheck;
use crate::clock::Stamps;

/// How far a batch's period may deviate from the declared one [fraction].
pub(super) const TOLERANCE: f64 = 0.1;
/// How close the periods of packets must be to contradict the declared one [fraction].
const AGREED: f64 = 0.02;
/// The number of packets over which a period is averaged.
const AVERAGED: f64 = 32.0;
/// The number of recent device times kept to detect repeated packets.
const RECENT: usize = 64;
/// The most packets in a row that may be repeats.
const REPEATS: u32 = 4;
/// The largest deviation that is never a clock step [s].
const STEP_SECS: f64 = 0.04;
/// The minimum clock step, as a multiple of the usual deviation.
const STEP_ROUGHS: f64 = 8.0;
/// The number of packets after which their regularity is known.
pub(super) const KNOWN: u32 = 16;
/// The largest roughness of device times at which indices vouch for the clock, as a multiple of the period, and its
/// upper limit [s].
const ROUGH: f64 = 2.0;
const MOST_ROUGH_SECS: f64 = 0.1;
/// The number of packets that confirm a clock step: of many samples each, and of one.
const AGREEING: (u32, u32) = (2, 3);
/// How long packets must be late to distinguish a clock set back by a whole number of packets from repeats
/// [ns], and the most packets that this takes.
const BACK_NANOS: f64 = 0.5e9;
const MOST_BACK: u32 = 50;
/// The number of packets within which early arrivals are looked for.
const EARLY: u32 = 8;
/// The shortest silence during which a device may have been switched off and on again [ns].
const SILENT_NANOS: i64 = 1_000_000_000;

/// The state of one stream: its period, its regularity and a possible clock step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Train {
    pub stream: u32,
    /// The device time and index of the newest packet's first sample.
    device: i64,
    index: u64,
    /// When it arrived [ns]; `i64::MAX` if that was in an earlier epoch.
    pub arrival: i64,
    pub period_nanos: f64,
    /// The declared period [ns]; 0 for single samples.
    declared_nanos: f64,
    observed: f64,
    /// The observed period that contradicts the declared one [ns], and the number of consecutive packets
    /// that agree on it.
    other_nanos: f64,
    agreeing: u32,
    pub wrong: Wrong,
    pub packets: u32,
    /// The usual deviation of device times from those predicted by the indices [ns].
    pub rough: f64,
    recent: [i64; RECENT],
    /// The number of consecutive repeated packets, and the number of samples by which they went back.
    repeats: u32,
    went_back: u32,
    step: Option<Step>,
    /// How late the newest packet without a step arrived relative to the envelope [ns].
    late_before: f64,
    pub unexplained: i64,
    /// The end of the last batch [ns of session time].
    pub end: i64,
}

/// Whether the declared period is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wrong {
    No,
    /// It was found to be wrong and is still to be reported; holds the declared value [ns].
    Found(f64),
    Reported,
}

/// A step of device time that the indices do not show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    nanos: f64,
    device: i64,
    index: u64,
    packets: u32,
    /// The number of packets required to confirm it.
    enough: u32,
    /// The least and the greatest lead of packets since then over the envelope [ns].
    least: f64,
    most: f64,
}

impl Train {
    pub fn new(stamps: &Stamps, device: i64) -> Train {
        Train {
            stream: stamps.stream,
            device,
            index: stamps.index,
            arrival: stamps.arrival,
            period_nanos: stamps.period_nanos.max(0.0),
            declared_nanos: stamps.period_nanos,
            observed: 0.0,
            other_nanos: 0.0,
            agreeing: 0,
            wrong: Wrong::No,
            packets: 0,
            rough: 0.0,
            recent: [device; RECENT],
            repeats: 0,
            went_back: 0,
            step: None,
            late_before: 0.0,
            unexplained: i64::MIN,
            end: i64::MIN,
        }
    }

    pub fn most_rough(&self) -> f64 {
        (ROUGH * self.period_nanos).min(MOST_ROUGH_SECS * 1e9)
    }

    /// The deviation of a device time from the one predicted by its index, relative to an earlier packet
    /// [ns].
    fn off(&self, stamps: &Stamps, device: i64, after: (i64, u64)) -> f64 {
        let numbers = stamps.index.wrapping_sub(after.1) as i64;
        (i128::from(device) - i128::from(after.0)) as f64 - numbers as f64 * self.period_nanos
    }

    pub fn hold(&mut self, stamps: &Stamps, device: i64, ahead: Option<(f64, f64)>) -> IndexCheck {
        let numbers = stamps.index.wrapping_sub(self.index) as i64;
        let is_known = self.packets > 0 && self.recent.contains(&device);
        let silence = stamps.arrival.saturating_sub(self.arrival);
        if device < self.device && !is_known && silence >= SILENT_NANOS {
            return IndexCheck::Behind;
        }
        self.arrival = stamps.arrival;
        if is_known && self.repeats < REPEATS {
            // A repeated packet, either with an index of its own or with its original one.
            if numbers > 0 {
                self.repeats += 1;
                self.went_back +=
                    if device < self.device || self.went_back > 0 { stamps.count } else { 0 };
                self.renumber(stamps, 1);
            }
            return IndexCheck::Consistent;
        }
        // More packets than can be repeats: the clock was set back by exactly that many periods.
        if is_known && self.repeats == REPEATS {
            self.repeats += 1;
            self.renumber(stamps, -i64::from(REPEATS));
        }
        let numbers = stamps.index.wrapping_sub(self.index) as i64;
        let back_nanos = f64::from(self.went_back) * self.period_nanos;
        if !is_known {
            (self.repeats, self.went_back) = (0, 0);
        }
        let off = self.off(stamps, device, (self.device, self.index));
        if numbers <= 0 && self.packets > 0 {
            return IndexCheck::Consistent;
        }
        let known = self.packets >= KNOWN && self.rough <= self.most_rough();
        let usual = (STEP_SECS * 1e9).max(STEP_ROUGHS * self.rough);
        let may_be_set = back_nanos >= usual && !is_known;
        if !known || self.step.is_none() && off.abs() < usual && !may_be_set {
            self.learn(stamps, device, numbers, off);
            self.late_before = ahead.map_or(0.0, |(ahead, _)| (-ahead * 1e9).max(0.0));
            return IndexCheck::Consistent;
        }
        let Some((ahead, unsure)) = ahead else {
            self.go_on(stamps, device);
            return IndexCheck::Consistent;
        };
        // Either these packets were repeated, or the clock was set back by exactly as many.
        if self.step.is_none() && may_be_set {
            let (least, most) = (f64::MAX, f64::MIN);
            let (device, index) = (self.device, self.index);
            let packet_nanos = self.period_nanos * f64::from(stamps.count);
            let lasting = (BACK_NANOS / packet_nanos.max(1.0)) as u32;
            let (nanos, packets, enough) = (-back_nanos, 0, lasting.clamp(EARLY, MOST_BACK));
            self.step = Some(Step { nanos, device, index, packets, enough, least, most });
        }
        self.stepped(stamps, device, off, (ahead * 1e9, unsure * 1e9))
    }

    /// Handles a device time that deviates from its index.
    fn stepped(
        &mut self,
        stamps: &Stamps,
        device: i64,
        off: f64,
        (ahead, unsure): (f64, f64),
    ) -> IndexCheck {
        let tolerance = (STEP_SECS * 0.5e9).max(4.0 * self.rough);
        let again = self.step.filter(|step| {
            self.off(stamps, device, (step.device, step.index)).abs() < tolerance
                && device > step.device
        });
        if again.is_none() && off.abs() < tolerance {
            // The packet was out of order.
            self.step = None;
            self.go_on(stamps, device);
            return IndexCheck::Consistent;
        }
        let (least, most) =
            again.map_or((ahead, ahead), |step| (step.least.min(ahead), step.most.max(ahead)));
        let packets = again.map_or(1, |step| step.packets.saturating_add(1));
        let nanos = again.map_or(off, |step| step.nanos);
        let of_kind = if stamps.count > 1 { AGREEING.0 } else { AGREEING.1 };
        let enough = again.map_or(of_kind, |step| step.enough);
        let index = stamps.index;
        self.step = Some(Step { nanos, device, index, packets, enough, least, most });
        self.keep(device);
        if nanos < 0.0 {
            // If the clock was set back, every packet is late by at least that much, and the fastest by no
            // more, unless they queued before.
            let late_enough = -most > (-0.8 * nanos - unsure).max(-0.6 * nanos);
            if !late_enough {
                return self.pass_over(stamps, device);
            }
            if packets < enough {
                return IndexCheck::Wait;
            }
            let by_as_much = -most < -nanos + STEP_SECS * 1e9 + unsure + self.late_before;
            if !by_as_much && packets < EARLY + enough {
                return IndexCheck::Wait;
            }
            return if by_as_much {
                self.confirm(stamps, device, nanos)
            } else {
                self.unexplained = stamps.arrival;
                self.pass_over(stamps, device)
            };
        }
        // Either samples are missing, or the clock was set forward: then packets arrive impossibly early.
        let early = most > 0.6 * nanos && most < nanos + STEP_SECS * 1e9 + unsure;
        if early && packets >= enough {
            return self.confirm(stamps, device, nanos);
        }
        if packets >= EARLY || most < 0.3 * nanos && packets >= enough {
            return self.pass_over(stamps, device);
        }
        if ahead > unsure.min(STEP_SECS * 0.5e9) {
            IndexCheck::Wait
        } else {
            IndexCheck::Consistent
        }
    }

    /// Shifts the expected indices by a number of packets.
    fn renumber(&mut self, stamps: &Stamps, packets: i64) {
        let more = (packets * i64::from(stamps.count)) as u64;
        self.index = self.index.wrapping_add(more);
        if let Some(step) = &mut self.step {
            step.index = step.index.wrapping_add(more);
        }
    }

    fn confirm(&mut self, stamps: &Stamps, device: i64, nanos: f64) -> IndexCheck {
        self.step = None;
        self.go_on(stamps, device);
        IndexCheck::Set(nanos as i64)
    }

    /// Discards a step that was not one of the clock.
    fn pass_over(&mut self, stamps: &Stamps, device: i64) -> IndexCheck {
        self.step = None;
        self.go_on(stamps, device);
        IndexCheck::Consistent
    }

    fn go_on(&mut self, stamps: &Stamps, device: i64) {
        (self.device, self.index) = (device, stamps.index);
        self.keep(device);
    }

    fn keep(&mut self, device: i64) {
        self.recent[self.packets as usize % RECENT] = device;
        self.packets = self.packets.wrapping_add(1).max(1);
        if self.packets == u32::MAX {
            self.packets = KNOWN;
        }
    }

    fn learn(&mut self, stamps: &Stamps, device: i64, numbers: i64, off: f64) {
        let passed = (i128::from(device) - i128::from(self.device)) as f64;
        let period = passed / numbers.max(1) as f64;
        let near = |period: f64| {
            self.declared_nanos <= 0.0 || (period / self.declared_nanos - 1.0).abs() <= TOLERANCE
        };
        if numbers > 0 && passed > 0.0 && near(period) {
            self.observed = (self.observed + 1.0).min(AVERAGED);
            self.period_nanos += (period - self.period_nanos) / self.observed;
        }
        if numbers > 0 && passed > 0.0 && self.declared_nanos > 0.0 {
            self.doubt(period, near(period));
        }
        if self.packets > 1 {
            let forgets = 1.0 / f64::from(self.packets.min(64));
            self.rough += (off.abs() - self.rough) * forgets;
        }
        self.go_on(stamps, device);
    }

    /// Takes an observed period [ns]: many packets in a row that agree on another period refute the
    /// declared one.
    fn doubt(&mut self, period: f64, is_near: bool) {
        let agrees = (period / self.other_nanos - 1.0).abs() < AGREED;
        self.agreeing = if is_near {
            0
        } else if agrees {
            self.agreeing + 1
        } else {
            1
        };
        if is_near || !agrees {
            self.other_nanos = period;
        }
        if self.agreeing >= KNOWN {
            self.wrong = Wrong::Found(self.declared_nanos);
            (self.period_nanos, self.declared_nanos) = (self.other_nanos, self.other_nanos);
            (self.observed, self.agreeing, self.rough) = (1.0, 0, 0.0);
        }
    }
}
