//! The clocks of a session: one model for each device and computer, shared by its streams.

mod settings;
mod acts;
mod owner;
mod by_interval;
mod by_beats;
mod hindsight;

use std::collections::BTreeMap;

use teampulse_timefilter::clock::{
    ClockEvent, ClockKind, ClockModel, ClockState, Corrected, Host, KnownDevice, Latency, OneWay,
    OneWaySettings, Probe, Remote, SampleIndex, Smoother, Stamps,
};

use crate::computers::{SIMULATED, is_far, is_simulated};
use crate::pattern::last_token;
use crate::qos::{Durability, Qos};
use crate::stream::{About, Origin, Shape, Signal, Stream, StreamId};

use acts::done_at;
use by_beats::ByBeats;
use by_interval::ByInterval;
pub use hindsight::Hindsight;
use owner::Owner;
pub use settings::{ClockSettings, IntervalLatency};

/// The computer name for streams stamped in simulated time, which is the session's own clock.
pub const SIMULATED_TIME: &str = "simulated time";
/// The computer name for messages stamped by sources on this host, such as camera images.
pub const THIS_HOST: &str = "this host";

/// The name of a stream's device in a study (`imu` in `[clocks.imu]`): the last token of the stream's device, or of its
/// topic if it has no device.
pub fn device_of(stream: &Stream) -> &str {
    let name = if stream.device.is_empty() { &stream.name } else { &stream.device };
    last_token(name)
}

/// Assigns times to the samples of a session.
#[derive(Default)]
pub struct Clocks {
    settings: BTreeMap<String, ClockSettings>,
    timing: Timing,
    /// The computer that stamps each topic.
    computers: BTreeMap<String, String>,
    at_work: Vec<Clock>,
    /// The index of each clock in use.
    places: BTreeMap<Owner, usize>,
    /// The clock of each stream, by its id.
    of: Vec<Option<Placed>>,
    /// The streams that have a clock, by topic.
    streams: BTreeMap<String, Vec<StreamId>>,
    /// The number of breaks of simulated time.
    simulated_epoch: u32,
}

/// How samples get their times.
#[derive(Default)]
enum Timing {
    /// Times are corrected.
    #[default]
    Corrected,
    /// Times are kept as stamped.
    Stamped,
    /// Times of devices are kept as stamped by `retime`; other clocks are modelled.
    Retimed,
    /// Times are corrected, and the stamps of devices are collected.
    Collecting(Hindsight),
    /// Times are corrected using all stamps of devices.
    Known(Hindsight),
}

/// The clock of a stream.
#[derive(Clone, Copy)]
struct Placed {
    clock: usize,
    /// How long before its stamp a message was measured, according to the study.
    latency: Latency,
}

/// An event of a clock.
#[derive(Debug)]
pub(crate) struct Reported {
    /// The index of the clock among those in use.
    pub(crate) clock: usize,
    /// The clock's owner and what happened.
    pub(crate) label: String,
    pub(crate) event: ClockEvent,
}

/// No latency: messages are stamped when they are measured.
const NO_LATENCY: Latency = Latency::new(0.0, 0.0);

/// A clock in use.
struct Clock {
    owner: Owner,
    model: Box<dyn ClockModel>,
    /// How far the clock's stamps are off [s], if they are.
    off_secs: Option<f64>,
    /// The device's latency over links with a known connection interval.
    by_interval: Option<ByInterval>,
    /// The bounds on the times of beats, for straps that report beats without times.
    by_beats: Option<ByBeats>,
}

impl Clock {
    /// The label of an event of this clock.
    fn label(&self, event: &ClockEvent) -> String {
        let Clock { owner, model, .. } = self;
        match event {
            ClockEvent::Off { secs } if is_simulated(*secs, model.state().kind) => {
                format!("{owner} {SIMULATED}")
            }
            ClockEvent::Off { secs } if is_far(*secs) => {
                format!("{owner} does not count from 1970: its offset is known from probes")
            }
            _ => format!("{owner} {event}"),
        }
    }
}

impl Clocks {
    /// Clocks that correct times, with `settings` by device name.
    pub fn new(settings: BTreeMap<String, ClockSettings>) -> Clocks {
        Clocks { settings, ..Clocks::default() }
    }

    /// Clocks that keep times as stamped: for simulations and for playback.
    pub fn as_stamped() -> Clocks {
        Clocks { timing: Timing::Stamped, ..Clocks::default() }
    }

