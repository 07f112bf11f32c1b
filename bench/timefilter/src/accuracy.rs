//! Measures how well the clock models find true times, and how well they know their own uncertainty.
//!
//! Every figure is for one recording from its 60th second on; the worst recording counts. A row is a time of a grid of
//! 64 Hz. A cell is the straight line between the samples of one stream around that time, by their *true* times; the
//! difference between a cell's true time and the row's is its error. A row's error is the largest error of its cells,
//! its skew is their spread, and its stated uncertainty is the largest uncertainty of its cells.

use std::error::Error;

use teampulse_timefilter::clock::{
    ClockModel, Corrected, Latency, OneWay, OneWaySettings, Smoother, Stamps,
};

use crate::recording::{self, Arrived};

const WARM_UP_NANOS: i64 = 60_000_000_000;
const GRID_NANOS: usize = 1_000_000_000 / 64;

/// The streams of the scenarios `5` and `5b`.
const TRANSPORTS: [Transport; 5] = [BLUETOOTH, BLUETOOTH, BLUETOOTH, USB, WIFI];
const BLUETOOTH: Transport =
    Transport { name: "Bluetooth", bar_ms: 3.0, usual: Latency::BLUETOOTH };
const WIFI: Transport = Transport { name: "Wi-Fi", bar_ms: 0.3, usual: Latency::WIFI };
const USB: Transport = Transport { name: "USB", bar_ms: 0.05, usual: Latency::USB };

struct Transport {
    name: &'static str,
    /// The bar for the residuals of a stream [ms].
    bar_ms: f64,
    /// The latency in the table of devices.
    usual: Latency,
}

/// A sample with its time according to a model, before the latency is subtracted [ns].
#[derive(Clone, Copy)]
struct Timed {
    truth: i64,
    measured: i64,
    uncertainty: f64,
}

/// Measures the recordings of a scenario; returns whether every bar is met.
pub fn measure(arguments: &[String]) -> Result<bool, Box<dyn Error>> {
    let [scenario, paths @ ..] = arguments else { return Err("no scenario is named".into()) };
    let (mut causal, mut smoothed) = (Worst::default(), Worst::default());
    for path in paths {
        let samples = recording::read(path)?;
        let streams = TRANSPORTS.iter().enumerate().map(|(topic, _)| stream(&samples, topic));
        let streams: Vec<Vec<(Stamps, Vec<i64>)>> = streams.collect();
        causal.add(&streams.iter().map(|stream| live(stream)).collect::<Vec<_>>());
        smoothed.add(&streams.iter().map(|stream| afterwards(stream)).collect::<Vec<_>>());
    }
    let figures = causal.figures();
    for figure in &figures {
        let mark = if figure.passes() { "pass" } else { "FAIL" };
        let Figure { what, value, bar, unit } = figure;
        println!("{mark}  scenario {scenario}, {what}: {value:.3} {unit} (bar {bar} {unit})");
    }
    for Figure { what, value, unit, .. } in smoothed.figures() {
        println!("note  scenario {scenario}, with hindsight, {what}: {value:.3} {unit}");
    }
    Ok(figures.iter().all(Figure::passes))
}

/// Returns the batches of one stream, each with the true times of its samples.
fn stream(samples: &[Arrived], topic: usize) -> Vec<(Stamps, Vec<i64>)> {
    let samples: Vec<&Arrived> = samples.iter().filter(|sample| sample.topic == topic).collect();
    let mut batches = Vec::new();
    let mut at = 0;
    while at < samples.len() {
        let together = samples[at].count.saturating_sub(samples[at].place) as usize;
        let count = together.clamp(1, samples.len() - at);
        let batch = &samples[at..at + count];
        let span = (batch[count - 1].device - batch[0].device) as f64;
        let stamps = Stamps {
            device: Some(batch[0].device),
            index: at as u64,
            count: count as u32,
            period_nanos: span / (count.max(2) - 1) as f64,
            ..Stamps::arrived(batch[0].arrival)
        };
        batches.push((stamps, batch.iter().map(|sample| sample.measured).collect()));
        at += count;
    }
    batches
}

