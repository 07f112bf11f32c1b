//! The store of an analysed skin conductance, and the values of its spans.

use std::collections::VecDeque;
use std::ops::Range;

use super::noise::clarity;
use super::quality::{SPREAD_SECS, firmness, valid_samples};
use super::shape::{LEAST_RISE_SECS, NEAR_SECS, is_symmetric};
use super::step::{is_step, rise};
use super::sympathetic::{SEGMENT_SECS, SlowDown, of_slow};
use super::values::COUNT;
use super::{Response, Threshold};
use crate::analysis::{
    Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Windows,
};
use crate::error::SignalError;
use crate::gaps::is_usable;

/// The lowest quality for which values are reported.
const LEAST_QUALITY: f64 = 0.5;
/// The highest rate of responses that is certainly possible, and the lowest that is certainly not [1/min].
const PLAUSIBLE_PER_MIN: (f64, f64) = (25.0, 45.0);
/// The share of responses with a shape that sweat glands do not produce: up to the lower limit, overlapping responses
/// have such a shape by chance; from the higher limit on, most are motion, breathing or lifted electrodes.
const SYMMETRIC: (f64, f64) = (0.25, 0.75);
/// The shortest span that has a slope or a rate [s].
const LEAST_SECS: f64 = 10.0;

/// A response with its times [ns].
pub(super) struct Placed {
    response: Response,
    peak_ns: i64,
    /// The time of half recovery [ns].
    recovered_ns: Option<i64>,
}

/// The samples, raw and split, with their responses.
pub(super) struct Store {
    values: Vec<Value>,
    threshold: Threshold,
    /// The raw signal, with gaps.
    pub(super) raw: Track,
    /// The skin temperature [°C] at the samples of `raw`, or empty.
    pub(super) temperature: VecDeque<f64>,
    pub(super) tonic: Track,
    /// The phasic part at the samples of `tonic`.
    pub(super) phasic: VecDeque<f64>,
    /// The signal at 2 Hz for the sympathetic band.
    pub(super) slow: Track,
    slow_down: SlowDown,
    pub(super) responses: VecDeque<Placed>,
}

impl Placed {
    /// Converts a response detected at a signal decimated by `every`; `at_ns` is the time of an original
    /// sample.
    pub(super) fn new(response: &Response, every: f64, at_ns: impl Fn(f64) -> i64) -> Placed {
        let (onset, peak) = (response.onset * every, response.peak * every);
        let peak_ns = at_ns(peak);
        let after_ns = |secs: f64| peak_ns.saturating_add((secs * 1e9) as i64);
        let recovered_ns = response.half_recovery_secs.map(after_ns);
        Placed { response: Response { onset, peak, ..*response }, peak_ns, recovered_ns }
    }

    pub(super) fn touches(&self, samples: &Range<f64>) -> bool {
        self.response.onset < samples.end && self.response.peak > samples.start
    }

    /// Whether the response is a step of the contact.
    pub(super) fn is_step(&self, signal: &[f64], rate_hz: f64) -> bool {
        let rise = rise(&self.response, rate_hz);
        let begin = rise.start.min(signal.len());
        is_step(
            &signal[begin..rise.end.clamp(begin, signal.len())],
            rate_hz,
            self.response.amplitude_us,
        )
    }

    /// Sets the time of half recovery of the newest response.
    pub(super) fn recover(&mut self, at_ns: i64) {
        self.recovered_ns = Some(at_ns);
        let secs = at_ns.saturating_sub(self.peak_ns) as f64 / 1e9;
        self.response.half_recovery_secs = Some(secs);
    }

    pub(super) fn event(&self) -> Event {
        let Response { onset, peak, amplitude_us, rise_secs, half_recovery_secs } = self.response;
        let details = vec![
            ("amplitude_us", amplitude_us),
            ("rise_secs", rise_secs),
            ("half_recovery_secs", half_recovery_secs.unwrap_or(f64::NAN)),
            ("onset_sample", onset),
        ];
        Event { kind: "response", sample: peak, at_ns: self.peak_ns, details }
    }
}

impl Store {
    /// An empty store for a signal at `rate_hz`.
    pub(super) fn new(
        rate_hz: f64,
        threshold: Threshold,
        values: Vec<Value>,
    ) -> Result<Store, SignalError> {
        let slow_down = SlowDown::new(rate_hz)?;
        Ok(Store {
            values,
            threshold,
            raw: Track::new(rate_hz),
            temperature: VecDeque::new(),
            tonic: Track::new(rate_hz),
            phasic: VecDeque::new(),
            slow: Track::new(slow_down.rate_hz()),
            slow_down,
            responses: VecDeque::new(),
        })
    }

