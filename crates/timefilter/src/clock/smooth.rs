//! Better times afterwards: the same clock models, with what came later known too.

use super::envelope::{BIN_NANOS, Envelope, Fit, Point, WINDOW_SECS};
use super::one_way::{OneWay, OneWaySettings};
use super::sample_index::{self, SampleIndex};
use super::{ClockKind, ClockModel, ClockState, Corrected, Latency, News, Stamps};

/// How far apart the map's nodes are [s].
const NODE_SECS: f64 = 20.0;
/// The steepest that the map may be between nodes; it keeps it strictly increasing.
const STEEPEST: f64 = 0.5;

/// Collects all stamps of a device, in the order in which they arrived.
#[derive(Clone, Debug)]
pub struct Smoother {
    source: Source,
    clock: OneWay,
    /// For each epoch, the lowest point of each bin.
    epochs: Vec<Vec<Point>>,
}

impl Smoother {
    /// A device that stamps what it sends.
    pub fn new(settings: OneWaySettings) -> Smoother {
        let settings = settings.sound();
        Smoother {
            source: Source::Stamped(settings),
            clock: OneWay::new(settings),
            epochs: Vec::new(),
        }
    }

    /// A device without a clock, of nominally `rate_hz` samples a second.
    pub fn of_samples(rate_hz: f64, latency: Latency) -> Smoother {
        let source = Source::Numbered(Box::new(SampleIndex::new(rate_hz, latency)));
        Smoother { source, ..Smoother::new(sample_index::settings(latency)) }
    }

    /// Takes the stamps of the next reading. Keeps 16 bytes for each two seconds.
    pub fn push(&mut self, stamps: &Stamps) {
        let stamps = self.source.stamps(stamps);
        let Some(placed) = self.clock.place(&stamps) else { return };
        let Some(epoch) = self.clock.epoch() else { return };
        let point = epoch.point(placed.packet);
        self.epochs.resize_with(placed.epoch as usize + 1, Vec::new);
        let Some(bins) = self.epochs.last_mut() else { return };
        let bin = |point: Point| ((point.device + point.delay) * 1e9) as i64 / BIN_NANOS;
        let open = bins.pop_if(|lowest| bin(*lowest) >= bin(point));
        // A bin of which all was held up so long that it is older than the bin before tells nothing,
        // and bins are in order of device time.
        let goes_on = bins.last().is_none_or(|before| before.device < point.device);
        let lower = open.is_none_or(|lowest| point.delay < lowest.delay);
        bins.extend(if goes_on && lower { Some(point) } else { open });
    }

    /// The clock, to be told the same stamps once more, in the same order.
    pub fn finish(self) -> Smoothed {
        let settings = self.source.settings();
        let skew = settings.usual_skew_ppm * 1e-6;
        let maps = self.epochs.iter().map(|bins| Map::new(bins, skew)).collect();
        let clock = OneWay::new(settings);
        Smoothed { source: self.source, clock, maps, error_secs: f64::NAN }
    }
}

/// A clock whose whole course is known.
///
/// A `ClockModel` that knows later stamps too: its error is about half of the causal one's, and it
/// has no warm-up. Epochs are the same as the causal model's.
#[derive(Clone, Debug)]
pub struct Smoothed {
    source: Source,
    clock: OneWay,
    maps: Vec<Map>,
    error_secs: f64,
}

impl ClockModel for Smoothed {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let stamps = self.source.stamps(stamps);
        let Some(placed) = self.clock.place(&stamps) else { return self.clock.arrived(&stamps) };
        let map = self.maps.get(placed.epoch as usize);
        let (Some(map), Some(epoch)) = (map, self.clock.epoch()) else {
            return self.clock.arrived(&stamps);
        };
        self.error_secs = map.error_at(placed.last as f64 / 1e9);
        let session = |since: i64| epoch.session(since, map.at(since as f64 / 1e9) * 1e9);
        let (first, last) = (session(placed.first), session(placed.last));
        self.clock.between(placed, first, last)
    }

    fn state(&self) -> ClockState {
        let settings = self.source.settings();
        let uncertainty_secs = settings.latency.uncertainty_secs.hypot(self.error_secs);
        ClockState { uncertainty_secs, ..self.clock.state_as(self.source.kind()) }
    }

    fn news(&mut self) -> Option<News> {
        self.clock.news()
    }
}

