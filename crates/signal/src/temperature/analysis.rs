//! The values of windows of skin temperature.
//!
//! There are no events. Causal and whole analysis agree, as nothing is filtered. All values except the share off the
//! body use readings on the body; quality is the share of these among all usable readings, halved if none is as warm as
//! 28 °C, since they may then be those of a room. Cold hands are rarer than thermometers that were never put on; the
//! values are still reported, for readers who know which it was.

use super::on_body::{Limits, OnBody};
use crate::analysis::{
    Causal, Event, LEAST_COVERAGE, Measured, Reason, Recording, Span, Track, Value, Whole, Windows,
};
use crate::descriptive::describe;
use crate::error::{SignalError, checked, checked_rate_hz};
use crate::trend::{smallest_step, trend};

/// The slowest and fastest supported rates [Hz].
const RATES_HZ: (f64, f64) = (0.001, 1000.0);
/// The smallest share of readings on the body for which values are reported.
const LEAST_QUALITY: f64 = 0.5;
/// Below this temperature a room is as likely as skin [°C], and this share of the quality is left.
const WARM_C: f64 = 28.0;
const OF_COOL: f64 = 0.5;
/// The shortest trend [s].
const LEAST_TREND_SECS: f64 = 10.0;

/// The place of the highest reading among the values.
const GREATEST: usize = 3;

static VALUES: [Value; 6] = [
    Value::new("TEMP_Mean", "°C", "mean of readings on the body"),
    Value::new("TEMP_SD", "°C", "standard deviation over n − 1 of readings on the body"),
    Value::new("TEMP_Min", "°C", "lowest reading on the body"),
    Value::new("TEMP_Max", "°C", "highest reading on the body"),
    Value::new(
        "TEMP_Slope",
        "°C/min",
        "Theil–Sen line through readings on the body; where they come in coarse steps, through the moments of change",
    ),
    Value::new(
        "TEMP_OffBody",
        "1",
        "share of readings that are too cold or warm for skin, within 5 s of a jump, or after a fall by 0.5 °C in 10 s until half of it is made up or it ends above 30 °C",
    ),
];

/// Settings of the analysis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// The plausible range of skin temperature.
    pub limits: Limits,
}

/// A causal analysis of readings [°C] at 0.001 to 1000 Hz; only the first channel is read.
///
/// No sample allocates in steady state. Returns an error for another rate or invalid limits.
pub fn causal(settings: &Settings, rate_hz: f64) -> Result<Box<dyn Causal + Send>, SignalError> {
    Ok(Box::new(Running::new(settings, rate_hz)?))
}

/// An analysis of a whole recording. Errors as for [`causal`].
pub fn whole(settings: &Settings, recording: &Recording<'_>) -> Result<Whole, SignalError> {
    let mut running = Running::new(settings, recording.rate_hz)?;
    let readings_c = recording.channels.first().map_or(&[][..], Vec::as_slice);
    for (sample, &reading_c) in readings_c.iter().enumerate() {
        running.push(recording.time_ns(sample as f64), &[reading_c]);
    }
    Ok(Whole { events: Vec::new(), windows: Box::new(running) })
}

struct Running {
    on_body: OnBody,
    readings: Track,
    /// The readings on the body; NaN off it.
    skin: Track,
}

impl Running {
    fn new(settings: &Settings, rate_hz: f64) -> Result<Running, SignalError> {
        let rate_hz = checked("the sampling rate [Hz]", checked_rate_hz(rate_hz)?, RATES_HZ)?;
        let on_body = OnBody::new(settings.limits)?;
        Ok(Running { on_body, readings: Track::new(rate_hz), skin: Track::new(rate_hz) })
    }

    fn of_skin(&self, span: Span) -> [Result<f64, Reason>; 5] {
        let samples = self.skin.samples_in(span);
        let since = |at_ns: i64| at_ns.saturating_sub(span.begin_ns) as f64 / 60e9;
        let minutes = |sample: usize| self.skin.time_ns(sample as f64).map_or(f64::NAN, since);
        let minutes: Vec<f64> = samples.clone().map(minutes).collect();
        let skin = self.skin.values(samples);
        let Some(summary) = describe(&minutes, &skin) else { return [Err(Reason::Quality); 5] };
        [
            Reason::unless_finite(summary.mean),
            summary.sd.ok_or(Reason::Short),
            Ok(summary.least),
            Ok(summary.greatest),
            slope_per_min(&minutes, &skin),
        ]
    }
}

fn slope_per_min(minutes: &[f64], skin_c: &[f64]) -> Result<f64, Reason> {
    let known = || minutes.iter().zip(skin_c).filter(|(_, reading)| reading.is_finite());
    let (first, last) = (known().next(), known().next_back());
    let length = first.zip(last).map_or(0.0, |(first, last)| last.0 - first.0);
    if length * 60.0 < 0.9 * LEAST_TREND_SECS {
        return Err(Reason::Short);
    }
    let line = trend(minutes, skin_c, smallest_step(skin_c).unwrap_or(0.0));
    Reason::unless_finite(line.ok_or(Reason::Undefined)?.slope.value)
}

impl Windows for Running {
    fn values(&self) -> &[Value] {
        &VALUES
    }

    fn measure(&self, span: Span) -> Measured {
        let coverage = self.readings.coverage(span);
        let usable = self.readings.usable_in(span) as f64;
        let worn = self.skin.usable_in(span) as f64;
        let quality = if usable > 0.0 { worn / usable } else { 0.0 };
        if coverage < LEAST_COVERAGE {
            return Measured::nothing(coverage, quality, VALUES.len(), Reason::Gap);
        }
        let poor = [Err(Reason::Quality); 5];
        let of_skin = if quality < LEAST_QUALITY { poor } else { self.of_skin(span) };
        let values = of_skin.into_iter().chain([Ok(1.0 - quality)]).collect();
        let is_warm = of_skin[GREATEST].is_ok_and(|greatest_c| greatest_c >= WARM_C);
        let certainty = if is_warm { 1.0 } else { OF_COOL };
        Measured { coverage, quality: quality * certainty, values }
    }
}

impl Causal for Running {
    fn push(&mut self, at_ns: i64, channels: &[f64]) {
        let reading_c = channels.first().copied().unwrap_or(f64::NAN);
        let is_worn = self.on_body.push(at_ns, reading_c);
        self.readings.push(at_ns, reading_c);
        self.skin.push(at_ns, if is_worn { reading_c } else { f64::NAN });
    }

    fn next_event(&mut self) -> Option<Event> {
        None
    }

    fn forget(&mut self, before_ns: i64) {
        self.readings.forget(before_ns);
        self.skin.forget(before_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quality and the mean of a minute at this temperature.
    fn measured(celsius: f64) -> (f64, Result<f64, Reason>) {
        let channels = [(0..240).map(|k| celsius + 0.01 * f64::from(k % 3)).collect::<Vec<f64>>()];
        let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
        let whole = whole(&Settings::default(), &recording).unwrap();
        let measured = whole.windows.measure(recording.span());
        (measured.quality, measured.values[0])
    }

    #[test]
    fn a_thermometer_as_cool_as_a_room_is_not_trusted() {
        let (quality, mean) = measured(24.0);
        assert!(quality < 0.6 && mean.is_ok_and(|mean| (mean - 24.01).abs() < 0.01));
        assert!(measured(33.0).0 > 0.99);
        assert!(measured(15.0).0 < 0.01);
    }
}
