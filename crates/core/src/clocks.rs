//! The clocks of a session: one model for each device and computer, shared by its streams.

mod settings;
mod owner;
mod by_interval;
mod hindsight;

use std::collections::BTreeMap;

use teampulse_timefilter::clock::{
    ClockKind, ClockModel, ClockState, Corrected, Host, KnownDevice, Latency, News, OneWay,
    OneWaySettings, Probe, Remote, SampleIndex, Smoother, Stamps,
};

use crate::computers::{SIMULATED, is_simulated};
use crate::pattern::last_token;
use crate::qos::{Durability, Qos};
use crate::stream::{About, Origin, Shape, Stream, StreamId};

use by_interval::ByInterval;
pub use hindsight::Hindsight;
use owner::Owner;
pub use settings::{ClockSettings, IntervalLatency};

/// The computer by whose clock everything is stamped where time is simulated: the session's own.
pub const SIMULATED_TIME: &str = "simulated time";

/// What a study calls the device of a stream (`[clocks.imu]`): the last word of its device, or of
/// its topic where it names none.
pub fn device_of(stream: &Stream) -> &str {
    let name = if stream.device.is_empty() { &stream.name } else { &stream.device };
    last_token(name)
}

/// How times come about in a session.
#[derive(Default)]
pub struct Clocks {
    settings: BTreeMap<String, ClockSettings>,
    timing: Timing,
    /// By topic, the computer that stamps it.
    computers: BTreeMap<String, String>,
    at_work: Vec<Clock>,
    /// The place of each clock at work.
    places: BTreeMap<Owner, usize>,
    /// The clock of each stream, by its id.
    of: Vec<Option<Placed>>,
    /// By topic, the streams that have a clock.
    streams: BTreeMap<String, Vec<StreamId>>,
    /// How often simulated time broke.
    simulated_epoch: u32,
}

/// How times come about.
#[derive(Default)]
enum Timing {
    /// They are corrected.
    #[default]
    Corrected,
    /// They are as stamped.
    Stamped,
    /// Those of devices are as stamped, by `retime`; what is known of their clocks is modelled.
    Retimed,
    /// They are corrected, and the stamps of devices collected.
    Collecting(Hindsight),
    /// They are corrected with all stamps of devices known.
    Known(Hindsight),
}

/// The clock of a stream.
#[derive(Clone, Copy)]
struct Placed {
    clock: usize,
    /// What the study says of a stream of messages: how long before its stamp it was measured.
    latency: Latency,
}

/// Stamped at once.
const NO_LATENCY: Latency = Latency::new(0.0, 0.0);

/// One clock at work.
struct Clock {
    owner: Owner,
    model: Box<dyn ClockModel>,
    /// Whether its stamps are shifted.
    off_secs: Option<f64>,
    /// What its latency is over links of which the connection interval is known.
    by_interval: Option<ByInterval>,
}

impl Clocks {
    /// Times are corrected; `settings` by name of the device.
    pub fn new(settings: BTreeMap<String, ClockSettings>) -> Clocks {
        Clocks { settings, ..Clocks::default() }
    }

    /// Times are taken as they are stamped: for simulations, and what is played.
    pub fn as_stamped() -> Clocks {
        Clocks { timing: Timing::Stamped, ..Clocks::default() }
    }

    /// Times of devices are taken as `retime` has stamped them.
    pub fn retimed(settings: BTreeMap<String, ClockSettings>) -> Clocks {
        Clocks { settings, timing: Timing::Retimed, ..Clocks::default() }
    }

    /// Times are corrected, and their stamps collected, to correct them with hindsight.
    pub fn collecting(settings: BTreeMap<String, ClockSettings>, hindsight: &Hindsight) -> Clocks {
        Clocks { settings, timing: Timing::Collecting(hindsight.clone()), ..Clocks::default() }
    }

    /// Times are corrected with the stamps of the whole recording, which is handed over once more.
    /// From now on samples are stamped with them.
    pub fn with_hindsight(
        settings: BTreeMap<String, ClockSettings>,
        hindsight: Hindsight,
    ) -> Clocks {
        Clocks { settings, timing: Timing::Known(hindsight), ..Clocks::default() }
    }