/// Where device times come from.
#[derive(Clone, Debug)]
enum Source {
    Stamped(OneWaySettings),
    Numbered(Box<SampleIndex>),
}

impl Source {
    fn stamps(&self, stamps: &Stamps) -> Stamps {
        match self {
            Source::Stamped(_) => *stamps,
            Source::Numbered(samples) => samples.by_number(stamps),
        }
    }

    fn settings(&self) -> OneWaySettings {
        match self {
            Source::Stamped(settings) => *settings,
            Source::Numbered(samples) => samples.settings(),
        }
    }

    fn kind(&self) -> ClockKind {
        match self {
            Source::Stamped(_) => ClockKind::OneWay,
            Source::Numbered(_) => ClockKind::SampleIndex,
        }
    }
}

/// The offset over an epoch: straight between nodes.
#[derive(Clone, Debug)]
struct Map {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    device: f64,
    delay: f64,
    slope: f64,
    error: f64,
}

impl Map {
    /// Lays a line through the bins around each node.
    fn new(bins: &[Point], usual_skew: f64) -> Map {
        let (Some(first), Some(last)) = (bins.first(), bins.last()) else {
            return Map { nodes: Vec::new() };
        };
        let mut nodes: Vec<Node> = Vec::new();
        let (mut from, mut to) = (0, 0);
        let mut device = first.device;
        loop {
            while bins[from].device < device - WINDOW_SECS / 2.0 {
                from += 1;
            }
            while to < bins.len() && bins[to].device <= device + WINDOW_SECS / 2.0 {
                to += 1;
            }
            let node = node(&bins[from..to.max(from + 1)], device, usual_skew);
            nodes.push(nodes.last().map_or(node, |before| node.near(before)));
            // A long silence needs no nodes: the next one is where stamps come again.
            let next = bins.get(bins.partition_point(|bin| bin.device <= device));
            let Some(next) = next else { break };
            device = (device + NODE_SECS).max(next.device).min(last.device);
        }
        Map { nodes }
    }

    /// The offset at a device time, both since the epoch began [s].
    fn at(&self, device: f64) -> f64 {
        let after = self.nodes.partition_point(|node| node.device <= device);
        let before = after.checked_sub(1).and_then(|before| self.nodes.get(before));
        match (before, self.nodes.get(after)) {
            (Some(a), Some(b)) => {
                a.delay + (b.delay - a.delay) * (device - a.device) / (b.device - a.device)
            }
            (Some(node), None) | (None, Some(node)) => {
                node.delay + node.slope * (device - node.device)
            }
            (None, None) => 0.0,
        }
    }

    fn error_at(&self, device: f64) -> f64 {
        let after = self.nodes.partition_point(|node| node.device <= device);
        self.nodes.get(after.saturating_sub(1)).map_or(f64::NAN, |node| node.error)
    }
}

impl Node {
    /// The node, no steeper from `before` than the map may be.
    fn near(self, before: &Node) -> Node {
        let most = STEEPEST * (self.device - before.device);
        Node { delay: self.delay.clamp(before.delay - most, before.delay + most), ..self }
    }
}

