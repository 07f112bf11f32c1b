//! The EEG behind the common analysis interface: samples in, blinks and the values of windows out.
//!
//! A window is the average of the 4 s segments within it. A segment begins every 2 s, counted from the first
//! sample, so that each spectrum is computed once, when its last sample arrives. Spectra use the raw samples
//! and are bit-identical live and afterwards; only blinks are detected by another method. A window of 6 s or
//! more holds at least one segment; up to 2 s at its start and end are unused.

use std::collections::VecDeque;

use super::blinks::{BlinkDetector, find_blinks};
use super::examiner::Examiner;
use super::frontal::Frontal;
use super::known::Known;
use crate::analysis::{Causal, Event, Measured, Recording, Span, Track, Value, Whole, Windows};
use crate::error::SignalError;

/// How long the times of samples are kept, for blinks that become known later [s].
const LATE_SECS: f64 = 2.0;
const CAUSAL_BLINKS: &str = "blinks: below 7 Hz (Butterworth 4, causal) in the mean of the channels \
    above the eyes, 0.05–0.5 s wide, at least 30 µV and 5 σ above the signal 0.4 s before and after; σ: deviation from \
    the mean of ±0.15 s (interquartile range of the last 60 s); known up to 0.5 s later";
const WHOLE_BLINKS: &str = "blinks: below 7 Hz (Butterworth 2, zero phase) in the mean of the channels \
    above the eyes, 0.05–0.5 s wide, at least 30 µV and 5 σ above the signal 0.4 s before and after; σ: deviation from \
    the mean of ±0.15 s (interquartile range of the surrounding 60 s)";

/// Settings of the EEG analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The names of the channels, in order: sites of the 10–20 system (`F3`, `AF7`, `Fz`, also as in `EEG
    /// Fz-Ref`) select where asymmetry, workload and blinks are measured. A channel with an empty name has no
    /// values of its own.
    pub channels: Vec<String>,
    /// Segments with a higher root mean square between 1 and 45 Hz are rejected as artefacts [µV]; default
    /// 500. A common laboratory limit of ±100 µV corresponds to about 40.
    pub most_rms_uv: f64,
    /// Whether segments with a blink are rejected as well.
    pub blinks: Blinks,
    /// The channels in which blinks are detected; by default those above the eyes.
    pub blink_channels: Vec<String>,
}

/// The treatment of segments with a blink.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub enum Blinks {
    /// Segments with a blink are used: people blink every four seconds, and only slow bands of frontal channels suffer.
    #[default]
    Kept,
    /// Segments with a blink are rejected in all channels, and missing from the coverage.
    LeftOut,
}

impl Default for Settings {
    /// One channel without a name.
    fn default() -> Settings {
        Settings {
            channels: vec![String::new()],
            most_rms_uv: 500.0,
            blinks: Blinks::Kept,
            blink_channels: Vec::new(),
        }
    }
}

/// A causal analysis of an EEG [µV] at 100 to 5000 Hz.
///
/// Blinks are reported up to half a second late, so a window queried right at its end may lack the last one.
/// Channels without a name in the settings are ignored. Returns an error for another rate, no channel or more
/// than 256, or an invalid limit.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    let examiner = Examiner::new(rate_hz)?;
    let known = Known::new(settings, rate_hz, &examiner, CAUSAL_BLINKS)?;
    let length = examiner.length();
    let detector = BlinkDetector::new(rate_hz)?;
    let blinks = (Frontal::new(&known.blink_channels), detector);
    Ok(Box::new(Running {
        pending: vec![Vec::with_capacity(length); known.channels],
        pending_ns: Vec::with_capacity(length),
        blinks: Some(blinks).filter(|_| !known.blink_channels.is_empty()),
        times: Track::new(rate_hz),
        events: VecDeque::new(),
        examiner,
        known,
    }))
}

/// An analysis of a whole EEG [µV].
///
/// Channels without a name in the settings are ignored. Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut examiner = Examiner::new(recording.rate_hz)?;
    let mut known = Known::new(settings, recording.rate_hz, &examiner, WHOLE_BLINKS)?;
    let length = examiner.length();
    let none = [];
    let samples = recording.len();
    let channel = |index: usize| recording.channels.get(index).map_or(&none[..], |c| &c[..samples]);
    let missing = vec![f64::NAN; length];
    for begin in (0..).step_by(examiner.step()).take_while(|begin| begin + length <= samples) {
        let last = recording.time_ns((begin + length - 1) as f64);
        known.pieces.begin(recording.time_ns(begin as f64), last);
        for index in 0..known.channels {
            let segment = channel(index).get(begin..begin + length).unwrap_or(&missing);
            let quality = examiner.examine(segment);
            known.pieces.add(quality, examiner.power());
        }
    }
    let mut frontal = Frontal::new(&known.blink_channels);
    let value = |index: usize, sample: usize| channel(index).get(sample).copied();
    let mixed = (0..samples).map(|k| frontal.mix(|index| value(index, k).unwrap_or(f64::NAN)));
    // A recording without a usable sample, or with too few, has no blinks.
    let blinks = find_blinks(&mixed.collect::<Vec<f64>>(), recording.rate_hz).unwrap_or_default();
    let event = |blink: super::Blink| known.keep(recording.time_ns(blink.sample), blink);
    Ok(Whole { events: blinks.into_iter().map(event).collect(), windows: Box::new(known) })
}

struct Running {
    known: Known,
    examiner: Examiner,
    /// The samples of the incomplete segment, by channel.
    pending: Vec<Vec<f64>>,
    pending_ns: Vec<i64>,
    blinks: Option<(Frontal, BlinkDetector)>,
    times: Track,
    events: VecDeque<Event>,
}

impl Running {
    fn end_segment(&mut self) {
        let step = self.examiner.step();
        if let [begin_ns, .., end_ns] = self.pending_ns[..] {
            self.known.pieces.begin(begin_ns, end_ns);
        }
        for samples in &mut self.pending {
            let quality = self.examiner.examine(samples);
            self.known.pieces.add(quality, self.examiner.power());
            samples.drain(..step);
        }
        self.pending_ns.drain(..step);
    }
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        self.known.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.known.measure(span)
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let value = |index: usize| channels.get(index).copied().unwrap_or(f64::NAN);
        self.pending_ns.push(at_ns);
        self.pending.iter_mut().enumerate().for_each(|(index, kept)| kept.push(value(index)));
        if self.pending_ns.len() == self.examiner.length() {
            self.end_segment();
        }
        let Some((frontal, detector)) = &mut self.blinks else { return };
        let mixed = frontal.mix(value);
        self.times.push(at_ns, mixed);
        self.times.forget(at_ns.saturating_sub((LATE_SECS * 1e9) as i64));
        if let Some(blink) = detector.push(mixed) {
            let at_ns = self.times.time_ns(blink.sample).unwrap_or(at_ns);
            self.events.push_back(self.known.keep(at_ns, blink));
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.known.forget(before_ns);
    }
}
