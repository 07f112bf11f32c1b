//! The speed of resampling samples onto a grid.

use std::error::Error;
use std::hint::black_box;

use rustix::time::{ClockId, clock_gettime};
use teampulse_timefilter::align::{
    Aligner, Mode, Output, Policy, RowTimes, Sample, SourceId, SourceSettings,
};

const RUNS: u32 = 5;
const GRID: RowTimes = RowTimes::Grid { period_nanos: 15_625_000 }; // 64 Hz
const LINEAR: Policy = Policy::Linear { max_gap_nanos: 2_000_000_000 };
/// The rate of each of many sources [Hz], and the total number of messages that they deliver.
const RATE_HZ: i64 = 30;
const MESSAGES: i64 = 400_000;

/// A sample, and when it arrived [ns].
#[derive(Clone, Copy)]
struct Arrival {
    topic: usize,
    measured: i64,
    at: i64,
}

/// Measures what the arguments request: `FILE TOPICS`, with a file as for `message_filters.cpp`; or `flat`, for the
/// cost at 2 to 64 sources, one line each.
pub fn measure(arguments: &[String]) -> Result<(), Box<dyn Error>> {
    match arguments {
        [flat] if flat == "flat" => {
            for sources in [2, 4, 8, 16, 32, 64] {
                println!("{sources} {:.2}", nanos_per_message(&steady(sources), sources)?.0);
            }
            Ok(())
        }
        [file, topics] => {
            let (nanos, rows) = nanos_per_message(&read(file)?, topics.parse()?)?;
            println!("{rows} {nanos:.2}");
            Ok(())
        }
        _ => Err("expected `flat`, or FILE TOPICS".into()),
    }
}

/// Returns the processor time of each message [ns], the best of some runs, and the number of rows.
fn nanos_per_message(arrivals: &[Arrival], topics: usize) -> Result<(f64, u64), Box<dyn Error>> {
    let mut best = (f64::INFINITY, 0);
    for _ in 0..RUNS {
        let mut aligner = Aligner::new(GRID, Mode::Reproducible)?;
        let sources = (0..topics).map(|_| aligner.add(SourceSettings::new(LINEAR)));
        let sources: Vec<SourceId> = sources.collect::<Result<_, _>>()?;
        let mut sum = 0.0;
        let begun = cpu_nanos();
        for message in arrivals {
            let Arrival { topic, measured, at: arrival } = *message;
            let sample = Sample { measured, arrival, values: &[measured as f64] };
            aligner.push(sources[topic], sample, |output| {
                if let Output::Row(row) = output {
                    sum += row.cells().map(|(_, cell)| cell.values[0]).sum::<f64>();
                }
            })?;
        }
        let nanos = (cpu_nanos() - begun) / arrivals.len() as f64;
        black_box(sum);
        if nanos < best.0 {
            best = (nanos, aligner.rows());
        }
    }
    Ok(best)
}

/// Reads samples in order of their arrival; a stamp is taken as the arrival, as in `message_filters`.
fn read(path: &str) -> Result<Vec<Arrival>, Box<dyn Error>> {
    let mut arrival = i64::MIN;
    let mut parse = |line: &str| -> Result<Arrival, Box<dyn Error>> {
        let (topic, stamp) = line.split_once(' ').ok_or_else(|| format!("{path}: {line}"))?;
        let measured = stamp.parse()?;
        arrival = arrival.max(measured);
        Ok(Arrival { topic: topic.parse()?, measured, at: arrival })
    };
    std::fs::read_to_string(path)?.lines().map(&mut parse).collect()
}

/// Makes sources with the same rate, each with a different phase and delay.
fn steady(sources: usize) -> Vec<Arrival> {
    let period = 1_000_000_000 / RATE_HZ;
    let moments = (0..MESSAGES / sources as i64).map(|number| number * period);
    let arrival = |moment, topic| {
        let measured = moment + period * topic as i64 / sources as i64;
        let delay = 1_000_000 * (topic as i64 % 7) + measured % 1_000_003;
        Arrival { topic, measured, at: measured + delay }
    };
    let mut arrivals: Vec<Arrival> =
        moments.flat_map(|moment| (0..sources).map(move |topic| arrival(moment, topic))).collect();
    arrivals.sort_by_key(|arrival| arrival.at);
    arrivals
}

fn cpu_nanos() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 * 1e9 + used.tv_nsec as f64
}
