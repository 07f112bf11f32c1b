//! The values of an electromyogram's windows, with its bursts as events.
//!
//! A `burst` is placed at its onset; its details are the `channel`'s index, `duration_secs`, and
//! `mean_envelope` and `peak_envelope` in the signal's unit.
//!
//! Features are those of 0.25 s [frames](super::Frames), 0.125 s apart, counted from the first sample; the
//! value of a window is their mean over the frames that lie in it, so that windows of any length are
//! comparable. A window without a whole frame is too short. A frame needs nine tenths of its samples.

use std::collections::VecDeque;

use super::Thresholds;
use super::band::{clean, envelope};
use super::burst::{Burst, BurstDetector, BurstSettings, bursts_of};
use super::channel::{Activity, Taken};
use super::store::{Pair, Store};
use super::values::{measure, values};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::{SignalError, checked};

/// The largest number of channels.
const MOST_CHANNELS: usize = 256;
/// The most bursts waiting to be read; the oldest are dropped.
const MOST_EVENTS: usize = 4096;

/// Settings of the analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The channels in order, 1 to 256. Further channels of a sample are ignored.
    pub channels: Vec<Channel>,
    /// The unit of the signal.
    pub unit: String,
    /// The thresholds of zero crossings and slope sign changes [unit].
    pub thresholds: Thresholds,
    /// How bursts are separated from rest.
    pub bursts: BurstSettings,
    /// Pairs of channels (indices) over antagonistic muscles.
    pub antagonists: Vec<[usize; 2]>,
}

/// A channel: a muscle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// The name of the channel, as in `EMG_RMS/ch1`; empty for just `EMG_RMS`.
    pub name: String,
    /// The mean envelope (mean absolute value) during a maximal voluntary contraction [unit], if measured.
    pub mvc: Option<f64>,
}

impl Default for Settings {
    /// One unnamed channel in mV, without thresholds or MVC.
    fn default() -> Settings {
        Settings {
            channels: vec![Channel::default()],
            unit: "mV".into(),
            thresholds: Thresholds::default(),
            bursts: BurstSettings::default(),
            antagonists: Vec::new(),
        }
    }
}

impl Settings {
    fn store(&self, rate_hz: f64) -> Result<Store, SignalError> {
        let count = self.channels.len();
        checked("number of channels", count as f64, (1.0, MOST_CHANNELS as f64))?;
        for threshold in [self.thresholds.zero_crossing, self.thresholds.slope_change] {
            checked("threshold", threshold, (0.0, f64::MAX))?;
        }
        for mvc in self.channels.iter().filter_map(|channel| channel.mvc) {
            checked("maximal voluntary contraction", mvc, (f64::MIN_POSITIVE, f64::MAX))?;
        }
        for &index in self.antagonists.iter().flatten() {
            checked("index of an antagonist", index as f64, (0.0, count as f64 - 1.0))?;
        }
        Store::new(rate_hz, self.thresholds, count, self.pairs())
    }

    fn pairs(&self) -> Vec<Pair> {
        let mvc = |index: usize| self.channels[index].mvc;
        let pair = |&[one, other]: &[usize; 2]| Pair {
            channels: [one, other],
            mvc: mvc(one).zip(mvc(other)).map(|(one, other)| [one, other]),
        };
        self.antagonists.iter().map(pair).collect()
    }

    fn values(&self, rate_hz: f64, run: &str) -> Vec<Value> {
        let high_hz = 450f64.min(rate_hz / 2.0 * 0.95);
        values(self, &format!("band 20–{high_hz:.0} Hz (Butterworth 4, {run})"))
    }
}

/// A causal analysis at 100 Hz to 10 kHz.
///
/// The band-pass and the envelope are delayed by 10 to 50 ms, which windows do not correct; bursts are
/// reported when they have ended, at corrected times, so the number of bursts in a window may grow
/// afterwards. No sample allocates in steady state.
///
/// Returns an error for another rate, or settings out of range.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    let store = settings.store(rate_hz)?;
    let detectors = settings.channels.iter().map(|_| BurstDetector::new(rate_hz, settings.bursts));
    let detectors: Vec<BurstDetector> = detectors.collect::<Result<_, _>>()?;
    let opened_ns = vec![0; detectors.len()];
    let taken = vec![Taken::default(); detectors.len()];
    let answers =
        Answers { values: settings.values(rate_hz, "causal"), settings: settings.clone(), store };
    Ok(Box::new(Running { answers, detectors, opened_ns, taken, events: VecDeque::new() }))
}

