//! A signal in segments.

use std::collections::VecDeque;
use std::ops::Range;

use super::smoothed::Smoothed;
use super::template::FittedLine;

/// The length of segments [s].
const PIECE_SECS: f64 = 5.0;

/// The values of a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) mean: f64,
    /// Detrended skewness; NaN for a constant segment.
    pub(super) skewness: f64,
}

/// The newest 5 s segments of a smoothed signal, counted from its first sample.
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    length: usize,
    /// The number of the first segment held.
    first: usize,
    held: VecDeque<Piece>,
}

impl Pieces {
    pub(super) fn new(rate_hz: f64) -> Pieces {
        let length = (PIECE_SECS * rate_hz).round().max(1.0) as usize;
        Pieces { length, first: 0, held: VecDeque::new() }
    }

    /// Adds the segments that are now complete.
    pub(super) fn take(&mut self, signal: &Smoothed) {
        let mut next = (self.first + self.held.len()) * self.length;
        while next + self.length <= signal.held().end {
            let values = signal.part(next..next + self.length).values(next..next + self.length);
            self.held.push_back(Piece::of(values));
            next += self.length;
        }
    }

    /// Drops the segments that begin before a sample.
    pub(super) fn forget(&mut self, before: usize) {
        while self.first * self.length < before && self.held.pop_front().is_some() {
            self.first += 1;
        }
    }

    /// The segments within a range of samples.
    pub(super) fn within(&self, samples: &Range<usize>) -> impl Iterator<Item = &Piece> {
        let place = |number: usize| number.saturating_sub(self.first).min(self.held.len());
        let begin = place(samples.start.div_ceil(self.length));
        self.held.range(begin..place(samples.end / self.length).max(begin))
    }
}

impl Piece {
    fn of(values: &[f64]) -> Piece {
        let line = FittedLine::through(values);
        let (mut squares, mut cubes) = (0.0, 0.0);
        for (place, &value) in values.iter().enumerate() {
            let away = line.above(place, value);
            squares += away * away;
            cubes += away * away * away;
        }
        let count = values.len() as f64;
        let skewness = (cubes / count) / (squares / count).powf(1.5);
        Piece { mean: values.iter().sum::<f64>() / count, skewness }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_pieces_of_the_stream_lie_within_samples() {
        let (mut smoothed, mut pieces) = (Smoothed::new(20.0), Pieces::new(20.0));
        for k in 0..1000 {
            smoothed.push(f64::from(k));
            pieces.take(&smoothed);
        }
        let means = |pieces: &Pieces, samples| -> Vec<f64> {
            pieces.within(&samples).map(|piece| piece.mean.round()).collect()
        };
        assert_eq!(means(&pieces, 150..520), [250.0, 350.0, 450.0]);
        assert_eq!(means(&pieces, 201..299), [] as [f64; 0]);
        pieces.forget(250);
        assert_eq!(means(&pieces, 150..520), [350.0, 450.0]);
    }
}