fn node(bins: &[Point], device: f64, usual_skew: f64) -> Node {
    let mut envelope = Envelope::new(usual_skew);
    for bin in bins {
        envelope.push(*bin);
    }
    let guess = Fit::level(bins[bins.len() / 2]);
    let fit = envelope.fit(None, guess);
    let (delay, slope) = (fit.at(device), fit.slope.clamp(-STEEPEST, STEEPEST));
    Node { device, delay, slope, error: fit.uncertainty_at(device) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::simulated::{Device, SECOND};

    /// The mean error of a model's times [s].
    fn error(clock: &mut dyn ClockModel, sent: &[(i64, Stamps)], least_delay: f64) -> f64 {
        let errors = sent.iter().map(|(truth, stamps)| {
            ((clock.correct(stamps).measured - truth) as f64 / 1e9 - least_delay).abs()
        });
        errors.sum::<f64>() / sent.len() as f64
    }

    #[test]
    fn times_with_hindsight_are_better() {
        let mut device = Device::new(4.0);
        device.rate = 1.0 - 60e-6;
        let sent: Vec<(i64, Stamps)> = (0..2_400).map(|_| device.send()).collect();
        let settings = OneWaySettings::new(Latency::new(0.003, 0.0));
        let mut smoother = Smoother::new(settings);
        for (_, stamps) in &sent {
            smoother.push(stamps);
        }
        let after = error(&mut smoother.finish(), &sent, device.least_delay);
        let live = error(&mut OneWay::new(settings), &sent, device.least_delay);
        assert!(after < 0.7 * live, "{after} {live}");
    }

    #[test]
    fn a_device_that_was_set_has_an_epoch_before_and_one_after() {
        let mut device = Device::new(10.0);
        device.clock += 7200 * SECOND;
        let mut sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
        device.clock += 3600 * SECOND;
        sent.extend((0..600).map(|_| device.send()));
        let settings = OneWaySettings::new(Latency::new(0.0, 0.0));
        let mut smoother = Smoother::new(settings);
        for (_, stamps) in &sent {
            smoother.push(stamps);
        }
        let mut smoothed = smoother.finish();
        assert!(error(&mut smoothed, &sent, device.least_delay) < 0.01);
        assert_eq!(smoothed.state().epoch, 1);
    }

    #[test]
    fn a_last_packet_that_was_held_up_is_smoothed_with_the_others() {
        let mut device = Device::new(10.0);
        let mut sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
        let (truth, old) = sent[570];
        sent.push((truth, Stamps { arrival: sent[599].1.arrival + 2 * SECOND, ..old }));
        let mut smoother = Smoother::new(OneWaySettings::new(Latency::new(0.0, 0.0)));
        for (_, stamps) in &sent {
            smoother.push(stamps);
        }
        assert!(error(&mut smoother.finish(), &sent, device.least_delay) < 0.01);
    }

    #[test]
    fn any_settings_are_smoothed_without_a_panic() {
        for usual_skew_ppm in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300] {
            let latency = Latency::new(f64::NAN, f64::INFINITY);
            let mut device = Device::new(10.0);
            let sent: Vec<(i64, Stamps)> = (0..600).map(|_| device.send()).collect();
            let mut smoother =
                Smoother::new(OneWaySettings { usual_skew_ppm, ..OneWaySettings::new(latency) });
            for (_, stamps) in &sent {
                smoother.push(stamps);
            }
            assert!(error(&mut smoother.finish(), &sent, device.least_delay) < 0.01);
        }
    }

    proptest::proptest! {
        #[test]
        fn any_stamps_are_smoothed_without_a_panic(
            stamps: Vec<(Option<i64>, i64, u64, u32, f64)>,
        ) {
            let mut smoother = Smoother::new(OneWaySettings::new(Latency::BLUETOOTH));
            let stamps: Vec<Stamps> = stamps
                .into_iter()
                .map(|(device, arrival, index, count, period_nanos)| {
                    Stamps { device, index, count, period_nanos, ..Stamps::arrived(arrival) }
                })
                .collect();
            for stamps in &stamps {
                smoother.push(stamps);
            }
            let mut smoothed = smoother.finish();
            for stamps in &stamps {
                smoothed.correct(stamps);
            }
        }
    }
}