    pub(super) fn take_recording(&mut self, recording: &Recording<'_>, clean: &[f64]) {
        let count = recording.len();
        let temperature = recording.channels.get(1).map(|celsius| celsius[..count].to_vec());
        self.temperature = temperature.unwrap_or_default().into();
        self.raw = Track::of(recording, recording.channels[0][..count].to_vec());
        for (sample, &value) in clean.iter().enumerate() {
            if let Some(slow) = self.slow_down.push(value) {
                self.slow.push(recording.time_ns(sample as f64), slow);
            }
        }
    }

    /// The clean signal [µS] of samples, as far as they are held.
    pub(super) fn clean(&self, samples: Range<usize>) -> Vec<f64> {
        let first = self.tonic.held().start;
        let phasic = self.phasic.iter().skip(samples.start.saturating_sub(first));
        self.tonic.iter(samples).zip(phasic).map(|(tonic, phasic)| tonic + phasic).collect()
    }

    /// Takes in a clean sample for the sympathetic band.
    pub(super) fn push_slow(&mut self, at_ns: i64, clean: f64) {
        if let Some(slow) = self.slow_down.push(clean) {
            self.slow.push(at_ns, slow);
        }
    }

    /// Restarts at another level, without a transient.
    pub(super) fn settle(&mut self, level: f64) {
        self.slow_down.settle(level);
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        let quality_ns = before_ns.saturating_sub((SPREAD_SECS * 1e9) as i64);
        let [raw, tonic] = [self.raw.held().start, self.tonic.held().start];
        self.raw.forget(quality_ns);
        self.tonic.forget(before_ns);
        self.slow.forget(before_ns);
        let raw = self.raw.held().start - raw;
        self.temperature.drain(..raw.min(self.temperature.len()));
        self.phasic.drain(..self.tonic.held().start - tonic);
        while self.responses.front().is_some_and(|response| response.peak_ns < before_ns) {
            self.responses.pop_front();
        }
    }

    /// How certain it is that electrodes touch the skin [0..1].
    fn contact(&self, span: Span) -> f64 {
        let samples = self.raw.samples_in(span.with_before(SPREAD_SECS));
        let inside = self.raw.samples_in(span).len();
        let first = self.raw.held().start;
        let temperature: Vec<f64> = match self.temperature.len() {
            0 => Vec::new(),
            _ => self
                .temperature
                .range(samples.start - first..samples.end - first)
                .copied()
                .collect(),
        };
        let signal = self.raw.values(samples);
        let valid = valid_samples(&signal, &temperature, self.raw.rate_hz());
        let firmness = firmness(&signal[signal.len() - inside..]);
        // Missing data count once, as coverage.
        let there = self.raw.usable_in(span);
        let valid = valid[valid.len() - inside..].iter().filter(|&&each| each).count();
        if there > 0 { firmness * (valid as f64 / there as f64).min(1.0) } else { 0.0 }
    }

    fn clarity(&self, span: Span) -> f64 {
        clarity(&self.raw.values_in(span), self.raw.rate_hz(), self.threshold)
    }

    /// How plausible it is that this many responses come from sweat glands, not from steps or tremor [0..1].
    fn plausibility(&self, span: Span) -> f64 {
        let begin = self.responses.partition_point(|placed| placed.peak_ns < span.begin_ns);
        let end = self.responses.partition_point(|placed| placed.peak_ns < span.end_ns);
        let per_min = end.saturating_sub(begin) as f64 / span.secs().max(LEAST_SECS) * 60.0;
        let (most, none) = PLAUSIBLE_PER_MIN;
        ((none - per_min) / (none - most)).clamp(0.0, 1.0)
    }

