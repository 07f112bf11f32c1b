//! Random mixtures of all kinds of links.

use super::devices::Device;
use super::oscillator::Oscillator;
use super::packet_paths::{Bluetooth, Camera, Network, PacketPath, Polled, Saturated};
use super::random::Random;
use super::{Session, Stamped};

pub(super) fn mixture(random: &mut Random, secs: f64) -> Session {
    let mut clock = if random.chance(0.7) {
        Oscillator::wearable(random)
    } else {
        Oscillator::computer(random)
    };
    let packets_hz = random.ratio_between(1.0, 150.0);
    let batch = if random.chance(0.5) { 1 } else { random.ratio_between(1.0, 80.0) as u32 };
    let by_device = random.chance(0.7);
    if by_device && random.chance(0.3) && packets_hz > 5.0 {
        let by = random.ratio_between(0.1, 10.0) * if random.chance(0.5) { 1.0 } else { -1.0 };
        clock.sets.push((random.between(0.2, 0.8) * secs, by));
    }
    let mut device = Device::new(clock, packets_hz * f64::from(batch));
    device.batch = batch;
    device.lazy = random.ratio_between(0.0002, 0.01);
    if by_device {
        device.repeats = if random.chance(0.3) { 0.01 } else { 0.0 };
        device.numbers_losses = random.chance(0.5);
        if random.chance(0.3) {
            let from = random.between(0.1, 0.9) * secs;
            device.silences.push((from, from + random.ratio_between(2.0, 600.0)));
        }
    }
    let stamped = if by_device { Stamped::Device } else { Stamped::Number(device.rate_hz) };
    let mut way: Box<dyn PacketPath> = match random.below(5) {
        0 => Box::new(Camera::new()),
        1 => {
            let mut way = Network::wifi();
            if random.chance(0.5) {
                way = way.stalling(120.0, (0.1, 3.0), secs, random);
            }
            if random.chance(0.5) {
                let from = random.between(0.1, 0.9) * secs;
                let lasts = random.between(30.0, 400.0);
                way.routes.push((from, from + lasts, random.between(0.01, 0.2)));
            }
            Box::new(way)
        }
        2 if packets_hz < 120.0 => Box::new(Polled::new(0.008, random)),
        3 => {
            let mut way = Saturated::new(1.0 / packets_hz, secs, random);
            way.link.fit = 20;
            Box::new(way)
        }
        _ => {
            let fails = random.between(0.0, 0.3);
            let mut way = Bluetooth::new(random, fails);
            (way.latency, way.fit) = (random.below(4) as u32, 20);
            if random.chance(0.5) {
                way = way.dropping_out(200.0, secs, random);
                way.flushes = random.chance(0.7);
            }
            Box::new(way)
        }
    };
    device.run(way.as_mut(), secs, stamped, random)
}
