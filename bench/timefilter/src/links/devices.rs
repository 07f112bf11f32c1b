//! Sessions of devices that stamp or number what they send.

use super::oscillator::Oscillator;
use super::packet_paths::{
    Bluetooth, Camera, INTERVAL_STEP, Network, PacketPath, Polled, Saturated,
};
use super::random::Random;
use super::{Happened, Packet, Session, Stamped, Stamps, What, nanos};

/// How a device measures and sends.
#[derive(Clone, Debug)]
pub(super) struct Device {
    pub clock: Oscillator,
    /// The sampling rate by the device's clock [Hz].
    pub rate_hz: f64,
    /// The number of samples per packet.
    pub batch: u32,
    /// The largest additional delay of the firmware, besides the constant one [s].
    pub lazy: f64,
    /// The probability that a packet is sent twice.
    pub repeats: f64,
    /// The spans in which the device is silent: start and end [s].
    pub silences: Vec<(f64, f64)>,
    /// Whether the sample numbers include lost samples.
    pub numbers_losses: bool,
}

impl Device {
    pub(super) fn new(clock: Oscillator, rate_hz: f64) -> Device {
        let silences = Vec::new();
        let (batch, lazy, repeats, numbers_losses) = (1, 0.002, 0.0, true);
        Device { clock, rate_hz, batch, lazy, repeats, silences, numbers_losses }
    }

    /// Returns what arrives within this many seconds.
    pub(super) fn run(
        &self,
        way: &mut dyn PacketPath,
        secs: f64,
        stamped: Stamped,
        random: &mut Random,
    ) -> Session {
        let mut packets: Vec<Packet> = Vec::new();
        let period = 1.0 / self.rate_hz;
        let batch = f64::from(self.batch);
        // Samples are a period of the device's clock apart, even when that clock is set.
        let free = Oscillator { sets: Vec::new(), ..self.clock.clone() };
        let (mut index, mut uncounted, mut now) = (0_u64, 0_u64, 0.0);
        let mut newest = f64::NEG_INFINITY;
        for number in 0.. {
            let shown = free.start_secs + f64::from(number) * batch * period;
            now = moment(&free, shown, now);
            if now > secs {
                break;
            }
            index += u64::from(self.batch);
            let last = moment(&free, shown + (batch - 1.0) * period, now);
            let first = index - u64::from(self.batch);
            if self.silences.iter().any(|(from, until)| (*from..*until).contains(&last)) {
                uncounted += u64::from(self.batch);
                continue;
            }
            // The firmware sends in order.
            newest = (newest + 1e-6).max(last + self.lazy * random.unit());
            let Some(arrival) = way.arrival(newest, random) else {
                uncounted += u64::from(self.batch) * u64::from(!self.numbers_losses);
                continue;
            };
            let set: f64 = self.clock.at(now) - free.at(now);
            let stamps = Stamps {
                device: (stamped == Stamped::Device).then(|| ((shown + set) * 1e9).round() as i64),
                index: first - uncounted,
                count: self.batch,
                period_nanos: if self.batch > 1 { period * 1e9 } else { 0.0 },
                ..Stamps::arrived(nanos(arrival))
            };
            let packet = Packet { stamps, first: nanos(now), last: nanos(last) };
            packets.push(packet);
            if random.chance(self.repeats) {
                uncounted = uncounted.wrapping_sub(u64::from(self.batch));
                let index = first.wrapping_sub(uncounted);
                let stamps = Stamps { index, arrival: stamps.arrival + 100_000, ..stamps };
                packets.push(Packet { stamps, ..packet });
            }
        }
        let happened = self.clock.sets.iter().map(|(at, by)| {
            let what = if by.abs() >= 0.05 { What::Set } else { What::MayBeTold };
            Happened { at: nanos(*at), what, settles_secs: 2.0 }
        });
        Session {
            stamped,
            packets,
            probes: Vec::new(),
            happened: happened.collect(),
            packet_hz: self.rate_hz / batch,
            errors_to: None,
        }
    }
}

/// Returns when a clock shows a time, at `near` or soon after it [s].
fn moment(clock: &Oscillator, shown: f64, near: f64) -> f64 {
    let mut at = near;
    for _ in 0..4 {
        at += shown - clock.at(at);
    }
    at
}

