//! Runs eight simulated hours of 64 sources through the models of their clocks and onto a grid: memory stays as it was
//! after the first hour, and within the bound computed beforehand.

mod allocated;
mod device;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::error::Error;

use teampulse_timefilter::Ticks;
use teampulse_timefilter::align::{Aligner, Mode, Output, RowTimes, Run, SourceId, SourceSettings};
use teampulse_timefilter::clock::{
    ClockModel, Latency, OneWay, OneWaySettings, Probe, Remote, SampleIndex,
};

use self::device::{Clock, Device, KINDS};

const SECOND: i64 = 1_000_000_000;
const HOUR: i64 = 3_600 * SECOND;
const START: i64 = 1_700_000_000 * SECOND;
const END: i64 = START + 8 * HOUR;
const SOURCES: usize = 64;
/// The period of both the grid and the session's ticks [ns].
const PERIOD: i64 = SECOND / 10;
/// The time between probes of a computer [ns].
const PROBED: i64 = 5 * SECOND;
/// The largest ratio of the memory in use after the last hour to that after the first.
const FLAT_BAR: f64 = 1.01;
/// The largest difference between the rows and the grid's number in that time, for the first and the last second.
const ROWS_APART: u64 = 10;

/// Runs eight hours; returns an error if a bar is missed.
pub fn measure() -> Result<(), Box<dyn Error>> {
    let mut waiting = BinaryHeap::with_capacity(SOURCES);
    let mut devices: Vec<Device> = (0..SOURCES).map(|number| Device::new(number, START)).collect();
    let before = allocated::now();
    let mut filter = Filter::new(&devices)?;
    let bound = filter.bytes_bound();
    waiting.extend(
        devices.iter().enumerate().map(|(number, device)| (Reverse(device.arrival()), number)),
    );
    let mut ticks = Ticks::every(PERIOD);
    let mut hours = Vec::with_capacity(8);
    allocated::forget_most();
    while let Some((Reverse(arrival), number)) = waiting.pop() {
        for tick in ticks.until(arrival) {
            filter.tick(tick);
            if (tick - START) % HOUR == 0 && tick > START {
                hours.push(allocated::now() - before);
            }
        }
        if arrival > END {
            break;
        }
        filter.take(number, &devices[number])?;
        devices[number].go_on();
        waiting.push((Reverse(devices[number].arrival()), number));
    }
    let most = allocated::most() - before;
    filter.aligner.finish(see);
    judge(&filter, &hours, most, bound)
}

fn judge(filter: &Filter, hours: &[i64], most: i64, bound: usize) -> Result<(), Box<dyn Error>> {
    let &[first, .., last] = hours else { return Err("expected eight hours".into()) };
    let bound = i64::try_from(bound)?;
    let kib = |bytes: i64| bytes as f64 / 1024.0;
    let growth = last as f64 / first as f64;
    let flat = reported(
        growth <= FLAT_BAR,
        &format!(
            "memory of {SOURCES} sources after hour 1: {:.1} KiB, after hour {}: {:.1} KiB, \
             {growth:.3} times (bar {FLAT_BAR})",
            kib(first),
            hours.len(),
            kib(last)
        ),
    );
    let bounded = reported(
        most <= bound,
        &format!("memory at its most: {:.1} KiB (bar, as computed: {:.1})", kib(most), kib(bound)),
    );
    let (rows, expected) = (filter.aligner.rows(), ((END - START) / PERIOD) as u64);
    let whole = reported(
        rows.abs_diff(expected) <= ROWS_APART && filter.crowded() == 0,
        &format!(
            "{} messages with {} samples, of clocks that began anew {} times, make {rows} rows \
             (bar {expected} ± {ROWS_APART}); {} samples found no room (bar 0)",
            filter.messages,
            filter.samples,
            filter.epochs(),
            filter.crowded()
        ),
    );
    if flat && bounded && whole { Ok(()) } else { Err("a bar of the soak was missed".into()) }
}

