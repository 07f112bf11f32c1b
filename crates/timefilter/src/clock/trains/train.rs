//! One stream of a device.

use super::Word;
use crate::clock::Stamps;

/// How far a batch's period may be from what its driver says, as a fraction.
pub(super) const TOLERANCE: f64 = 0.1;
/// How near to each other the periods of packets are that contradict it, as a fraction.
const AGREED: f64 = 0.02;
/// Over how many packets a period is averaged.
const AVERAGED: f64 = 32.0;
/// How many device times are remembered, to know what is sent twice.
const RECENT: usize = 64;
/// How many packets in a row are sent twice at most.
const REPEATS: u32 = 4;
/// What is no step of a clock [s].
const STEP_SECS: f64 = 0.04;
/// How many times what is usual a step is.
const STEP_ROUGHS: f64 = 8.0;
/// From how many packets on it is known how regular they are.
pub(super) const KNOWN: u32 = 16;
/// How rough device times may be for numbers to vouch for them, as a part of the period [1], and
/// how much at most [s].
const ROUGH: f64 = 2.0;
const MOST_ROUGH_SECS: f64 = 0.1;
/// How many packets show that the clock has stepped: of many samples, and of one.
const AGREEING: (u32, u32) = (2, 3);
/// For how long packets must be late where the clock may have been set back by a whole number of them, or
/// these were sent twice [ns], and how many at most.
const BACK_NANOS: f64 = 0.5e9;
const MOST_BACK: u32 = 50;
/// For how many packets it is looked out for that they come too early.
const EARLY: u32 = 8;

/// One stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Train {
    pub stream: u32,
    /// The newest packet's first sample: its device time and its number.
    device: i64,
    index: u64,
    pub period_nanos: f64,
    /// By what its driver says the period is [ns]; 0 for single samples.
    said_nanos: f64,
    observed: f64,
    /// What the period seems to be instead [ns], and how many packets in a row agree on that.
    other_nanos: f64,
    agreeing: u32,
    pub wrong: Wrong,
    pub packets: u32,
    /// The usual distance of device times from where numbers have them [ns].
    pub rough: f64,
    recent: [i64; RECENT],
    /// How many packets in a row were sent twice, and from how many samples back they went on.
    repeats: u32,
    went_back: u32,
    step: Option<Step>,
    pub unexplained: i64,
    /// Where the last batch ended, in the session's time.
    pub end: i64,
}

/// Whether a period is not what its driver says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wrong {
    No,
    /// It was found, and is still to be reported: the reported value [ns].
    Found(f64),
    Reported,
}

/// A step of device time that numbers do not have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    nanos: f64,
    device: i64,
    index: u64,
    packets: u32,
    /// How many packets must show it.
    enough: u32,
    /// The least and the most that packets since then were ahead of their envelope [ns].
    least: f64,
    most: f64,
}

impl Train {
    pub fn new(stamps: &Stamps, device: i64) -> Train {
        Train {
            stream: stamps.stream,
            device,
            index: stamps.index,
            period_nanos: stamps.period_nanos.max(0.0),
            said_nanos: stamps.period_nanos,
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
            unexplained: i64::MIN,
            end: i64::MIN,
        }
    }

    pub fn most_rough(&self) -> f64 {
        (ROUGH * self.period_nanos).min(MOST_ROUGH_SECS * 1e9)
    }

    /// How far a device time is from where a number has it after another one [ns].
    fn off(&self, stamps: &Stamps, device: i64, after: (i64, u64)) -> f64 {
        let numbers = stamps.index.wrapping_sub(after.1) as i64;
        (i128::from(device) - i128::from(after.0)) as f64 - numbers as f64 * self.period_nanos
    }