    /// Clocks that keep the times of devices as `retime` has stamped them.
    pub fn retimed(settings: BTreeMap<String, ClockSettings>) -> Clocks {
        Clocks { settings, timing: Timing::Retimed, ..Clocks::default() }
    }

    /// Clocks that correct times and collect the stamps, for a second pass over the recording.
    pub fn collecting(settings: BTreeMap<String, ClockSettings>, hindsight: &Hindsight) -> Clocks {
        Clocks { settings, timing: Timing::Collecting(hindsight.clone()), ..Clocks::default() }
    }

    /// Clocks that correct times in a second pass over a recording, using all its stamps. Samples are stamped with the
    /// corrected times.
    pub fn with_hindsight(
        settings: BTreeMap<String, ClockSettings>,
        hindsight: Hindsight,
    ) -> Clocks {
        Clocks { settings, timing: Timing::Known(hindsight), ..Clocks::default() }
    }

    /// Whether the periods of waves are converted to the session's clock.
    pub(crate) fn stamps_anew(&self) -> bool {
        matches!(self.timing, Timing::Known(_))
    }

    /// The corrected time of a reading of a raw stream.
    pub(crate) fn correct(&mut self, id: StreamId, stream: &Stream, stamps: &Stamps) -> Corrected {
        let stamped = Corrected {
            measured: stamps.source.unwrap_or(stamps.arrival),
            period_nanos: stamps.period_nanos,
            disbelieved: false,
        };
        if matches!(self.timing, Timing::Stamped) {
            return stamped;
        }
        if let Some(measured) = done_at(stream, stamps) {
            return Corrected { measured, ..stamped };
        }
        let Placed { clock, latency } = self.placed(id, stream, stamps);
        let Clock { owner, model, by_interval, by_beats, .. } = &mut self.at_work[clock];
        let is_message = matches!(stream.shape, Shape::Message(_));
        if matches!((&self.timing, &owner), (Timing::Retimed, Owner::Computer(_))) && !is_message {
            return stamped;
        }
        if let Timing::Collecting(hindsight) = &self.timing {
            hindsight.push(owner, stamps);
        }
        let corrected = model.correct(stamps);
        if let (Some(by_beats), Some(device)) = (by_beats, stamps.device) {
            match stream.signal {
                Signal::Interval => by_beats.beat(device, corrected.measured),
                _ => by_beats.measurement(stamps.arrival),
            }
        }
        if matches!(self.timing, Timing::Retimed)
            && matches!(owner, Owner::Device(..) | Owner::Counted(..))
        {
            return stamped;
        }
        let of_interval = by_interval.as_mut().map_or(0.0, |by| by.more_secs(stamps.arrival));
        let latency_nanos = ((latency.secs + of_interval) * 1e9) as i64;
        Corrected { measured: corrected.measured.saturating_sub(latency_nanos), ..corrected }
    }

    /// Assigns the streams of a topic to a computer's clock from now on.
    pub(crate) fn stamped_by(&mut self, stream: String, computer: String) {
        if self.computers.get(&stream) != Some(&computer) {
            for id in self.streams.remove(&stream).unwrap_or_default() {
                self.of[id.0 as usize] = None;
            }
            self.computers.insert(stream, computer);
        }
    }

    /// Takes in a probe of the clock of a computer.
    pub(crate) fn probed(&mut self, computer: String, probe: &Probe) {
        let clock = self.owned_by(&Owner::Computer(computer), 0.0);
        self.at_work[clock].model.probe(probe);
    }

    /// Begins a new epoch after a break of simulated time.
    pub(crate) fn begin_epoch_of_simulated_time(&mut self) {
        self.simulated_epoch += 1;
    }

    /// Advances the time; returns the events of clocks.
    pub(crate) fn tick(&mut self, now: i64) -> Vec<Reported> {
        let mut all = Vec::new();
        for (place, clock) in self.at_work.iter_mut().enumerate() {
            clock.model.tick(now);
            while let Some(event) = clock.model.next_event() {
                match event {
                    ClockEvent::Off { secs } => clock.off_secs = Some(secs),
                    ClockEvent::Trusted => clock.off_secs = None,
                    _ => {}
                }
                all.push(Reported { clock: place, label: clock.label(&event), event });
            }
        }
        all
    }

