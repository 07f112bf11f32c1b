//! An aligner: any settings, sources that come and go, any stamps and values.

use teampulse_timefilter::align::{
    Aggregate, AlignError, Aligner, LONGEST_NANOS, Mode, RowTimes, Output, Policy, ROWS_IN_SILENCE,
    Run, Sample, SourceId, SourceSettings,
};

use crate::bytes::Bytes;

/// How many sources are added at most.
const SOURCES: usize = 12;

pub fn drive(bytes: &mut Bytes<'_>) {
    let period_nanos = bytes.one_of(&[1, 1_000, 15_625_000, 100_000_000, LONGEST_NANOS, 0, -1]);
    let onto = if bytes.flag() { RowTimes::Pivot } else { RowTimes::Grid { period_nanos } };
    let mode = if bytes.flag() { Mode::Available } else { Mode::Reproducible };
    let Ok(mut aligner) = Aligner::new(onto, mode) else { return };
    let mut outputs = Outputs::default();
    let mut sources = Vec::new();
    while !bytes.is_over() {
        step(&mut aligner, &mut sources, bytes, &mut outputs);
        let most = (outputs.samples + 1) * (ROWS_IN_SILENCE as u64 + 1);
        assert!(outputs.rows <= most, "{} rows, at most {most}", outputs.rows);
    }
    aligner.finish(|output| outputs.see(output));
    assert_eq!(outputs.rows, aligner.rows());
}

fn step(
    aligner: &mut Aligner,
    sources: &mut Vec<(SourceId, usize)>,
    bytes: &mut Bytes<'_>,
    outputs: &mut Outputs,
) {
    let which = bytes.byte();
    let known = sources.get(usize::from(which >> 4) % sources.len().max(1)).copied();
    match (which % 16, known) {
        (0 | 1, _) | (_, None) if sources.len() < SOURCES => {
            let settings = settings(bytes);
            if let Ok(source) = aligner.add(settings) {
                sources.push((source, settings.channels));
            }
        }
        (2, _) => {
            aligner.tick(bytes.time(), |output| outputs.see(output));
        }
        (3, Some((source, _))) if bytes.below(8) == 0 => {
            drop(aligner.leave(source, |output| outputs.see(output)));
        }
        (4, _) if bytes.below(64) == 0 => {
            aligner.finish(|output| outputs.see(output));
        }
        (5..8, Some((source, channels))) => push_run(aligner, source, channels, bytes, outputs),
        (_, Some((source, channels))) => push(aligner, source, channels, bytes, outputs),
        (_, None) => {}
    }
}

fn push(
    aligner: &mut Aligner,
    source: SourceId,
    channels: usize,
    bytes: &mut Bytes<'_>,
    outputs: &mut Outputs,
) {
    let values: Vec<f64> = (0..channels).map(|_| bytes.number()).collect();
    let arrival = bytes.time();
    let sample = Sample { measured: bytes.time(), arrival, values: &values };
    outputs.samples += 1;
    let before = aligner.counts(source).map(|counts| counts.received);
    let pushed = aligner.push(source, sample, |output| outputs.see(output));
    match pushed {
        Ok(()) => {
            let received = aligner.counts(source).map(|counts| counts.received);
            assert_eq!(received, before.map(|before| before + 1));
        }
        Err(error) => assert_eq!(error, AlignError::Unknown),
    }
}

fn push_run(
    aligner: &mut Aligner,
    source: SourceId,
    channels: usize,
    bytes: &mut Bytes<'_>,
    outputs: &mut Outputs,
) {
    let count = bytes.below(8) * channels + usize::from(bytes.below(16) == 0);
    let values: Vec<f64> = (0..count).map(|_| bytes.number()).collect();
    let (arrival, period_nanos) = (bytes.time(), bytes.number());
    let run = Run { measured: bytes.time(), period_nanos, arrival, values: &values };
    outputs.samples += (count / channels) as u64;
    drop(aligner.push_run(source, run, |output| outputs.see(output)));
}

fn settings(bytes: &mut Bytes<'_>) -> SourceSettings {
    SourceSettings {
        channels: 1 + bytes.below(3),
        policy: policy(bytes),
        lateness_nanos: bytes.nanos() * i64::from(bytes.flag()),
        idle_nanos: bytes.nanos(),
        capacity: bytes.one_of(&[1, 2, 3, 8, 100, 4_096]),
    }
}

fn policy(bytes: &mut Bytes<'_>) -> Policy {
    let nanos = if bytes.below(8) == 0 { bytes.time() } else { bytes.nanos() };
    match bytes.below(9) {
        0 => Policy::Exact,
        1 => Policy::Nearest { tolerance_nanos: nanos },
        2 => Policy::Hold { max_age_nanos: nanos },
        3 | 4 => Policy::Linear { max_gap_nanos: nanos },
        _ => {
            let aggregate = bytes.one_of(&[
                Aggregate::Mean,
                Aggregate::Min,
                Aggregate::Max,
                Aggregate::Last,
                Aggregate::Count,
            ]);
            Policy::Window { length_nanos: nanos, aggregate }
        }
    }
}

/// What was given to it and what it gave out.
#[derive(Default)]
struct Outputs {
    samples: u64,
    rows: u64,
    last: Option<i64>,
}

impl Outputs {
    fn see(&mut self, output: Output<'_>) {
        let Output::Row(row) = output else { return };
        assert!(self.last.is_none_or(|last| last < row.at), "rows are in order");
        self.last = Some(row.at);
        self.rows += 1;
        for (_, cell) in row.cells() {
            assert!(!cell.values.is_empty());
        }
    }
}