    pub fn hold(&mut self, stamps: &Stamps, device: i64, ahead: Option<(f64, f64)>) -> Word {
        let numbers = stamps.index.wrapping_sub(self.index) as i64;
        let is_known = self.packets > 0 && self.recent.contains(&device);
        if is_known && self.repeats < REPEATS {
            // Sent twice: its number is another, or its own once more.
            if numbers > 0 {
                self.repeats += 1;
                self.went_back +=
                    if device < self.device || self.went_back > 0 { stamps.count } else { 0 };
                self.renumber(stamps, 1);
            }
            return Word::Goes;
        }
        // So many are not sent twice: the clock was set back by just so many periods.
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
            return Word::Goes;
        }
        let known = self.packets >= KNOWN && self.rough <= self.most_rough();
        let usual = (STEP_SECS * 1e9).max(STEP_ROUGHS * self.rough);
        let may_be_set = back_nanos >= usual && !is_known;
        if !known || self.step.is_none() && off.abs() < usual && !may_be_set {
            self.learn(stamps, device, numbers, off);
            return Word::Goes;
        }
        let Some((ahead, unsure)) = ahead else {
            self.go_on(stamps, device);
            return Word::Goes;
        };
        // So many packets in a row were sent twice, or the clock was set back by just as many.
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

    /// Device time is not where numbers have it.
    fn stepped(
        &mut self,
        stamps: &Stamps,
        device: i64,
        off: f64,
        (ahead, unsure): (f64, f64),
    ) -> Word {
        let tolerance = (STEP_SECS * 0.5e9).max(4.0 * self.rough);
        let again = self.step.filter(|step| {
            self.off(stamps, device, (step.device, step.index)).abs() < tolerance
                && device > step.device
        });
        if again.is_none() && off.abs() < tolerance {
            // It was a packet that came out of its turn.
            self.step = None;
            self.go_on(stamps, device);
            return Word::Goes;
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
            // Set back by so much, all is late by at least as much; and by no more, for the best.
            let late_enough = -most > (-0.8 * nanos - unsure).max(-0.6 * nanos);
            if !late_enough {
                return self.pass_over(stamps, device);
            }
            if packets < enough {
                return Word::Wait;
            }
            let by_as_much = -most < -nanos + STEP_SECS * 1e9 + unsure;
            if !by_as_much && packets < EARLY + enough {
                return Word::Wait;
            }
            return if by_as_much {
                self.confirm(stamps, device, nanos)
            } else {
                self.unexplained = stamps.arrival;
                self.pass_over(stamps, device)
            };
        }
        // Samples are missing, or it was set ahead: then packets come before they can.
        let early = most > 0.6 * nanos && most < nanos + STEP_SECS * 1e9 + unsure;
        if early && packets >= enough {
            return self.confirm(stamps, device, nanos);
        }
        if packets >= EARLY || most < 0.3 * nanos && packets >= enough {
            return self.pass_over(stamps, device);
        }
        if ahead > unsure.min(STEP_SECS * 0.5e9) { Word::Wait } else { Word::Goes }
    }

    /// So many packets more have numbers of their own.
    fn renumber(&mut self, stamps: &Stamps, packets: i64) {
        let more = (packets * i64::from(stamps.count)) as u64;
        self.index = self.index.wrapping_add(more);
        if let Some(step) = &mut self.step {
            step.index = step.index.wrapping_add(more);
        }
    }

    fn confirm(&mut self, stamps: &Stamps, device: i64, nanos: f64) -> Word {
        self.step = None;
        self.go_on(stamps, device);
        Word::Set(nanos as i64)
    }

    /// What happened is no step of the clock.
    fn pass_over(&mut self, stamps: &Stamps, device: i64) -> Word {
        self.step = None;
        self.go_on(stamps, device);
        Word::Goes
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
            self.said_nanos <= 0.0 || (period / self.said_nanos - 1.0).abs() <= TOLERANCE
        };
        if numbers > 0 && passed > 0.0 && near(period) {
            self.observed = (self.observed + 1.0).min(AVERAGED);
            self.period_nanos += (period - self.period_nanos) / self.observed;
        }
        if numbers > 0 && passed > 0.0 && self.said_nanos > 0.0 {
            self.doubt(period, near(period));
        }
        if self.packets > 1 {
            let forgets = 1.0 / f64::from(self.packets.min(64));
            self.rough += (off.abs() - self.rough) * forgets;
        }
        self.go_on(stamps, device);
    }

    /// A packet shows this period [ns]: many in a row that agree on another one than is said are right.
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
            self.wrong = Wrong::Found(self.said_nanos);
            (self.period_nanos, self.said_nanos) = (self.other_nanos, self.other_nanos);
            (self.observed, self.agreeing, self.rough) = (1.0, 0, 0.0);
        }
    }
}
