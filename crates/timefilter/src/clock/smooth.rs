//! Offline smoothing: clock models that also use later timestamps.

mod held;
mod lines;

use self::held::Held;
use self::lines::{FittedLines, Prior, Stretches, stated};
use super::beat::Teeth;
use super::comb::Comb;
use super::envelope::{BIN_NANOS, POOR_SKEW};
use super::epoch::{Packet, RAISED_LONG};
use super::fit::{Fit, Point};
use super::one_way::{OneWay, OneWaySettings, Placed};
use super::sample_index::{self, SampleIndex};
use super::{ClockEvent, ClockKind, ClockModel, ClockState, Corrected, Latency, Stamps};

/// The spacing of the map's nodes [s].
const NODE_SECS: f64 = 20.0;
/// The stated drift of the skew between nodes [1/s].
const BETWEEN_DRIFT: f64 = 3e-8;
/// The number of nodes dropped before delays rose permanently.
const RISING_NODES: usize = 2;
/// The span over which the slope for extrapolation beyond the last node is taken [s].
const FAR_SECS: f64 = 120.0;
/// The minimum share of beating packets at which a course counts as beating.
const BEATING: f64 = 0.2;
/// The minimum share of bins with a packet that was not delayed, at which stretches of several bins count as whole.
const WHOLE: f64 = 0.9;
/// The steepest slope of the map between nodes; it keeps the map strictly increasing.
const STEEPEST: f64 = 0.5;

/// The history of a clock between two resets of unknown size.
#[derive(Clone, Debug, Default)]
struct History {
    bins: Vec<Bin>,
    /// The length of the current run of raised bins, according to the live model.
    run: usize,
    /// The additional uncertainty of the line due to that run [s].
    unclear: f64,
    /// The last interval between link events that packets beat with [s], the number of packets for which the live model
    /// knew such an interval, and the number of all packets.
    interval: f64,
    beating: u64,
    packets: u64,
    /// Whether the skew was outside the usual range.
    is_poor: bool,
    comb: Comb,
}

/// The lowest point of a bin.
#[derive(Clone, Copy, Debug)]
struct Bin {
    point: Point,
    /// Whether all of its packets were delayed.
    is_raised: bool,
}

impl History {
    /// Takes the length of the current run of raised bins, and the additional uncertainty of the line due to it [s]. A
    /// run that falls back to the line was delayed; one that lasts was not.
    fn raised(&mut self, (run, unclear): (usize, f64)) {
        let closed = self.bins.len();
        // A run whose count restarts continues: its link is too slow.
        let is_anew = (1..self.run).contains(&run);
        let before = if is_anew { run - 1 } else { self.run };
        if run > before {
            let from = closed.saturating_sub(run - before);
            self.bins[from..closed].iter_mut().for_each(|bin| bin.is_raised = true);
        }
        if run == 0 && self.run + 1 >= RAISED_LONG {
            let from = closed.saturating_sub(self.run + 1);
            self.bins[from..].iter_mut().for_each(|bin| bin.is_raised = false);
        }
        (self.run, self.unclear) = (run, unclear);
    }

    /// Takes the interval that packets beat with at present [s]; 0 if they do not.
    fn beats(&mut self, interval: f64) {
        self.packets += 1;
        if interval > 0.0 {
            self.interval = interval;
            self.beating += 1;
        }
    }

    /// The lowest points of bins whose packets were not all delayed.
    fn free(&self) -> Vec<Point> {
        self.bins.iter().filter(|bin| !bin.is_raised).map(|bin| bin.point).collect()
    }

    /// The prior of this clock; skews of its kind have the standard deviation `usual_skew`.
    fn prior(&self, usual_skew: f64) -> Prior {
        let skew = if self.is_poor { usual_skew.max(POOR_SKEW) } else { usual_skew };
        Prior { skew, comb: self.comb }
    }

