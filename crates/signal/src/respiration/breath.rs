//! A breath.

use super::onset::onset;
use super::turns::{Kind, Turn};

/// The longest breath [s]; a longer one contains a pause.
pub(super) const LONGEST_SECS: f64 = 20.0;

/// A breath, from one onset of inhalation to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breath {
    /// The onset of inhalation, a trough [samples from the first one], fractional.
    pub begin: f64,
    /// The onset of exhalation, the peak [samples].
    pub peak: f64,
    /// The onset of the next inhalation [samples].
    pub end: f64,
    /// The height of the peak above the preceding trough [unit of the signal].
    pub amplitude: f64,
}

impl Breath {
    /// The duration of the breath [samples].
    pub fn duration(&self) -> f64 {
        self.end - self.begin
    }

    /// The inspiratory time [samples].
    pub fn inhalation(&self) -> f64 {
        self.peak - self.begin
    }

    /// The expiratory time, including the pause [samples].
    pub fn exhalation(&self) -> f64 {
        self.end - self.peak
    }

    /// The overlap of the breath with a range of samples.
    pub(super) fn overlap(&self, samples: &std::ops::Range<f64>) -> f64 {
        (self.end.min(samples.end) - self.begin.max(samples.start)).max(0.0)
    }

    /// Whether the points of the breath are in order.
    fn is_in_order(&self) -> bool {
        self.begin < self.peak && self.peak < self.end && self.amplitude > 0.0
    }

    /// The breath shifted by `by` samples.
    pub(super) fn later(self, by: f64) -> Breath {
        Breath { begin: self.begin + by, peak: self.peak + by, end: self.end + by, ..self }
    }

    /// Whether the breath lies entirely in a range of samples.
    pub(super) fn is_within(&self, samples: &std::ops::Range<f64>) -> bool {
        self.begin >= samples.start && self.end <= samples.end
    }
}

/// Assembles breaths from turning points.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    longest: f64,
    before: Option<Turn>,
    begin: Option<Turn>,
    peak: Option<Turn>,
}

impl Assembly {
    /// Creates the assembly for turning points of a signal at `rate_hz`.
    pub(super) fn new(rate_hz: f64) -> Assembly {
        Assembly { longest: LONGEST_SECS * rate_hz, before: None, begin: None, peak: None }
    }

    /// Takes in the next turning point, and returns the breath that ended with the previous one. The end of a pause is
    /// found between the two in the `signal`, which starts at index `first`.
    pub(super) fn push(&mut self, turn: Turn, first: usize, signal: &[f64]) -> Option<Breath> {
        let before = self.before.replace(turn)?;
        let place = |turn: &Turn| (turn.place.round().max(0.0) as usize).saturating_sub(first);
        let (from, to) = (place(&before), place(&turn));
        let way = signal.get(from..=to).unwrap_or_default();
        let left = from as f64 + first as f64 + onset(way);
        self.take(Turn { place: before.place.max(left.min(turn.place)), ..before })
    }

    /// Forgets earlier turning points after a discontinuity.
    pub(super) fn restart(&mut self) {
        (self.before, self.begin, self.peak) = (None, None, None);
    }

    fn take(&mut self, turn: Turn) -> Option<Breath> {
        if turn.kind == Kind::Peak {
            self.peak = Some(turn).filter(|_| self.begin.is_some());
            return None;
        }
        let (begin, peak) = (self.begin.replace(turn), self.peak.take());
        let (begin, peak) = (begin?, peak?);
        let breath = Breath {
            begin: begin.place,
            peak: peak.place,
            end: turn.place,
            amplitude: peak.height - begin.height,
        };
        Some(breath).filter(|breath| breath.is_in_order() && breath.duration() <= self.longest)
    }
}
