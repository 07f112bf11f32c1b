//! The ECG behind the common analysis interface: beats as events; heart rate, its variability
//! ([`HeartWindows`]), breathing and signal quality for any span.
//!
//! Only the first channel is read. A span queried right after its end lacks the beats of the last 250 ms or
//! so; those [found later](super::Found::Later) are reported up to two cycles late.

use std::collections::VecDeque;

use super::beat::{Beat, Found};
use super::causal::BeatDetector;
use super::clean::{clean, cleaning};
use super::history::History;
use super::likeness::Likeness;
use super::mains::{Cleaner, mains_hz};
use super::pieces::Pieces;
use super::steepness::Steepness;
use super::whole::find_beats;
use super::windows::{EcgWindows, HIDING_SECS, WindowBeat};
use crate::analysis::{Causal, Event, Measured, Recording, Span, Value, Whole, Windows};
use crate::error::SignalError;
use crate::gaps::is_usable;
use crate::hrv::{Domain, HeartWindows};
use crate::intervals::Edit;

/// A beat is reported within this time [s]; samples are kept for as long.
const KEPT_SECS: f64 = 10.0;

/// The time after a beat at which its T wave has ended and the next P wave has not begun [s].
const AFTER_SECS: f64 = 0.42;
const BEFORE_SECS: f64 = 0.26;

/// Settings of the ECG analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The mains frequency removed by the notch [Hz], 50 or 60; if unset, the frequency detected in the signal, or 50
    /// Hz if none is detected.
    pub mains_hz: Option<f64>,
    /// The domains of heart rate variability to compute; all by default.
    pub domains: Vec<Domain>,
    /// Manual edits of single beats, in seconds since the first sample; whole recordings only.
    pub edits: Vec<Edit>,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { mains_hz: None, domains: Domain::ALL.to_vec(), edits: Vec::new() }
    }
}

/// A causal analysis of an ECG at `rate_hz`, 80 to 4000 Hz.
///
/// Returns an error for another rate or invalid settings.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    let heart = HeartWindows::causal().only(&settings.domains);
    let kept = (KEPT_SECS * rate_hz).clamp(0.0, 1e5) as usize;
    Ok(Box::new(CausalEcg {
        detector: BeatDetector::new(rate_hz)?,
        cleaner: Cleaner::new(rate_hz, settings.mains_hz)?,
        clean: History::new(kept),
        pieces: Pieces::new(rate_hz),
        reporter: BeatReporter::new(rate_hz),
        gaps: Gaps::new(rate_hz),
        windows: EcgWindows::new(rate_hz, "as they came in", heart),
        events: VecDeque::new(),
    }))
}

/// An analysis of a whole ECG at 80 to 4000 Hz.
///
/// Returns an error for another rate or invalid settings. A recording without a usable sample has no beats.
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let Recording { rate_hz, channels, .. } = *recording;
    let signal = channels.first().map_or(&[][..], |channel| &channel[..recording.len()]);
    let found = find_beats(signal, rate_hz)?;
    let mains_hz = settings.mains_hz.unwrap_or_else(|| mains_hz(signal, rate_hz));
    cleaning(rate_hz, mains_hz)?;
    // A signal too short or empty to filter has no beats.
    let clean = clean(signal, rate_hz, mains_hz).unwrap_or_default();
    let beats_ns: Vec<i64> = found.iter().map(|beat| recording.time_ns(beat.sample)).collect();
    let gaps = gaps(recording, signal);
    let heart = HeartWindows::whole(recording.begin_ns, &beats_ns, &gaps, &settings.edits);
    let heart = heart.only(&settings.domains);
    let mut windows = EcgWindows::new(rate_hz, "in the whole recording", heart);
    let mut pieces = Pieces::new(rate_hz);
    for (index, &sample) in signal.iter().enumerate() {
        let at_ns = recording.time_ns(index as f64);
        windows.track.push(at_ns, sample);
        let piece = pieces.push(at_ns, sample, clean.get(index).copied().unwrap_or(0.0));
        windows.pieces.extend(piece);
    }
    let mut reporter = BeatReporter::new(rate_hz);
    let events = found.iter().map(|beat| reporter.report(beat, &clean, 0, &mut windows)).collect();
    Ok(Whole { events, windows: Box::new(windows) })
}

fn gaps(recording: &Recording<'_>, signal: &[f64]) -> Vec<(i64, i64)> {
    let mut gaps = Gaps::new(recording.rate_hz);
    let timed = signal.iter().enumerate();
    timed
        .filter_map(|(index, &sample)| gaps.push(recording.time_ns(index as f64), sample))
        .collect()
}

/// Finds gaps that are long enough to hide a beat.
struct Gaps {
    hiding: usize,
    missing: usize,
    begin_ns: i64,
}

