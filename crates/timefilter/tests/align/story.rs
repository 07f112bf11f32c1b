//! What arrives at an aligner, and all that it gives out.

use teampulse_timefilter::align::{
    Aligner, Cell, LeftOutReason, Mode, Output, Policy, RowTimes, Sample, SourceEvent, SourceId,
    SourceSettings, Validity,
};

pub const MS: i64 = 1_000_000;
pub const SECOND: i64 = 1_000 * MS;

/// All that an aligner gives out, kept.
#[derive(Clone, Debug, PartialEq)]
pub enum Kept {
    Row(KeptRow),
    LeftOut(SourceId, i64, LeftOutReason),
    Event(SourceEvent),
}

#[derive(Clone, Debug, PartialEq)]
pub struct KeptRow {
    pub at: i64,
    pub cells: Vec<(SourceId, KeptCell)>,
}

/// Values by their bits, so that NaN equals NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptCell {
    bits: Vec<u64>,
    pub age_nanos: i64,
    pub validity: Validity,
}

impl KeptCell {
    pub fn value(&self) -> f64 {
        f64::from_bits(self.bits[0])
    }
}

impl KeptRow {
    pub fn cell(&self, source: SourceId) -> &KeptCell {
        self.find(source).expect("the source is in the row")
    }

    pub fn find(&self, source: SourceId) -> Option<&KeptCell> {
        self.cells.iter().find(|(id, _)| *id == source).map(|(_, cell)| cell)
    }
}

/// An aligner, and all that it has given out.
pub struct Outcome {
    pub aligner: Aligner,
    pub kept: Vec<Kept>,
}

pub fn keep(kept: &mut Vec<Kept>, output: Output<'_>) {
    kept.push(match output {
        Output::Row(row) => {
            let cell = |(id, cell): (SourceId, Cell<'_>)| {
                let bits = cell.values.iter().map(|value| value.to_bits()).collect();
                (id, KeptCell { bits, age_nanos: cell.age_nanos, validity: cell.validity })
            };
            Kept::Row(KeptRow { at: row.at, cells: row.cells().map(cell).collect() })
        }
        Output::LeftOut(left_out) => {
            Kept::LeftOut(left_out.source, left_out.measured, left_out.reason)
        }
        Output::Event(event) => Kept::Event(event),
    });
}

impl Outcome {
    pub fn new(onto: RowTimes, mode: Mode) -> Outcome {
        Outcome { aligner: Aligner::new(onto, mode).unwrap(), kept: Vec::new() }
    }

    pub fn grid(period_nanos: i64) -> Outcome {
        Outcome::new(RowTimes::Grid { period_nanos }, Mode::Reproducible)
    }

    pub fn add(&mut self, policy: &str) -> SourceId {
        let policy: Policy = policy.parse().unwrap();
        self.aligner.add(SourceSettings::new(policy)).unwrap()
    }

    /// A source that comes later.
    pub fn join(&mut self, policy: &str, now: i64) -> SourceId {
        let settings = SourceSettings::new(policy.parse().unwrap());
        self.aligner.join(settings, now, |output| keep(&mut self.kept, output)).unwrap()
    }

    pub fn push(&mut self, source: SourceId, measured: i64, arrival: i64, value: f64) {
        let sample = Sample { measured, arrival, values: &[value] };
        self.aligner.push(source, sample, |output| keep(&mut self.kept, output)).unwrap();
    }

    /// A sample that arrives as soon as it is measured.
    pub fn at(&mut self, source: SourceId, measured: i64, value: f64) {
        self.push(source, measured, measured, value);
    }

    pub fn tick(&mut self, now: i64) {
        self.aligner.tick(now, |output| keep(&mut self.kept, output));
    }

    pub fn leave(&mut self, source: SourceId) {
        self.aligner.leave(source, |output| keep(&mut self.kept, output)).unwrap();
    }

    pub fn finish(&mut self) {
        self.aligner.finish(|output| keep(&mut self.kept, output));
    }

    pub fn rows(&self) -> Vec<&KeptRow> {
        let mut rows = Vec::new();
        for kept in &self.kept {
            if let Kept::Row(row) = kept {
                rows.push(row);
            }
        }
        rows
    }

    pub fn row(&self, at: i64) -> &KeptRow {
        self.rows().into_iter().find(|row| row.at == at).expect("there is a row at that time")
    }

    pub fn times(&self) -> Vec<i64> {
        self.rows().iter().map(|row| row.at).collect()
    }

    pub fn events(&self) -> Vec<SourceEvent> {
        let event = |kept: &Kept| if let Kept::Event(event) = kept { Some(*event) } else { None };
        self.kept.iter().filter_map(event).collect()
    }

    pub fn left_out(&self) -> Vec<(SourceId, i64, LeftOutReason)> {
        let of = |kept: &Kept| match kept {
            Kept::LeftOut(source, measured, reason) => Some((*source, *measured, *reason)),
            _ => None,
        };
        self.kept.iter().filter_map(of).collect()
    }
}