    /// The streams that a clock stamps.
    pub(crate) fn streams_of(&self, clock: usize) -> Vec<StreamId> {
        let stamps = |of: &Option<Placed>| of.is_some_and(|placed| placed.clock == clock);
        let ids = (0..).map(StreamId).zip(&self.of);
        ids.filter(|(_, of)| stamps(of)).map(|(id, _)| id).collect()
    }

    /// The state of the clock of a stream; `None` before its first sample.
    pub(crate) fn state(&self, id: StreamId) -> Option<ClockState> {
        let Placed { clock, latency } = (*self.of.get(id.0 as usize)?)?;
        let Clock { owner, model, by_interval, by_beats, .. } = &self.at_work[clock];
        let mut state = model.state();
        if let Some(by_beats) = by_beats {
            state = by_beats.state(state);
        }
        if let Some(by_interval) = by_interval {
            state = by_interval.state(state);
        }
        if *owner == Owner::Host {
            state.epoch += self.simulated_epoch;
        }
        let uncertainty_secs = state.uncertainty_secs.hypot(latency.uncertainty_secs);
        Some(ClockState { uncertainty_secs, ..state })
    }

    /// The fault of the clock of a stream, if any.
    pub(crate) fn complaint(&self, id: StreamId) -> Option<String> {
        let clock = self.clock(id)?;
        let secs = clock.off_secs?;
        let kind = clock.model.state().kind;
        if is_simulated(secs, kind) {
            return Some(format!("{} {SIMULATED}", clock.owner));
        }
        // A clock that does not count from 1970 is no fault: its offset is known from probes.
        (!is_far(secs)).then(|| format!("the clock of {} is {secs:+.3} s off", clock.owner))
    }

    fn clock(&self, id: StreamId) -> Option<&Clock> {
        let placed = (*self.of.get(id.0 as usize)?)?;
        Some(&self.at_work[placed.clock])
    }

    /// The clock of a stream, chosen at the stream's first reading.
    fn placed(&mut self, id: StreamId, stream: &Stream, stamps: &Stamps) -> Placed {
        let index = id.0 as usize;
        if let Some(Some(placed)) = self.of.get(index) {
            return *placed;
        }
        let owner = self.owner_of(id, stream, stamps);
        let clock = self.owned_by(&owner, stream.rate_hz);
        if self.of.len() <= index {
            self.of.resize(index + 1, None);
        }
        let is_message = matches!(stream.shape, Shape::Message(_));
        let latency = if is_message { self.latency_of(stream) } else { NO_LATENCY };
        let placed = Placed { clock, latency };
        self.streams.entry(stream.name.clone()).or_default().push(id);
        self.of[index] = Some(placed);
        placed
    }

    /// The owner of the clock that stamps a stream. Messages without a known sender are assigned to their subject: a
    /// robot counts as one computer until its computers are known. Samples in our own shapes that another computer
    /// stamped were already corrected there, by the device's clock, to that computer's time.
    fn owner_of(&self, id: StreamId, stream: &Stream, stamps: &Stamps) -> Owner {
        let device = || stream.device.clone();
        let computer = self.computers.get(&stream.name).map(String::as_str);
        match (&stream.shape, computer) {
            (Shape::Event, Some(SIMULATED_TIME)) if is_kept(stream) => return Owner::Kept(id),
            (_, Some(SIMULATED_TIME | THIS_HOST)) => return Owner::Host,
            (_, Some(computer)) => return Owner::Computer(computer.to_owned()),
            (_, None) => {}
        }
        let is_by_worker = stream.device.is_empty() && is_concluded(stream);
        match &stream.shape {
            Shape::Event if is_kept(stream) => Owner::Kept(id),
            _ if is_by_worker => Owner::Worker,
            Shape::Message(_) if stream.about == About::Session => {
                Owner::Computer(stream.name.clone())
            }
            Shape::Message(_) => Owner::Computer(stream.id.clone()),
            _ if stream.device.is_empty() => Owner::Host,
            _ if stamps.device.is_some() => Owner::Device(stream.subject(), device()),
            Shape::Sample | Shape::Wave if stream.rate_hz > 0.0 => Owner::Counted(id, device()),
            _ => Owner::Host,
        }
    }

    fn owned_by(&mut self, owner: &Owner, rate_hz: f64) -> usize {
        if let Some(known) = self.places.get(owner) {
            return *known;
        }
        let model = self.begin(owner, rate_hz);
        let place = self.at_work.len();
        let by_interval = self.by_interval(owner);
        let by_beats = self.by_beats(owner);
        let owned = owner.clone();
        self.at_work.push(Clock { owner: owned, model, off_secs: None, by_interval, by_beats });
        self.places.insert(owner.clone(), place);
        place
    }