impl Gaps {
    fn new(rate_hz: f64) -> Gaps {
        Gaps { hiding: (HIDING_SECS * rate_hz) as usize, missing: 0, begin_ns: 0 }
    }

    /// Takes in a sample; returns the gap that ends with it [ns].
    fn push(&mut self, at_ns: i64, sample: f64) -> Option<(i64, i64)> {
        if !is_usable(sample) {
            self.begin_ns = if self.missing == 0 { at_ns } else { self.begin_ns };
            self.missing += 1;
            return None;
        }
        std::mem::take(&mut self.missing).gt(&self.hiding).then_some((self.begin_ns, at_ns))
    }
}

struct CausalEcg {
    detector: BeatDetector,
    cleaner: Cleaner,
    clean: History,
    pieces: Pieces,
    reporter: BeatReporter,
    gaps: Gaps,
    windows: EcgWindows,
    events: VecDeque<Event>,
}

impl Windows for CausalEcg {
    fn values(&self) -> &[Value] {
        self.windows.values()
    }

    fn measure(&self, span: Span) -> Measured {
        self.windows.measure(span)
    }

    fn measure_again(&self, span: Span, last: &Measured) -> Measured {
        self.windows.measure_again(span, last)
    }
}

impl Causal for CausalEcg {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let sample = channels.first().copied().unwrap_or(f64::NAN);
        let clean = self.cleaner.push(sample);
        let clean = if is_usable(clean) { clean } else { 0.0 };
        self.clean.push(clean);
        self.windows.track.push(at_ns, sample);
        if let Some(gap) = self.gaps.push(at_ns, sample) {
            self.windows.mark_gap(gap);
        }
        self.windows.pieces.extend(self.pieces.push(at_ns, sample, clean));
        if let Some(beat) = self.detector.push(sample) {
            let (all, count) = (self.clean.at(0..self.clean.count), self.clean.count);
            let begin = count - all.len() as i64;
            self.events.push_back(self.reporter.report(&beat, all, begin, &mut self.windows));
        }
    }

    fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn forget(&mut self, before_ns: i64) {
        self.windows.forget(before_ns, KEPT_SECS);
    }
}

/// Turns beats into events.
struct BeatReporter {
    rate_hz: f64,
    likeness: Likeness,
    before: Option<f64>,
}

impl BeatReporter {
    fn new(rate_hz: f64) -> BeatReporter {
        BeatReporter { rate_hz, likeness: Likeness::new(rate_hz), before: None }
    }

    /// The peak-to-peak range where neither beat has waves, if there is such a time.
    fn between(&self, clean: &[f64], before: f64, beat: f64) -> Option<f64> {
        let (begin, end) = (before + AFTER_SECS * self.rate_hz, beat - BEFORE_SECS * self.rate_hz);
        let samples = clean.get(begin.max(0.0) as usize..end.max(0.0) as usize)?;
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = samples.iter().fold(ends, |(low, high), &v| (v.min(low), v.max(high)));
        (high > low).then_some(high - low)
    }

    /// The event of a beat, which is also added to the windows; `clean` starts at sample `begin`.
    fn report(
        &mut self,
        beat: &Beat,
        clean: &[f64],
        begin: i64,
        windows: &mut EcgWindows,
    ) -> Event {
        let looks = self.likeness.push(clean, beat.sample - begin as f64);
        let rr_ms = self.before.and_then(|before| windows.interval_ms(before, beat.sample));
        let between = self.before.and_then(|before| {
            self.between(clean, before - begin as f64, beat.sample - begin as f64)
        });
        let echo = self.before.filter(|_| looks.is_some()).and_then(|before| {
            self.likeness.echo(clean, before - begin as f64, beat.sample - begin as f64)
        });
        let steepness = looks.and_then(|looks| {
            let before = self.before.map(|before| before - begin as f64);
            let at = (beat.sample - begin as f64, looks.height);
            Steepness::of(clean, self.rate_hz, before, at)
        });
        self.before = Some(beat.sample);
        let at_ns = windows.track.time_ns(beat.sample).unwrap_or_default();
        windows.push(WindowBeat { at_ns, rr_ms, looks, between, echo, steepness });
        let quality = looks.and_then(|looks| looks.likeness);
        let details = vec![
            ("rr_ms", rr_ms.unwrap_or(f64::NAN)),
            ("height", looks.map_or(f64::NAN, |looks| looks.deflection)),
            ("strength", beat.strength),
            ("upright", f64::from(u8::from(beat.upright))),
            ("found_later", f64::from(u8::from(beat.found == Found::Later))),
            ("quality", quality.unwrap_or(f64::NAN)),
        ];
        Event { kind: "beat", sample: beat.sample, at_ns, details }
    }
}
