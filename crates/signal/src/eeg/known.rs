//! What is kept of an analysed EEG: its segments and blinks.

use std::collections::VecDeque;

use super::analysis::{Blinks, Settings};
use super::blinks::Blink;
use super::examiner::Examiner;
use super::pieces::{Pieces, Reading, mean};
use super::quality::LEAST_QUALITY;
use super::quantities::{Quantity, of_pair, quantities};
use super::site::{blink_channels, site};
use crate::analysis::{Event, Measured, Reason, Span, Value, Windows};
use crate::error::{SignalError, checked};

/// The largest number of channels.
const MOST_CHANNELS: f64 = 256.0;
/// Nobody blinks more often over a window: in conversation 26 times (Bentivoglio et al. 1997,
/// doi:10.1002/mds.870120629); fluttering lids and swinging electrodes are faster.
const MOST_BLINKS_PER_MIN: f64 = 100.0;
/// The supported range of the amplitude limit [µV].
const LIMITS_UV: (f64, f64) = (1.0, 1e6);

/// The store, which can be queried for any span.
pub(super) struct Known {
    pub(super) pieces: Pieces,
    pub(super) channels: usize,
    /// The channels in which blinks are detected.
    pub(super) blink_channels: Vec<usize>,
    blinks: VecDeque<(i64, Blink)>,
    leave_out: Blinks,
    quantities: Vec<Quantity>,
    values: Vec<Value>,
}

impl Known {
    pub(super) fn new(
        settings: &Settings,
        rate_hz: f64,
        examiner: &Examiner,
        blinks: &str,
    ) -> Result<Known, SignalError> {
        let channels = settings.channels.len();
        checked("number of channels", channels as f64, (1.0, MOST_CHANNELS))?;
        let most_rms_uv = checked("most_rms_uv", settings.most_rms_uv, LIMITS_UV)?;
        let without = match settings.blinks {
            Blinks::Kept => "",
            Blinks::LeftOut => " or with a blink",
        };
        let welch = format!(
            "Welch over the segments of 4 s inside the window, 50 % overlap, Hann, mean removed, \
             unfiltered; without those with a quality below 0.1, with more than {most_rms_uv} µV rms (1–45 Hz)\
             {without}"
        );
        let (quantities, values) =
            quantities(&settings.channels, &welch, blinks).into_iter().unzip();
        Ok(Known {
            pieces: Pieces::new(examiner, rate_hz, channels, most_rms_uv),
            channels,
            blink_channels: chosen(settings),
            blinks: VecDeque::new(),
            leave_out: settings.blinks,
            quantities,
            values,
        })
    }

    /// Stores a blink at a time [ns], and returns its event.
    pub(super) fn keep(&mut self, at_ns: i64, blink: Blink) -> Event {
        self.blinks.push_back((at_ns, blink));
        let details =
            vec![("amplitude_uv", blink.amplitude_uv), ("duration_secs", blink.duration_secs)];
        Event { kind: "blink", sample: blink.sample, at_ns, details }
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        self.pieces.forget(before_ns);
        while self.blinks.front().is_some_and(|(at_ns, _)| *at_ns < before_ns) {
            self.blinks.pop_front();
        }
    }

    /// Whether a segment is rejected because of a blink.
    fn is_left_out(&self, (begin_ns, end_ns): (i64, i64)) -> bool {
        let touches = |(at_ns, blink): &(i64, Blink)| {
            let around_ns = (blink.duration_secs * 1e9) as i64;
            at_ns.saturating_add(around_ns) >= begin_ns && at_ns.saturating_sub(around_ns) <= end_ns
        };
        self.leave_out == Blinks::LeftOut && self.blinks.iter().any(touches)
    }

    fn blink(&self, quantity: Quantity, span: Span, readings: &[Reading]) -> Result<f64, Reason> {
        let above = self.blink_channels.iter().map(|&channel| &readings[channel]);
        let best = above.max_by(|a, b| a.present.total_cmp(&b.present)).ok_or(Reason::Missing)?;
        if best.present < crate::analysis::LEAST_COVERAGE {
            return Err(best.spectrum.as_ref().err().copied().unwrap_or(Reason::Gap));
        }
        if best.segments_quality < LEAST_QUALITY {
            return Err(Reason::Quality);
        }
        let inside = self.blinks.iter().filter(|(at_ns, _)| span.holds(*at_ns));
        let inside: Vec<&Blink> = inside.map(|(_, blink)| blink).collect();
        let count = inside.len() as f64;
        let rate_per_min = count / (span.secs() * best.present) * 60.0;
        if rate_per_min > MOST_BLINKS_PER_MIN {
            return Err(Reason::Quality);
        }
        let sum = match quantity {
            Quantity::BlinkRate => return Reason::unless_finite(rate_per_min),
            Quantity::BlinkAmplitude => inside.iter().map(|blink| blink.amplitude_uv).sum::<f64>(),
            _ => inside.iter().map(|blink| blink.duration_secs).sum::<f64>(),
        };
        if inside.is_empty() { Err(Reason::Short) } else { Reason::unless_finite(sum / count) }
    }
}

impl Windows for Known {
    fn values(&self) -> &[Value] {
        &self.values
    }

    fn measure(&self, span: Span) -> Measured {
        let read =
            |channel| self.pieces.read(channel, span, &|times_ns| self.is_left_out(times_ns));
        let readings: Vec<Reading> = (0..self.channels).map(read).collect();
        let average = mean(&readings);
        let of_average = average.as_ref().map_err(|&reason| reason);
        let value_of = |&quantity: &Quantity| match quantity {
            Quantity::Average(shape) => of_average.and_then(|spectrum| shape.of(spectrum)),
            Quantity::Channel(channel, shape) => readings[channel]
                .spectrum
                .as_ref()
                .map_err(|&reason| reason)
                .and_then(|s| shape.of(s)),
            Quantity::Quality(channel) => quality(&readings[channel]),
            Quantity::Workload(_) | Quantity::Asymmetry(_) => of_pair(quantity, &readings),
            _ => self.blink(quantity, span, &readings),
        };
        Measured {
            coverage: readings.iter().map(|reading| reading.coverage).fold(0.0, f64::max),
            quality: readings.iter().map(|reading| reading.quality).sum::<f64>()
                / readings.len() as f64,
            values: self.quantities.iter().map(value_of).collect(),
        }
    }
}

fn quality(reading: &Reading) -> Result<f64, Reason> {
    match &reading.spectrum {
        Err(reason @ (Reason::Short | Reason::Gap)) => Err(*reason),
        _ => Ok(reading.quality),
    }
}

/// The configured blink channels, or those above the eyes.
fn chosen(settings: &Settings) -> Vec<usize> {
    if settings.blink_channels.is_empty() {
        return blink_channels(&settings.channels);
    }
    let is_named = |index: &usize| {
        let name = &settings.channels[*index];
        settings.blink_channels.iter().any(|each| each == name || site(each) == site(name))
    };
    (0..settings.channels.len()).filter(is_named).collect()
}
