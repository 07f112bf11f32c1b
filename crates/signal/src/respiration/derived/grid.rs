//! The power of unevenly spaced points on a grid of frequencies.

use std::f64::consts::TAU;

/// An even grid of frequencies.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub(super) low_hz: f64,
    pub(super) step_hz: f64,
    pub(super) count: usize,
}

impl Grid {
    /// The frequency of a grid index [Hz].
    pub(super) fn hz(self, place: usize) -> f64 {
        self.low_hz + self.step_hz * place as f64
    }

    /// The squared Fourier sum of points (time [s], height) at each frequency.
    pub(super) fn powers(self, points: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
        let mut waves: Vec<Waves> = Vec::new();
        for (place, (secs, height)) in points.enumerate() {
            if place.is_multiple_of(LANES) {
                waves.push(Waves::default());
            }
            if let Some(last) = waves.last_mut() {
                last.put(place % LANES, secs, height, self);
            }
        }
        let mut power = || {
            let mut sums = ([0.0; LANES], [0.0; LANES]);
            for each in &mut waves {
                each.next(&mut sums);
            }
            let (re, im): (f64, f64) = (sums.0.iter().sum(), sums.1.iter().sum());
            re * re + im * im
        };
        (0..self.count).map(|_| power()).collect()
    }
}

/// The number of points rotated in parallel.
const LANES: usize = 8;

/// The phasors of some points, rotated from one frequency to the next.
#[derive(Default)]
struct Waves {
    re: [f64; LANES],
    im: [f64; LANES],
    cos: [f64; LANES],
    sin: [f64; LANES],
}

impl Waves {
    fn put(&mut self, lane: usize, secs: f64, height: f64, grid: Grid) {
        let (sin, cos) = (TAU * grid.low_hz * secs).sin_cos();
        (self.re[lane], self.im[lane]) = (height * cos, height * sin);
        (self.sin[lane], self.cos[lane]) = (TAU * grid.step_hz * secs).sin_cos();
    }

    /// Adds the phasors to the sums, and rotates them.
    fn next(&mut self, sums: &mut ([f64; LANES], [f64; LANES])) {
        for lane in 0..LANES {
            let (re, im) = (self.re[lane], self.im[lane]);
            sums.0[lane] += re;
            sums.1[lane] += im;
            self.re[lane] = re * self.cos[lane] - im * self.sin[lane];
            self.im[lane] = re * self.sin[lane] + im * self.cos[lane];
        }
    }
}