    /// The model of a new clock.
    fn begin(&self, owner: &Owner, rate_hz: f64) -> Box<dyn ClockModel> {
        match &self.timing {
            Timing::Known(hindsight) => {
                if let Some(smoother) = hindsight.take(owner) {
                    return Box::new(smoother.finish());
                }
            }
            Timing::Collecting(hindsight) => hindsight.begin(owner, self.smoother(owner, rate_hz)),
            Timing::Corrected | Timing::Stamped | Timing::Retimed => {}
        }
        match owner {
            Owner::Host => Box::new(Host::default()),
            Owner::Kept(_) => Box::new(Host::with_history()),
            Owner::Worker => Box::new(Host::that_takes_long()),
            Owner::Device(_, device) => Box::new(OneWay::new(self.settings_of(device))),
            Owner::Counted(_, device) => {
                Box::new(SampleIndex::new(rate_hz, self.settings_of(device).latency))
            }
            Owner::Computer(_) => Box::new(Remote::default()),
        }
    }

    /// The study's latencies of a device by connection interval; `None` if there are none.
    fn by_interval(&self, owner: &Owner) -> Option<ByInterval> {
        let (Owner::Device(_, device) | Owner::Counted(_, device)) = owner else { return None };
        let intervals = &self.settings.get(last_token(device))?.intervals;
        let base = self.settings_of(device).latency;
        (!intervals.is_empty()).then(|| ByInterval::new(base, intervals.clone()))
    }

    /// The bounds on the times of a strap's beats; `None` for any other device.
    fn by_beats(&self, owner: &Owner) -> Option<ByBeats> {
        let Owner::Device(_, device) = owner else { return None };
        let device = last_token(device);
        let latency_secs = self.settings_of(device).latency.secs;
        device.starts_with(by_beats::STRAP).then(|| ByBeats::new(latency_secs))
    }

    /// The collector of the stamps of a clock; `None` for clocks that are corrected causally.
    fn smoother(&self, owner: &Owner, rate_hz: f64) -> Option<Smoother> {
        match owner {
            Owner::Device(_, device) => Some(Smoother::new(self.settings_of(device))),
            Owner::Counted(_, device) => {
                Some(Smoother::of_samples(rate_hz, self.settings_of(device).latency))
            }
            Owner::Host | Owner::Kept(_) | Owner::Worker | Owner::Computer(_) => None,
        }
    }

    /// The study's latency for a stream of messages: drivers stamp messages later than they were measured.
    fn latency_of(&self, stream: &Stream) -> Latency {
        let known = self.settings.get(device_of(stream));
        known.and_then(ClockSettings::latency).unwrap_or(NO_LATENCY)
    }

    /// The clock settings of a kind of device: from the study, else from the table of known devices.
    fn settings_of(&self, device: &str) -> OneWaySettings {
        let device = last_token(device);
        let known = KnownDevice::find(device);
        let unknown = || OneWaySettings::new(Latency::BLUETOOTH);
        let mut settings = known.map_or_else(unknown, OneWaySettings::of);
        let Some(known) = self.settings.get(device) else { return settings };
        settings.latency = known.latency().unwrap_or(settings.latency);
        if let Some(secs) = known.wraps_secs.filter(|secs| *secs > 0.0) {
            settings.wraps_nanos = Some((secs * 1e9) as i64);
        }
        settings
    }
}

/// Whether late joiners receive the stream's earlier samples. False for the session's own streams, which are complete
/// from the start.
fn is_kept(stream: &Stream) -> bool {
    let kept = |qos: &Qos| qos.durability == Durability::TransientLocal;
    stream.about != About::Session && stream.qos.iter().any(kept)
}

/// Whether a worker derived a raw stream from others: its stamps are the times of the worker's inputs.
fn is_concluded(stream: &Stream) -> bool {
    stream.origin == Origin::Raw && !stream.inputs.is_empty()
}

/// The state of an unknown clock.
pub(crate) const UNKNOWN: ClockState = ClockState {
    kind: ClockKind::Host,
    epoch: 0,
    offset_secs: f64::NAN,
    skew_ppm: f64::NAN,
    jitter_secs: f64::NAN,
    uncertainty_secs: f64::NAN,
};

#[cfg(test)]
mod tests;