fn settings() -> OneWaySettings {
    OneWaySettings::new(Latency::new(0.0, 0.0))
}

fn live(stream: &[(Stamps, Vec<i64>)]) -> Vec<Timed> {
    timed(&mut OneWay::new(settings()), stream)
}

fn afterwards(stream: &[(Stamps, Vec<i64>)]) -> Vec<Timed> {
    let mut smoother = Smoother::new(settings());
    for (stamps, _) in stream {
        smoother.push(stamps);
    }
    timed(&mut smoother.finish(), stream)
}

fn timed(clock: &mut dyn ClockModel, stream: &[(Stamps, Vec<i64>)]) -> Vec<Timed> {
    let mut timed = Vec::new();
    for (stamps, truths) in stream {
        let Corrected { measured, period_nanos, .. } = clock.correct(stamps);
        let uncertainty = clock.state().uncertainty_secs * 1e9;
        timed.extend(truths.iter().enumerate().map(|(place, &truth)| {
            let measured = measured + (place as f64 * period_nanos).round() as i64;
            Timed { truth, measured, uncertainty }
        }));
    }
    timed
}

/// The worst figures of all recordings.
#[derive(Default)]
struct Worst {
    residuals_ms: [f64; TRANSPORTS.len()],
    calibrated: Rows,
    usual: Rows,
}

/// The figures for the rows of a recording, or the worst of several recordings.
#[derive(Default)]
struct Rows {
    skew_ms: f64,
    error_ms: f64,
    stated_ms: f64,
    /// The share of rows whose error exceeds the stated uncertainty [fraction].
    beyond: f64,
    cells_beyond: f64,
    /// The median stated uncertainty, as a multiple of the 95th percentile of the true error.
    wide: f64,
}

impl Worst {
    fn add(&mut self, streams: &[Vec<Timed>]) {
        let start = streams.iter().filter_map(|stream| stream.first()).map(|first| first.truth);
        let from = start.min().unwrap_or(0) + WARM_UP_NANOS;
        let medians: Vec<f64> = streams.iter().map(|stream| median_delay(stream, from)).collect();
        for (worst, (stream, median)) in
            self.residuals_ms.iter_mut().zip(streams.iter().zip(&medians))
        {
            let late = stream.iter().filter(|timed| timed.truth >= from);
            let error = |timed: &Timed| (timed.measured - timed.truth) as f64 - median;
            let mut residuals: Vec<f64> = late.map(|timed| error(timed).abs()).collect();
            *worst = worst.max(quantile(&mut residuals, 0.95) / 1e6);
        }
        let exact = medians.iter().map(|median| Latency::new(median / 1e9, 0.0));
        self.calibrated.worsen(&rows(streams, &exact.collect::<Vec<_>>(), from));
        let usual: Vec<Latency> = TRANSPORTS.iter().map(|transport| transport.usual).collect();
        self.usual.worsen(&rows(streams, &usual, from));
    }

    fn figures(&self) -> Vec<Figure> {
        let mut figures = Vec::new();
        for (topic, (transport, residual)) in TRANSPORTS.iter().zip(self.residuals_ms).enumerate() {
            let what = format!("residuals of stream {topic} over {}, p95", transport.name);
            figures.push(Figure { what, value: residual, bar: transport.bar_ms, unit: "ms" });
        }
        figures.extend(self.calibrated.figures("calibrated", 10.0));
        figures.extend(self.usual.figures("not calibrated", 110.0));
        figures
    }
}

/// A printed figure, and its bar.
struct Figure {
    what: String,
    value: f64,
    bar: f64,
    unit: &'static str,
}

impl Figure {
    fn passes(&self) -> bool {
        self.value <= self.bar
    }
}