    /// The stretches that make lines most certain; single bins if many bins are left out because all of their packets
    /// were delayed, since longer stretches would then differ in length, and so in level.
    fn stretches(&self, usual_skew: f64) -> Stretches {
        let free = self.free();
        let are_whole = free.len() as f64 >= WHOLE * self.bins.len() as f64;
        if are_whole { Stretches::surest(&free, self.prior(usual_skew)) } else { Stretches::SINGLE }
    }

    /// The interval between the link events that packets beat with [s]; 0 if there are none.
    fn beat_interval(&self) -> f64 {
        let often = self.beating as f64 >= BEATING * self.packets as f64;
        if often { self.interval } else { 0.0 }
    }
}

/// Collects all timestamps of a device, in order of arrival.
#[derive(Clone, Debug)]
pub struct Smoother {
    source: Source,
    clock: OneWay,
    /// The lowest point of each bin, by course of the clock.
    courses: Vec<History>,
    held: Held,
}

impl Smoother {
    /// Creates a smoother for a device with its own clock.
    pub fn new(settings: OneWaySettings) -> Smoother {
        let settings = settings.sound();
        Smoother {
            source: Source::Stamped(settings),
            clock: OneWay::new(settings),
            courses: Vec::new(),
            held: Held::default(),
        }
    }

    /// Creates a smoother for a device without a clock, with a nominal rate of `rate_hz`.
    pub fn of_samples(rate_hz: f64, latency: Latency) -> Smoother {
        let source = Source::Numbered(Box::new(SampleIndex::new(rate_hz, latency)));
        let clock = OneWay::counting(sample_index::settings(latency));
        Smoother { source, clock, courses: Vec::new(), held: Held::default() }
    }

    /// Takes the stamps of the next reading. Uses 16 bytes for every two seconds.
    pub fn push(&mut self, stamps: &Stamps) {
        let stamps = self.source.stamps(stamps, &mut self.clock);
        let (placed, epoch) = (self.clock.place(&stamps), self.clock.epoch());
        let (Some(placed), Some(epoch)) = (placed, epoch) else {
            return self.held.unfit(self.clock.unfit());
        };
        let point = epoch.point(placed.packet);
        let is_new = placed.course as usize >= self.courses.len();
        self.held.fit(placed.course, epoch.origin(), is_new);
        self.courses.resize_with(placed.course as usize + 1, History::default);
        let Some(history) = self.courses.last_mut() else { return };
        history.raised(epoch.raised_secs());
        let bin = |point: Point| ((point.device + point.delay) * 1e9) as i64 / BIN_NANOS;
        let open = history.bins.pop_if(|lowest| bin(lowest.point) >= bin(point));
        // A bin whose packets were all delayed so long that it is older than the previous bin gives no information and
        // is dropped, so bins are in order of device time.
        let goes_on = history.bins.last().is_none_or(|before| before.point.device < point.device);
        let lower = open.is_none_or(|lowest| point.delay < lowest.point.delay);
        let new = Bin { point, is_raised: open.is_some_and(|open| open.is_raised) };
        history.bins.extend(if goes_on && lower { Some(new) } else { open });
        history.is_poor |= epoch.is_poor();
        history.comb = epoch.comb();
        history.beats(epoch.beat_interval());
    }

    /// Returns the smoothed clock, which expects the same stamps again in the same order.
    pub fn finish(self) -> Smoothed {
        let settings = self.source.settings();
        let skew = settings.usual_skew_ppm * 1e-6;
        // What is best for the longest course is best for all, since all came over one link.
        let longest = self.courses.iter().max_by_key(|history| history.bins.len());
        let stretches = longest.map_or(Stretches::SINGLE, |history| history.stretches(skew));
        let map = |history: &History| Map::new(history, skew, stretches);
        let maps = self.courses.iter().map(map).collect();
        let clock = match self.source {
            Source::Stamped(_) => OneWay::new(settings),
            Source::Numbered(_) => OneWay::counting(settings),
        };
        let (source, held) = (self.source.again(), self.held.again());
        Smoothed { source, clock, maps, held, error_secs: f64::NAN }
    }
}