    /// Whether waves are to be given their period by the session's clock.
    pub(crate) fn stamps_anew(&self) -> bool {
        matches!(self.timing, Timing::Known(_))
    }

    /// The place in time of a reading of a raw stream.
    pub(crate) fn correct(&mut self, id: StreamId, stream: &Stream, stamps: &Stamps) -> Corrected {
        let stamped = Corrected {
            measured: stamps.source.unwrap_or(stamps.arrival),
            period_nanos: stamps.period_nanos,
            disbelieved: false,
        };
        if matches!(self.timing, Timing::Stamped) {
            return stamped;
        }
        let Placed { clock, latency } = self.placed(id, stream, stamps);
        let Clock { owner, model, by_interval, .. } = &mut self.at_work[clock];
        let is_message = matches!(stream.shape, Shape::Message(_));
        if matches!((&self.timing, &owner), (Timing::Retimed, Owner::Computer(_))) && !is_message {
            return stamped;
        }
        if let Timing::Collecting(hindsight) = &self.timing {
            hindsight.push(owner, stamps);
        }
        let corrected = model.correct(stamps);
        if matches!(self.timing, Timing::Retimed)
            && matches!(owner, Owner::Device(..) | Owner::Counted(..))
        {
            return stamped;
        }
        let of_interval = by_interval.as_mut().map_or(0.0, |by| by.more_secs(stamps.arrival));
        let latency_nanos = ((latency.secs + of_interval) * 1e9) as i64;
        Corrected { measured: corrected.measured.saturating_sub(latency_nanos), ..corrected }
    }

    /// From now on the stamps of the streams of this name are by the clock of this computer.
    pub(crate) fn stamped_by(&mut self, stream: String, computer: String) {
        if self.computers.get(&stream) != Some(&computer) {
            for id in self.streams.remove(&stream).unwrap_or_default() {
                self.of[id.0 as usize] = None;
            }
            self.computers.insert(stream, computer);
        }
    }

    /// The clock of a computer was probed.
    pub(crate) fn probed(&mut self, computer: String, probe: &Probe) {
        let clock = self.owned_by(&Owner::Computer(computer), 0.0);
        self.at_work[clock].model.probe(probe);
    }

    /// Simulated time broke.
    pub(crate) fn begin_epoch_of_simulated_time(&mut self) {
        self.simulated_epoch += 1;
    }

    /// Time passes; gives what happened to clocks, each with the clock's name.
    pub(crate) fn tick(&mut self, now: i64) -> Vec<(String, News)> {
        let mut told = Vec::new();
        for clock in &mut self.at_work {
            clock.model.tick(now);
            while let Some(news) = clock.model.news() {
                match news {
                    News::Off { secs } => clock.off_secs = Some(secs),
                    News::Trusted => clock.off_secs = None,
                    _ => {}
                }
                told.push((clock.owner.to_string(), news));
            }
        }
        told
    }

    /// What is known of the clock of a stream; `None` before its first sample.
    pub(crate) fn state(&self, id: StreamId) -> Option<ClockState> {
        let Placed { clock, latency } = (*self.of.get(id.0 as usize)?)?;
        let Clock { owner, model, by_interval, .. } = &self.at_work[clock];
        let mut state = model.state();
        if let Some(by_interval) = by_interval {
            state = by_interval.state(state);
        }
        if *owner == Owner::Host {
            state.epoch += self.simulated_epoch;
        }
        let uncertainty_secs = state.uncertainty_secs.hypot(latency.uncertainty_secs);
        Some(ClockState { uncertainty_secs, ..state })
    }