fn reported(passed: bool, figure: &str) -> bool {
    println!("{}  {figure}", if passed { "pass" } else { "FAIL" });
    passed
}

/// Everything between stamps and rows.
struct Filter {
    models: Vec<Box<dyn ClockModel>>,
    probed: Vec<bool>,
    most_bytes_of_models: usize,
    aligner: Aligner,
    sources: Vec<SourceId>,
    values: Vec<f64>,
    samples: u64,
    messages: u64,
}

impl Filter {
    fn new(devices: &[Device]) -> Result<Filter, Box<dyn Error>> {
        let onto = RowTimes::Grid { period_nanos: PERIOD };
        let mut filter = Filter {
            models: Vec::with_capacity(devices.len()),
            probed: devices.iter().map(|device| device.kind().clock == Clock::Remote).collect(),
            most_bytes_of_models: 0,
            sources: Vec::with_capacity(devices.len()),
            values: vec![0.5; KINDS.iter().map(|kind| kind.batch as usize).max().unwrap_or(1)],
            samples: 0,
            messages: 0,
            aligner: Aligner::new(onto, Mode::Reproducible)?,
        };
        for device in devices {
            let kind = device.kind();
            let (model, most_bytes): (Box<dyn ClockModel>, usize) = match kind.clock {
                Clock::OneWay => {
                    let settings = OneWaySettings::new(Latency::BLUETOOTH);
                    (Box::new(OneWay::new(settings)), OneWay::MOST_BYTES)
                }
                Clock::SampleIndex => {
                    let model = SampleIndex::new(kind.rate_hz, Latency::BLUETOOTH);
                    (Box::new(model), SampleIndex::MOST_BYTES)
                }
                Clock::Remote => (Box::new(Remote::default()), Remote::MOST_BYTES),
            };
            filter.models.push(model);
            filter.most_bytes_of_models += most_bytes;
            let settings = SourceSettings {
                lateness_nanos: SECOND / 5,
                idle_nanos: 12 * SECOND,
                ..SourceSettings::new(kind.policy)
            };
            filter.sources.push(filter.aligner.add(settings)?);
        }
        Ok(filter)
    }

    /// Returns the most memory that the filter may ever take [B].
    fn bytes_bound(&self) -> usize {
        let own = size_of_val(&self.values[..])
            + size_of_val(&self.sources[..])
            + size_of_val(&self.models[..])
            + size_of_val(&self.probed[..]);
        own + self.most_bytes_of_models + self.aligner.bytes_bound()
    }

    fn take(&mut self, number: usize, device: &Device) -> Result<(), Box<dyn Error>> {
        let stamps = device.stamps();
        let corrected = self.models[number].correct(&stamps);
        let run = Run {
            measured: corrected.measured,
            period_nanos: corrected.period_nanos,
            arrival: stamps.arrival,
            values: &self.values[..stamps.count as usize],
        };
        self.aligner.push_run(self.sources[number], run, see)?;
        self.samples += u64::from(stamps.count);
        self.messages += 1;
        Ok(())
    }

    fn tick(&mut self, now: i64) {
        for (model, probed) in self.models.iter_mut().zip(&self.probed) {
            if *probed && now % PROBED == 0 {
                let probe = Probe { arrival: now, offset_secs: 0.03, round_trip_secs: 0.004 };
                model.probe(&probe);
            }
            model.tick(now);
            while model.next_event().is_some() {}
        }
        self.aligner.tick(now, see);
    }

    fn crowded(&self) -> u64 {
        let counts = self.sources.iter().filter_map(|source| self.aligner.counts(*source));
        counts.map(|counts| counts.crowded).sum()
    }

    fn epochs(&self) -> u32 {
        self.models.iter().map(|model| model.state().epoch).sum()
    }
}

fn see(output: Output<'_>) {
    if let Output::Row(row) = output {
        std::hint::black_box(row.cells().len());
    }
}