/// A clock whose complete history is known.
///
/// A `ClockModel` that also knows later timestamps: its error is about half that of the causal model, and
/// there is no warm-up. Epochs are those of the causal model, but readings that came before it was clear that their
/// clock had been set are placed by what came after.
#[derive(Clone, Debug)]
pub struct Smoothed {
    source: Source,
    clock: OneWay,
    maps: Vec<Map>,
    held: Held,
    error_secs: f64,
}

impl ClockModel for Smoothed {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let stamps = self.source.stamps(stamps, &mut self.clock);
        let placed = self.clock.place(&stamps);
        let Some((placed, origin)) = self.located(placed) else {
            return self.clock.arrived(&stamps);
        };
        let Some(map) = self.maps.get(placed.course as usize) else {
            return self.clock.arrived(&stamps);
        };
        let error = |since: i64| map.error_at(since as f64 / 1e9);
        self.error_secs = error(placed.first).max(error(placed.last));
        let session = |since: i64| origin.session(since, map.at(since as f64 / 1e9) * 1e9);
        let (first, last) = (session(placed.first), session(placed.last));
        self.clock.between(placed, first, last)
    }

    fn state(&self) -> ClockState {
        let settings = self.source.settings();
        let uncertainty_secs = settings.latency.uncertainty_secs.hypot(self.error_secs);
        ClockState { uncertainty_secs, ..self.clock.state_as(self.source.kind()) }
    }

    fn next_event(&mut self) -> Option<ClockEvent> {
        self.clock.next_event()
    }
}

impl Smoothed {
    /// The place of the next reading in its course, and the first packet of that course; `None` if its time is not
    /// known.
    fn located(&mut self, placed: Option<Placed>) -> Option<(Placed, Packet)> {
        match self.held.next() {
            Some((course, origin)) => {
                let unfit = self.clock.unfit()?.since(origin.device);
                Some((Placed { course, ..unfit }, origin))
            }
            None => Some((placed?, self.clock.epoch()?.origin())),
        }
    }
}

/// The source of device times.
#[derive(Clone, Debug)]
enum Source {
    Stamped(OneWaySettings),
    Numbered(Box<SampleIndex>),
}

impl Source {
    fn stamps(&mut self, stamps: &Stamps, clock: &mut OneWay) -> Stamps {
        match self {
            Source::Stamped(_) => *stamps,
            Source::Numbered(samples) => {
                let (stamps, wrong) = samples.by_number(stamps);
                if let Some(declared_hz) = wrong {
                    clock.begin_anew(declared_hz, 1e9 / stamps.period_nanos);
                }
                if samples.has_paused(&stamps) {
                    clock.resume();
                }
                stamps
            }
        }
    }