    /// What is wrong with the clock of a stream.
    pub(crate) fn complaint(&self, id: StreamId) -> Option<String> {
        let clock = self.clock(id)?;
        let secs = clock.off_secs?;
        Some(if is_simulated(secs) {
            format!("{} {SIMULATED}", clock.owner)
        } else {
            format!("the clock of {} is {secs:+.3} s off", clock.owner)
        })
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

    /// Whose clock stamps a stream. Messages without a known sender are stamped by their subject: a robot
    /// is one computer until more is known. Samples in our own shapes that another computer stamped are
    /// already placed by the device's clock, in that computer's time.
    fn owner_of(&self, id: StreamId, stream: &Stream, stamps: &Stamps) -> Owner {
        let device = || stream.device.clone();
        let computer = self.computers.get(&stream.name).map(String::as_str);
        match (&stream.shape, computer) {
            (Shape::Event, Some(SIMULATED_TIME)) if is_kept(stream) => return Owner::Kept(id),
            (_, Some(SIMULATED_TIME)) => return Owner::Host,
            (_, Some(computer)) => return Owner::Computer(computer.to_owned()),
            (_, None) => {}
        }
        match &stream.shape {
            Shape::Message(_) if stream.about == About::Session => {
                Owner::Computer(stream.name.clone())
            }
            Shape::Message(_) => Owner::Computer(stream.id.clone()),
            Shape::Event if is_kept(stream) => Owner::Kept(id),
            _ if stream.device.is_empty() && is_concluded(stream) => Owner::Worker,
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
        self.at_work.push(Clock { owner: owner.clone(), model, off_secs: None, by_interval });
        self.places.insert(owner.clone(), place);
        place
    }

    /// The model of a clock that is new.
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

    /// What the study says of the device's latency by connection interval; `None` where it says nothing.
    fn by_interval(&self, owner: &Owner) -> Option<ByInterval> {
        let (Owner::Device(_, device) | Owner::Counted(_, device)) = owner else { return None };
        let intervals = &self.settings.get(last_token(device))?.intervals;
        let base = self.settings_of(device).latency;
        (!intervals.is_empty()).then(|| ByInterval::new(base, intervals.clone()))
    }

    /// What collects the stamps of a clock; `None` for those that are corrected as they come.
    fn smoother(&self, owner: &Owner, rate_hz: f64) -> Option<Smoother> {
        match owner {
            Owner::Device(_, device) => Some(Smoother::new(self.settings_of(device))),
            Owner::Counted(_, device) => {
                Some(Smoother::of_samples(rate_hz, self.settings_of(device).latency))
            }
            Owner::Host | Owner::Kept(_) | Owner::Worker | Owner::Computer(_) => None,
        }
    }

    /// What the study says of a stream of messages: a driver's messages are stamped later than they were measured.
    fn latency_of(&self, stream: &Stream) -> Latency {
        let told = self.settings.get(device_of(stream));
        told.and_then(ClockSettings::latency).unwrap_or(NO_LATENCY)
    }

    /// What is known of the clock of a kind of device: from the study, else from the table.
    fn settings_of(&self, device: &str) -> OneWaySettings {
        let device = last_token(device);
        let known = KnownDevice::find(device);
        let unknown = || OneWaySettings::new(Latency::BLUETOOTH);
        let mut settings = known.map_or_else(unknown, OneWaySettings::of);
        let Some(told) = self.settings.get(device) else { return settings };
        settings.latency = told.latency().unwrap_or(settings.latency);
        if let Some(secs) = told.wraps_secs.filter(|secs| *secs > 0.0) {
            settings.wraps_nanos = Some((secs * 1e9) as i64);
        }
        settings
    }
}

/// Whether a late joiner of the stream receives earlier samples; the session's own streams are complete
/// from the start.
fn is_kept(stream: &Stream) -> bool {
    let kept = |qos: &Qos| qos.durability == Durability::TransientLocal;
    stream.about != About::Session && stream.qos.iter().any(kept)
}

/// Whether a raw stream was concluded from others, by a worker: its stamps are the times of what that looked
/// at.
fn is_concluded(stream: &Stream) -> bool {
    stream.origin == Origin::Raw && !stream.inputs.is_empty()
}

/// The state of a clock of which nothing is known.
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
