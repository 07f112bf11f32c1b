//! The processing of one channel into rows.

use super::faults::{FaultDetector, Faults, Phases};
use super::frames::{Features, Frames};
use crate::error::SignalError;

/// A sample of one channel: raw, band-passed, its envelope, and whether the muscle contracts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Taken {
    pub(super) raw: f64,
    pub(super) band: f64,
    pub(super) envelope: f64,
    pub(super) activity: Activity,
}

/// Whether a muscle contracts.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub(super) enum Activity {
    /// The muscle has had no burst: rest and a contraction that never ends look the same.
    #[default]
    Unknown,
    Rest,
    Contraction,
}

/// The summary of one channel in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    pub(super) samples: f64,
    pub(super) faults: Faults,
    /// Sum of the envelope over usable samples.
    pub(super) envelope: f64,
    /// The features of the frame that ends with the row.
    pub(super) features: Option<Features>,
    /// `Contraction` if the muscle contracts throughout that frame.
    pub(super) activity: Activity,
}

/// One channel's detectors, and the samples of its next frame.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    watch: FaultDetector,
    /// The newest band-passed samples, at least a frame.
    band: Vec<f64>,
    length: usize,
    /// The number of successive samples of contraction up to now.
    contracting: usize,
    pub(super) cell: Cell,
    before: Cell,
}

impl Channel {
    pub(super) fn new(rate_hz: f64, length: usize) -> Result<Channel, SignalError> {
        let (cell, before) = (Cell::default(), Cell::default());
        let band = Vec::with_capacity(2 * length);
        let watch = FaultDetector::new(rate_hz)?;
        Ok(Channel { watch, band, length, contracting: 0, cell, before })
    }

    pub(super) fn push(&mut self, taken: Taken, phases: &Phases) {
        self.cell.samples += 1.0;
        if crate::gaps::is_usable(taken.raw) {
            self.cell.envelope += taken.envelope;
        }
        self.watch.push(taken.raw, taken.band, phases, &mut self.cell.faults);
        if self.band.len() == 2 * self.length {
            self.band.copy_within(self.length.., 0);
            self.band.truncate(self.length);
        }
        self.band.push(taken.band);
        let is_contracting = taken.activity == Activity::Contraction;
        self.contracting = if is_contracting { self.contracting + 1 } else { 0 };
        self.cell.activity = match taken.activity {
            Activity::Contraction if self.contracting < self.length => Activity::Rest,
            activity => activity,
        };
    }

    /// Ends the row, with the frame that ends here.
    pub(super) fn finish(&mut self, frames: &mut Frames) -> Cell {
        let newest = &self.band[self.band.len().saturating_sub(self.length)..];
        let both = |of: fn(&Cell) -> f64| of(&self.before) + of(&self.cell);
        let usable = both(|cell| cell.faults.usable) / both(|cell| cell.samples);
        let features = frames.of_one(newest).filter(|_| usable >= super::store::LEAST_USABLE);
        if let Some(features) = &features {
            let squares = features.rms * features.rms;
            let click = instant(newest) / (squares * newest.len() as f64);
            self.cell.faults.frame(squares, features.tone.max(click));
        }
        self.before = Cell { features, ..self.cell };
        self.cell = Cell::default();
        self.before
    }
}

/// The largest sum of squares of three successive samples.
fn instant(frame: &[f64]) -> f64 {
    let squares = |three: &[f64]| three.iter().map(|sample| sample * sample).sum();
    frame.windows(3).map(squares).fold(0.0, f64::max)
}