pub(super) fn strap(random: &mut Random, secs: f64) -> Session {
    let mut device = Device::new(Oscillator::wearable(random), 130.0);
    device.batch = 73;
    let mut way = Bluetooth::new(random, 0.1).dropping_out(120.0, secs, random);
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn motion(random: &mut Random, secs: f64) -> Session {
    let device = Device::new(Oscillator::wearable(random), 52.0);
    let mut way = Bluetooth::new(random, 0.1);
    way.latency = random.below(4) as u32;
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn wifi(random: &mut Random, secs: f64) -> Session {
    let device = Device { lazy: 0.0005, ..Device::new(Oscillator::wearable(random), 50.0) };
    let mut way = Network::wifi().stalling(120.0, (1.9, 2.1), secs, random);
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn camera(random: &mut Random, secs: f64) -> Session {
    let device = Device { lazy: 0.0, ..Device::new(Oscillator::computer(random), 30.0) };
    device.run(&mut Camera::new(), secs, Stamped::Device, random)
}

pub(super) fn route(random: &mut Random, secs: f64) -> Session {
    let device = Device { lazy: 0.0005, ..Device::new(Oscillator::wearable(random), 100.0) };
    let mut way = Network::wifi();
    let from = random.between(0.2, 0.7) * secs;
    way.routes = vec![(from, from + 300.0, 0.080)];
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn one_hz(random: &mut Random, secs: f64) -> Session {
    let device = Device { lazy: 0.005, ..Device::new(Oscillator::wearable(random), 1.0) };
    let steps = loop {
        let steps = 6 + random.below(35);
        if 800 % steps != 0 {
            break steps;
        }
    };
    let mut way = Bluetooth::of_interval(steps as f64 * INTERVAL_STEP, random, 0.1);
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn beating(random: &mut Random, secs: f64) -> Session {
    let rate_hz = if random.chance(0.5) { 10.0 } else { 20.0 };
    let mut clock = Oscillator::wearable(random);
    clock.skew = random.between(40e-6, 150e-6) * if random.chance(0.5) { 1.0 } else { -1.0 };
    let device = Device { lazy: 0.001, ..Device::new(clock, rate_hz) };
    let mut way = Bluetooth::of_interval(0.050, random, 0.02);
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn saturated(random: &mut Random, secs: f64) -> Session {
    let device = Device::new(Oscillator::wearable(random), 52.0);
    let mut way = Saturated::new(1.0 / 52.0, secs, random);
    device.run(&mut way, secs, Stamped::Device, random)
}

pub(super) fn usb_poll(random: &mut Random, secs: f64) -> Session {
    let device = Device { lazy: 0.0002, ..Device::new(Oscillator::computer(random), 125.0) };
    device.run(&mut Polled::new(0.008, random), secs, Stamped::Device, random)
}

pub(super) fn wrong_rate(random: &mut Random, secs: f64) -> Session {
    let rate_hz = random.ratio_between(25.0, 250.0);
    let mut wrong = random.ratio_between(0.25, 4.0);
    while (0.85..1.18).contains(&wrong) {
        wrong = random.ratio_between(0.25, 4.0);
    }
    let mut device = Device::new(Oscillator::wearable(random), rate_hz);
    device.batch = 1 + random.below(20) as u32;
    let stamped = Stamped::Number(rate_hz * wrong);
    let mut way = Bluetooth::new(random, 0.1);
    let packets_hz = rate_hz / f64::from(device.batch);
    (way.fit, way.fails) = (20, 0.1_f64.min(0.2 / (packets_hz * way.interval)));
    let mut session = device.run(&mut way, secs, stamped, random);
    for packet in &mut session.packets {
        packet.stamps.period_nanos /= wrong;
    }
    session.happened.push(Happened { at: nanos(0.0), what: What::WrongRate, settles_secs: 10.0 });
    session
}

pub(super) fn set(random: &mut Random, secs: f64) -> Session {
    let mut clock = Oscillator::wearable(random);
    let back = -random.between(0.26, 0.6);
    let ahead = random.between(0.05, 0.6);
    let less = -random.between(0.05, 0.26);
    let at = |part: f64| part * secs;
    clock.sets = vec![
        (at(random.between(0.1, 0.3)), back),
        (at(random.between(0.4, 0.6)), ahead),
        (at(random.between(0.7, 0.9)), less),
    ];
    let device = Device::new(clock, 52.0);
    device.run(&mut Bluetooth::new(random, 0.1), secs, Stamped::Device, random)
}

pub(super) fn fast(random: &mut Random, secs: f64) -> Session {
    let mut clock = Oscillator::wearable(random);
    clock.skew = random.between(0.9e-3, 2e-3) * if random.chance(0.5) { 1.0 } else { -1.0 };
    let device = Device::new(clock, 10.0);
    let mut session = device.run(&mut Network::wifi(), secs, Stamped::Device, random);
    session.happened.push(Happened { at: nanos(0.0), what: What::Fast, settles_secs: 15.0 });
    session
}

pub(super) fn perfect(random: &mut Random, _: f64) -> Session {
    let packets_hz = random.ratio_between(1.0, 200.0);
    let batch = random.ratio_between(1.0, 100.0) as u32;
    let mut device = Device::new(Oscillator::perfect(), packets_hz * f64::from(batch));
    device.batch = batch;
    let stamped =
        if random.chance(0.5) { Stamped::Device } else { Stamped::Number(device.rate_hz) };
    let (fails, lazy) = (random.between(0.0, 0.3), random.unit() * 0.005);
    device.lazy = lazy;
    let mut way = Bluetooth::new(random, fails);
    // Links that can't carry all packets are another kind.
    (way.fit, way.fails) = (20, fails.min(0.2 / (packets_hz * way.interval)));
    device.run(&mut way, 300.0, stamped, random)
}

pub(super) fn silence(random: &mut Random, secs: f64) -> Session {
    let mut clock = Oscillator::wearable(random);
    let mut silences = Vec::new();
    let mut at = random.between(0.1, 0.3) * secs;
    while at < secs {
        let lasts = random.ratio_between(2.0, 1200.0).min(secs / 3.0);
        silences.push((at, at + lasts));
        at += lasts + random.between(60.0, 600.0);
    }
    // The battery was changed during one silence: the clock restarts near zero.
    let reset = silences[random.below(silences.len())];
    let mut happened = Vec::new();
    if random.chance(0.5) && reset.1 < secs {
        let shown = clock.at(reset.1 - 1.0);
        clock.sets = vec![(reset.1 - 1.0, 1.0 - shown)];
        happened.push(Happened { at: nanos(reset.1), what: What::Set, settles_secs: 60.0 });
    }
    let mut device = Device::new(clock, 52.0);
    (device.silences, device.repeats) = (silences, 0.01);
    let mut way = Bluetooth::new(random, 0.1);
    let mut session = device.run(&mut way, secs, Stamped::Device, random);
    session.happened = happened;
    session
}