    /// How plausible the shapes of the responses are for sweat glands [0..1].
    fn naturalness(&self, span: Span) -> f64 {
        let begin = self.responses.partition_point(|placed| placed.peak_ns < span.begin_ns);
        let inside = self.responses.range(begin..).take_while(|p| p.peak_ns < span.end_ns);
        let (mut symmetric, mut judged) = (0.0, 0.0);
        for is_symmetric in inside.filter_map(|placed| self.is_symmetric(placed, span)) {
            (symmetric, judged) = (symmetric + f64::from(is_symmetric), judged + 1.0);
        }
        let (few, most) = SYMMETRIC;
        if judged > 0.0 {
            ((most - symmetric / judged) / (most - few)).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }

    /// Whether a response has a [shape](is_symmetric) that sweat glands do not produce; `None` if the span lacks some
    /// of the samples around it.
    fn is_symmetric(&self, placed: &Placed, span: Span) -> Option<bool> {
        let rise_secs = placed.response.rise_secs.max(LEAST_RISE_SECS);
        let at_ns = |secs: f64| placed.peak_ns.saturating_add((secs * 1e9) as i64);
        let begin_ns = at_ns(-2.0 * (rise_secs + NEAR_SECS));
        let end_ns = at_ns(rise_secs + 2.0 * NEAR_SECS);
        if begin_ns < span.begin_ns || end_ns > span.end_ns {
            return None;
        }
        let samples = self.tonic.samples_in(Span { begin_ns, end_ns });
        let before = self.tonic.samples_in(Span { begin_ns, end_ns: placed.peak_ns });
        let rate_hz = self.tonic.rate_hz();
        let [rise, near] = [rise_secs, NEAR_SECS].map(|secs| (secs * rate_hz).round() as usize);
        is_symmetric(&self.clean(samples), before.len(), rise, near)
    }

    fn level(&self, span: Span) -> [Result<f64, Reason>; 3] {
        let samples = self.tonic.samples_in(span);
        let values = || self.tonic.iter(samples.clone()).enumerate().filter(|(_, v)| is_usable(*v));
        let (mut count, mut sum, mut places) = (0.0, 0.0, 0.0);
        values().for_each(|(place, value)| {
            (count, sum, places) = (count + 1.0, sum + value, places + place as f64);
        });
        let (mean, middle) = (sum / count, places / count);
        let (mut squares, mut products, mut spread) = (0.0, 0.0, 0.0);
        values().for_each(|(place, value)| {
            let (off, at) = (value - mean, place as f64 - middle);
            (squares, products, spread) =
                (squares + off * off, products + off * at, spread + at * at);
        });
        let slope = products / spread * self.tonic.rate_hz() * 60.0;
        let is_long = span.secs() >= LEAST_SECS;
        let slope = if is_long { Reason::unless_finite(slope) } else { Err(Reason::Short) };
        [Reason::unless_finite(mean), Reason::unless_finite((squares / count).sqrt()), slope]
    }

    fn responses(&self, span: Span) -> [Result<f64, Reason>; 6] {
        let begin = self.responses.partition_point(|placed| placed.peak_ns < span.begin_ns);
        let inside = || self.responses.range(begin..).take_while(|p| p.peak_ns < span.end_ns);
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (count, sum) =
                values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
            if count > 0.0 { Reason::unless_finite(sum / count) } else { Err(Reason::Nothing) }
        };
        let count = inside().count() as f64;
        let rate = if span.secs() < LEAST_SECS {
            Err(Reason::Short)
        } else {
            Ok(count / span.secs() * 60.0)
        };
        let amplitudes = || inside().map(|placed| placed.response.amplitude_us);
        let is_recovered =
            |placed: &&Placed| placed.recovered_ns.is_some_and(|at| at < span.end_ns);
        let recovered = inside().filter(is_recovered);
        [
            Ok(count),
            rate,
            mean(&mut amplitudes()),
            Reason::unless_finite(amplitudes().sum()),
            mean(&mut inside().map(|placed| placed.response.rise_secs)),
            mean(&mut recovered.filter_map(|placed| placed.response.half_recovery_secs)),
        ]
    }

    fn area(&self, span: Span) -> Result<f64, Reason> {
        let (samples, first) = (self.tonic.samples_in(span), self.tonic.held().start);
        let phasic = self.phasic.range(samples.start - first..samples.end - first);
        let above: f64 = phasic.filter(|v| is_usable(**v)).map(|v| v.max(0.0)).sum();
        Reason::unless_finite(above / self.tonic.rate_hz())
    }

    fn rhythm(&self, span: Span) -> [Result<f64, Reason>; 2] {
        let samples = self.slow.samples_in(span);
        if span.secs() < SEGMENT_SECS || samples.is_empty() {
            return [Err(Reason::Short); 2];
        }
        match of_slow(&self.slow.values(samples), self.slow.rate_hz()) {
            Ok(found) => {
                [Reason::unless_finite(found.power_us2), Reason::unless_finite(found.share)]
            }
            Err(SignalError::TooShort { .. }) => [Err(Reason::Short); 2],
            Err(SignalError::NothingFinite) => [Err(Reason::Gap); 2],
            Err(_) => [Err(Reason::Undefined); 2],
        }
    }
}

impl Windows for Store {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        let coverage = self.raw.coverage(span);
        let contact = self.contact(span);
        let quality =
            contact * self.clarity(span) * self.plausibility(span) * self.naturalness(span);
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, quality, COUNT, Reason::Gap);
        }
        if contact < LEAST_QUALITY {
            return Measured::nothing(coverage, quality, COUNT, Reason::Quality);
        }
        let mut values = self.level(span).to_vec();
        if quality < LEAST_QUALITY {
            // Noise and motion do not affect the level.
            values.resize(COUNT, Err(Reason::Quality));
        } else {
            values.extend(self.responses(span));
            values.push(self.area(span));
            values.extend(self.rhythm(span));
        }
        Measured { coverage, quality, values }
    }
}