impl Rows {
    fn figures(&self, when: &str, skew_bar_ms: f64) -> [Figure; 3] {
        let skew = format!("{when}: true skew in a row, p95");
        let beyond = format!(
            "{when}: rows beyond the stated uncertainty (cells beyond their own: {:.1} %)",
            self.cells_beyond * 100.0
        );
        let wide = format!(
            "{when}: median stated uncertainty (at most {:.2} ms) by the true p95 (at most {:.2} ms)",
            self.stated_ms, self.error_ms
        );
        [
            Figure { what: skew, value: self.skew_ms, bar: skew_bar_ms, unit: "ms" },
            Figure { what: beyond, value: self.beyond * 100.0, bar: 5.0, unit: "%" },
            Figure { what: wide, value: self.wide, bar: 3.0, unit: "times" },
        ]
    }

    fn worsen(&mut self, other: &Rows) {
        self.skew_ms = self.skew_ms.max(other.skew_ms);
        self.error_ms = self.error_ms.max(other.error_ms);
        self.stated_ms = self.stated_ms.max(other.stated_ms);
        self.beyond = self.beyond.max(other.beyond);
        self.cells_beyond = self.cells_beyond.max(other.cells_beyond);
        self.wide = self.wide.max(other.wide);
    }
}

/// Returns the true median of arrival minus measurement, by the times of the model [ns], which is what a calibration
/// finds.
fn median_delay(stream: &[Timed], from: i64) -> f64 {
    let late = stream.iter().filter(|timed| timed.truth >= from);
    let mut errors: Vec<f64> = late.map(|timed| (timed.measured - timed.truth) as f64).collect();
    quantile(&mut errors, 0.5)
}

fn rows(streams: &[Vec<Timed>], latencies: &[Latency], from: i64) -> Rows {
    let ends = streams.iter().filter_map(|stream| stream.last()).map(|last| last.measured);
    let until = ends.min().unwrap_or(from) - 1_000_000_000;
    let mut cursors = vec![0; streams.len()];
    let (mut skews, mut errors, mut stated) = (Vec::new(), Vec::new(), Vec::new());
    let (mut beyond, mut cells_beyond) = (0_u32, 0_u32);
    for row in (from..until).step_by(GRID_NANOS) {
        let (mut least, mut most, mut uncertainty) = (f64::MAX, f64::MIN, 0.0_f64);
        for ((stream, latency), cursor) in streams.iter().zip(latencies).zip(&mut cursors) {
            let (error, clock) = cell(stream, row + (latency.secs * 1e9) as i64, cursor);
            let error = error + latency.secs * 1e9;
            let own = clock.hypot(latency.uncertainty_secs * 1e9);
            (least, most) = (least.min(error), most.max(error));
            uncertainty = uncertainty.max(own);
            cells_beyond += u32::from(error.abs() > own);
        }
        let error = most.max(-least);
        beyond += u32::from(error > uncertainty);
        skews.push(most - least);
        errors.push(error);
        stated.push(uncertainty);
    }
    let count = errors.len() as f64;
    let (error, stated) = (quantile(&mut errors, 0.95), quantile(&mut stated, 0.5));
    Rows {
        skew_ms: quantile(&mut skews, 0.95) / 1e6,
        error_ms: error / 1e6,
        stated_ms: stated / 1e6,
        beyond: f64::from(beyond) / count,
        cells_beyond: f64::from(cells_beyond) / count / streams.len() as f64,
        wide: stated / error,
    }
}

/// Returns the error of a stream's cell at a time [ns], before its latency is subtracted, and the uncertainty of its
/// clock there [ns].
fn cell(stream: &[Timed], time: i64, cursor: &mut usize) -> (f64, f64) {
    while *cursor + 2 < stream.len() && stream[*cursor + 1].measured <= time {
        *cursor += 1;
    }
    let (a, b) = (stream[*cursor], stream[*cursor + 1]);
    let part = (time - a.measured) as f64 / (b.measured - a.measured) as f64;
    let truth = (a.truth - time) as f64 + part * (b.truth - a.truth) as f64;
    (truth, a.uncertainty.max(b.uncertainty))
}

fn quantile(values: &mut [f64], at: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values
        .get(((values.len().max(1) - 1) as f64 * at).round() as usize)
        .copied()
        .unwrap_or(f64::NAN)
}
