//! Sessions of computers that stamp what they send.

use super::oscillator::Oscillator;
use super::packet_paths::{Network, PacketPath};
use super::random::Random;
use super::{Happened, Packet, Probe, Session, Stamped, Stamps, What, nanos};

/// A computer that sends messages with the same number of samples each.
struct Computer {
    clock: Oscillator,
    messages_hz: f64,
    /// The time from a message's first to its last sample [s].
    span: f64,
    /// How long after its last sample a message is sent [s].
    held: f64,
    /// Whether the clock is probed, every four seconds.
    is_probed: bool,
}

impl Computer {
    fn new(clock: Oscillator, messages_hz: f64) -> Computer {
        Computer { clock, messages_hz, span: 0.0, held: 0.001, is_probed: false }
    }

    fn run(&self, way: &mut Network, secs: f64, random: &mut Random) -> Session {
        let mut packets = Vec::new();
        let period = 1.0 / self.messages_hz;
        let count = if self.span > 0.0 { 65 } else { 1 };
        let mut number = 0_u64;
        let mut at = random.unit() * period;
        while at < secs {
            let (first, last) = (at, at + self.span);
            if let Some(arrival) = way.arrival(last + self.held, random) {
                let stamps = Stamps {
                    source: Some(self.stamp(first)),
                    index: number * count,
                    count: count as u32,
                    period_nanos: self.span * 1e9 / (count.max(2) - 1) as f64,
                    ..Stamps::arrived(nanos(arrival))
                };
                packets.push(Packet { stamps, first: nanos(first), last: nanos(last) });
            }
            number += 1;
            at += period;
        }
        let probes = if self.is_probed { self.probes(way, secs, random) } else { Vec::new() };
        let (stamped, happened) = (Stamped::Computer, Vec::new());
        let (packet_hz, errors_to) = (self.messages_hz, None);
        Session { stamped, packets, probes, happened, packet_hz, errors_to }
    }

    /// Returns the reading of the computer's clock [ns].
    fn stamp(&self, secs: f64) -> i64 {
        nanos(0.0) + (self.clock.at(secs) * 1e9).round() as i64
    }

    /// Makes bursts of eight exchanges.
    fn probes(&self, way: &Network, secs: f64, random: &mut Random) -> Vec<Probe> {
        let mut probes = Vec::new();
        let stalled =
            |at: f64| way.stalls.iter().any(|(from, until)| (*from..*until).contains(&at));
        let mut at = 1.0;
        while at < secs {
            for k in 0..8 {
                let sent = at + f64::from(k) * 0.064;
                let one = |random: &mut Random| random.pareto(0.0008, 1.5).min(0.5);
                let (there, back) = (one(random), one(random));
                if stalled(sent) || stalled(sent + there + back) {
                    continue;
                }
                let shown = self.clock.at(sent + there);
                probes.push(Probe {
                    arrival: nanos(sent + there + back),
                    offset_secs: shown - (sent + f64::midpoint(there, back)),
                    round_trip_secs: there + back,
                });
            }
            at += 4.0;
        }
        probes
    }
}

fn clock(random: &mut Random, ahead: f64) -> Oscillator {
    Oscillator { start_secs: ahead, ..Oscillator::computer(random) }
}

pub(super) fn robot_stall(random: &mut Random, secs: f64) -> Session {
    let ahead = random.between(-0.01, 0.0015);
    let mut computer = Computer::new(clock(random, ahead), 20.0);
    computer.clock.skew = 0.0;
    let mut way = Network::wifi().stalling(90.0, (0.2, 4.0), secs, random);
    computer.run(&mut way, secs, random)
}

pub(super) fn robot_step(random: &mut Random, secs: f64) -> Session {
    let ahead = random.between(-0.5, 0.5);
    let mut computer = Computer::new(clock(random, ahead), 20.0);
    computer.is_probed = true;
    let mut sets = Vec::new();
    for part in [0.2, 0.4, 0.6, 0.8] {
        let by = random.ratio_between(0.02, 0.5) * if random.chance(0.5) { 1.0 } else { -1.0 };
        sets.push((part * secs + random.unit() * 100.0, by));
    }
    // NTP slews for some minutes, as fast as it may.
    computer.clock.swing = random.between(0.0, 100e-6);
    computer.clock.sets.clone_from(&sets);
    let mut way = Network::wifi().stalling(180.0, (0.2, 2.0), secs, random);
    let mut session = computer.run(&mut way, secs, random);
    for (at, _) in sets {
        let what = What::MayBeTold;
        session.happened.push(Happened { at: nanos(at), what, settles_secs: 15.0 });
    }
    session
}

pub(super) fn two_laptops(random: &mut Random, secs: f64) -> Session {
    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
    let mut computer = Computer::new(clock(random, 0.6 * sign), 20.0);
    computer.clock.skew = 40e-6 * if random.chance(0.5) { 1.0 } else { -1.0 };
    computer.is_probed = true;
    computer.run(&mut Network::wifi(), secs, random)
}

pub(super) fn backlog(random: &mut Random, secs: f64) -> Session {
    let ahead = random.between(-0.01, 0.0015);
    let mut computer = Computer::new(clock(random, ahead), 2.0);
    (computer.clock.skew, computer.span, computer.held) = (0.0, 64.0 / 130.0, 0.005);
    computer.is_probed = random.chance(0.5);
    let mut way = Network::wifi().stalling(300.0, (8.0, 12.0), secs, random);
    computer.run(&mut way, secs, random)
}
