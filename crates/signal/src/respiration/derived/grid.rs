//! Frequencies, and the power that uneven points have at each of them.

use std::f64::consts::TAU;

/// An even grid of frequencies.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub(super) low_hz: f64,
    pub(super) step_hz: f64,
    pub(super) count: usize,
}

impl Grid {
    /// The frequency of a place of the grid [Hz].
    pub(super) fn hz(self, place: usize) -> f64 {
        self.low_hz + self.step_hz * place as f64
    }

    /// The squared Fourier sum of points (time [s], height) at each frequency.
    pub(super) fn powers(self, points: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
        let mut waves: Vec<Wave> =
            points.map(|(secs, height)| Wave::new(secs, height, self)).collect();
        let mut power = || {
            let add = |sum: (f64, f64), wave: (f64, f64)| (sum.0 + wave.0, sum.1 + wave.1);
            let (re, im) = waves.iter_mut().map(Wave::next).fold((0.0, 0.0), add);
            re * re + im * im
        };
        (0..self.count).map(|_| power()).collect()
    }
}

/// One point's part of the Fourier sum, turned on from one frequency to the next.
struct Wave {
    now: (f64, f64),
    step: (f64, f64),
}

impl Wave {
    fn new(secs: f64, height: f64, grid: Grid) -> Wave {
        let (sin, cos) = (TAU * grid.low_hz * secs).sin_cos();
        let (step_sin, step_cos) = (TAU * grid.step_hz * secs).sin_cos();
        Wave { now: (height * cos, height * sin), step: (step_cos, step_sin) }
    }

    fn next(&mut self) -> (f64, f64) {
        let ((re, im), (cos, sin)) = (self.now, self.step);
        self.now = (re * cos - im * sin, re * sin + im * cos);
        (re, im)
    }
}