/// An analysis of a whole recording: band-pass and envelope without delay, rest estimated from both sides.
///
/// A channel without enough usable samples has only gaps. Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut store = settings.store(recording.rate_hz)?;
    let nothing = vec![f64::NAN; recording.len()];
    let (mut lanes, mut events) = (Vec::new(), Vec::new());
    for index in 0..settings.channels.len() {
        let raw = recording.channels.get(index).unwrap_or(&nothing);
        let mut lane = Lane::of(&raw[..recording.len()], recording.rate_hz);
        let bursts = bursts_of(lane.raw, &lane.envelope, recording.rate_hz, settings.bursts)?;
        events.extend(bursts.iter().map(|burst| event(index, burst, recording)));
        lane.mark(&bursts);
        lanes.push(lane);
    }
    let mut taken = vec![Taken::default(); lanes.len()];
    for sample in 0..recording.len() {
        taken.iter_mut().zip(&lanes).for_each(|(taken, lane)| *taken = lane.at(sample));
        store.push(recording.time_ns(sample as f64), &taken);
    }
    events.sort_by_key(|event| event.at_ns);
    for event in &events {
        store.begin_burst(event.at_ns, event.details[0].1 as usize);
    }
    let values = settings.values(recording.rate_hz, "zero phase");
    let windows = Box::new(Answers { values, settings: settings.clone(), store });
    Ok(Whole { events, windows })
}

fn event(channel: usize, burst: &Burst, recording: &Recording<'_>) -> Event {
    let at_ns = recording.time_ns(burst.onset);
    burst_event(channel, burst, at_ns, recording.rate_hz)
}

fn burst_event(channel: usize, burst: &Burst, at_ns: i64, rate_hz: f64) -> Event {
    let details = vec![
        ("channel", channel as f64),
        ("duration_secs", (burst.offset - burst.onset) / rate_hz),
        ("mean_envelope", burst.mean),
        ("peak_envelope", burst.peak),
    ];
    Event { kind: "burst", sample: burst.onset, at_ns, details }
}

/// A channel of a whole recording.
struct Lane<'a> {
    raw: &'a [f64],
    band: Vec<f64>,
    envelope: Vec<f64>,
    activity: Vec<Activity>,
}

impl Lane<'_> {
    fn of(raw: &[f64], rate_hz: f64) -> Lane<'_> {
        // A channel that cannot be filtered is too short, or has no usable sample.
        let band = clean(raw, rate_hz).unwrap_or_else(|_| vec![0.0; raw.len()]);
        let envelope = envelope(&band, rate_hz).unwrap_or_else(|_| vec![0.0; raw.len()]);
        Lane { raw, band, envelope, activity: Vec::new() }
    }

    fn mark(&mut self, bursts: &[Burst]) {
        let known = if bursts.is_empty() { Activity::Unknown } else { Activity::Rest };
        self.activity = vec![known; self.raw.len()];
        for burst in bursts {
            let end = (burst.offset as usize).min(self.activity.len());
            let samples = (burst.onset as usize).min(end)..end;
            self.activity[samples].fill(Activity::Contraction);
        }
    }

    fn at(&self, sample: usize) -> Taken {
        let (raw, band) = (self.raw[sample], self.band[sample]);
        let (envelope, activity) = (self.envelope[sample], self.activity[sample]);
        Taken { raw, band, envelope, activity }
    }
}

/// The store of all channels, which can be queried for any span.
struct Answers {
    settings: Settings,
    values: Vec<Value>,
    store: Store,
}

impl Windows for Answers {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        measure(&self.settings, &self.store, span)
    }
}

struct Running {
    answers: Answers,
    detectors: Vec<BurstDetector>,
    /// The start of the open burst of each channel [ns].
    opened_ns: Vec<i64>,
    taken: Vec<Taken>,
    events: VecDeque<Event>,
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        self.answers.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.answers.measure(span)
    }
}

impl Running {
    fn report(&mut self, index: usize, burst: &Burst) {
        let rate_hz = self.answers.store.rate_hz();
        let delay_ns = (self.detectors[index].delay() / rate_hz * 1e9) as i64;
        let at_ns = self.opened_ns[index].saturating_sub(delay_ns);
        self.answers.store.begin_burst(at_ns, index);
        if self.events.len() == MOST_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(burst_event(index, burst, at_ns, rate_hz));
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        for index in 0..self.detectors.len() {
            let raw = channels.get(index).copied().unwrap_or(f64::NAN);
            let was_open = self.detectors[index].is_open();
            let (band, envelope, burst) = self.detectors[index].follow(raw);
            // Rest is known from the first burst of the channel on.
            let activity = match self.taken[index].activity {
                _ if self.detectors[index].is_active() => Activity::Contraction,
                Activity::Unknown => Activity::Unknown,
                Activity::Rest | Activity::Contraction => Activity::Rest,
            };
            self.taken[index] = Taken { raw, band, envelope, activity };
            if let Some(burst) = burst {
                self.report(index, &burst);
            }
            if !was_open && self.detectors[index].is_open() {
                self.opened_ns[index] = at_ns;
            }
        }
        self.answers.store.push(at_ns, &self.taken);
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.answers.store.forget(before_ns);
    }
}