    /// A new source with the same settings.
    fn again(self) -> Source {
        match self {
            Source::Stamped(_) => self,
            Source::Numbered(samples) => Source::Numbered(Box::new(samples.again())),
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

/// The offset over an epoch: piecewise linear between nodes.
#[derive(Clone, Debug)]
struct Map {
    nodes: Vec<Node>,
    /// The line of the last node; the farther it is followed, the less certain it is.
    last: Option<Fit>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    device: f64,
    delay: f64,
    slope: f64,
    error: f64,
}

impl Map {
    /// Fits a line around each node to the lowest points of stretches.
    fn new(history: &History, usual_skew: f64, stretches: Stretches) -> Map {
        let free = history.free();
        if free.is_empty() {
            return Map { nodes: Vec::new(), last: None };
        }
        if let Some(nodes) = through_steps(&free, history.beat_interval()) {
            return Map { nodes, last: None };
        }
        let lines = FittedLines::under(&free, stretches, history.prior(usual_skew));
        let mut nodes: Vec<Node> = Vec::with_capacity(lines.len() + 1);
        for (device, fit) in lines.iter() {
            let node = Node::of(fit, device);
            nodes.push(nodes.last().map_or(node, |before| node.near(before)));
        }
        if history.run > 0 {
            // Delays may already have been rising in the last bins.
            nodes.truncate(nodes.len().saturating_sub(RISING_NODES).max(1));
        }
        let end = nodes.len() - 1;
        let last = lines.iter().nth(end).map(|(_, fit)| fit);
        let is_far = |node: &Node| nodes[end].device - node.device >= FAR_SECS;
        if let Some(far) = nodes.iter().rev().copied().find(is_far) {
            nodes[end].slope = (nodes[end].delay - far.delay) / (nodes[end].device - far.device);
        }
        // It is unknown whether bins that are still raised at the end would have fallen back.
        let until = history.bins.len() - history.run.min(history.bins.len());
        if let (Some(bin), Some(node)) = (history.bins.get(until), nodes.last().copied()) {
            let device = bin.point.device.max(node.device + 1e-9);
            let delay = node.delay + node.slope * (device - node.device);
            let error = node.error + beyond(last, node.device, device) + history.unclear;
            nodes.push(Node { device, delay, error, ..node });
        }
        Map { nodes, last }
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

    /// Half the width of the 95 % interval [s]: far from the nodes, a drifting skew bends the true offset
    /// away from the straight line.
    fn error_at(&self, device: f64) -> f64 {
        let after = self.nodes.partition_point(|node| node.device <= device);
        let before = self.nodes.get(after.saturating_sub(1));
        match (before, self.nodes.get(after)) {
            (Some(a), Some(b)) if after > 0 => {
                let (since, until) = (device - a.device, b.device - device);
                let part = since / (b.device - a.device);
                a.error + (b.error - a.error) * part + BETWEEN_DRIFT * since * until / 2.0
            }
            (Some(node), None) => node.error + beyond(self.last, node.device, device),
            (Some(node), _) => node.error,
            (None, _) => f64::NAN,
        }
    }
}

impl Node {
    /// The node of a line at a device time [s].
    fn of(fit: Fit, device: f64) -> Node {
        let (delay, slope) = (fit.at(device), fit.slope.clamp(-STEEPEST, STEEPEST));
        Node { device, delay, slope, error: stated(&fit, device) }
    }

    /// The node, with the slope from `before` limited to the steepest that the map allows.
    fn near(self, before: &Node) -> Node {
        let most = STEEPEST * (self.device - before.device);
        Node { delay: self.delay.clamp(before.delay - most, before.delay + most), ..self }
    }
}

/// How much less certain a line is at a device time than at an earlier one [s].
fn beyond(line: Option<Fit>, from: f64, device: f64) -> f64 {
    line.map_or(0.0, |fit| (stated(&fit, device) - stated(&fit, from)).max(0.0))
}

/// Nodes from the steps of a sawtooth of height `interval` [s]; `None` if it cannot be followed.
fn through_steps(bins: &[Point], interval: f64) -> Option<Vec<Node>> {
    let mut teeth = Teeth::whole();
    teeth.begin(interval);
    let mut levels: Vec<Point> = Vec::new();
    for bin in bins {
        teeth.push(*bin);
        let is_next = |last: &Point| bin.device - last.device >= NODE_SECS;
        levels.extend(teeth.level().filter(|_| levels.last().is_none_or(is_next)));
    }
    let node = |level: Point| {
        let fit = teeth.line(level);
        let (device, delay, slope) = (level.device, fit.delay, fit.slope);
        Node { device, delay, slope, error: fit.uncertainty_at(device, device) }
    };
    let are_followed = teeth.are_followed() && !teeth.pass_too_fast(bins.iter().copied());
    are_followed.then(|| levels.into_iter().map(node).collect())
}

#[cfg(test)]
mod tests;
