use std::collections::VecDeque;

/// The eyes count as closing below the first opening and as open again above the second, relative to open eyes.
const CLOSING: f64 = 0.7;
const OPEN: f64 = 0.8;
/// The eyes also count as open again above this share of their opening before the dip: eyes that look down are already
/// half closed.
const OPEN_OF_BEFORE: f64 = 0.9;
/// The minimum depth of a dip below open eyes, in standard deviations of the noise.
const SURE: f64 = 5.0;
/// The minimum depth of a dip, averaged over neighbouring pictures, below the opening shortly before and
/// after it.
const LEAST_DEPTH: f64 = 0.2;
/// The longest blink, at half depth [s]; a longer closure is not a blink.
pub(super) const LONGEST_SECS: f64 = 0.5;
/// The shortest blink [s].
const SHORTEST_SECS: f64 = 0.03;
/// The longest time between two pictures within a dip [ns].
const MOST_APART_NANOS: i64 = 250_000_000;
/// How much of the time before a dip is kept [ns].
const BEFORE_NANOS: i64 = 400_000_000;
/// The longest dip [ns].
const LONGEST_NANOS: i64 = 60_000_000_000;

/// A time in which the eyes were closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closure {
    /// The middle of the closure, at half depth [ns].
    pub at_ns: i64,
    /// The index of the picture with the smallest opening, from 0.
    pub frame: usize,
    /// The duration at half depth [s].
    pub secs: f64,
    /// The depth as a share of the opening of open eyes [0..1].
    pub depth: f64,
}

impl Closure {
    pub fn is_blink(&self) -> bool {
        self.secs <= LONGEST_SECS
    }
}

/// Detects eye closures.
#[derive(Debug, Default)]
pub(super) struct Blinks {
    /// The pictures from shortly before the dip on: index, time [ns], opening.
    pictures: VecDeque<(usize, i64, f64)>,
    is_closing: bool,
    /// The opening before the dip.
    before: f64,
}

impl Blinks {
    /// Takes in the opening in a picture, relative to open eyes, and its noise; returns the closure that
    /// has just ended, if any.
    pub fn push(&mut self, frame: usize, at_ns: i64, open: f64, noise: f64) -> Option<Closure> {
        if !open.is_finite() || !noise.is_finite() {
            return None;
        }
        let last_ns = self.pictures.back().map(|(_, last_ns, _)| *last_ns);
        if last_ns.is_some_and(|last_ns| at_ns.saturating_sub(last_ns) > MOST_APART_NANOS) {
            *self = Blinks::default();
        }
        self.pictures.push_back((frame, at_ns, open));
        if !self.is_closing {
            self.forget(at_ns.saturating_sub(BEFORE_NANOS));
            self.is_closing = open < CLOSING.min(1.0 - SURE * noise);
            self.before = before(&self.pictures);
            return None;
        }
        if open > OPEN.min(1.0 - noise).min(OPEN_OF_BEFORE * self.before) {
            let closure = self.closure();
            self.is_closing = false;
            if closure.is_some() {
                self.pictures.clear();
            }
            return closure;
        }
        self.forget(at_ns.saturating_sub(LONGEST_NANOS));
        None
    }

    fn forget(&mut self, before_ns: i64) {
        while self.pictures.front().is_some_and(|(_, at_ns, _)| *at_ns < before_ns) {
            self.pictures.pop_front();
        }
    }

    fn closure(&self) -> Option<Closure> {
        let pictures: Vec<(usize, i64, f64)> = self.pictures.iter().copied().collect();
        let deepest = (0..pictures.len())
            .min_by(|one, other| pictures[*one].2.total_cmp(&pictures[*other].2))?;
        let depth = 1.0 - pictures[deepest].2;
        // After looking down the eyes stay less open: a single noisy picture then is not a blink.
        let edge = pictures.last().map_or(self.before, |(_, _, after)| self.before.min(*after));
        if edge - around(&pictures, deepest) < LEAST_DEPTH {
            return None;
        }
        let half = 1.0 - 0.5 * depth;
        let (first_ns, last_ns) = (pictures.first()?.1, pictures.last()?.1);
        // The time at which the line between two pictures crosses half depth.
        let crossing = |(_, from_ns, from): (usize, i64, f64),
                        (_, to_ns, to): (usize, i64, f64)| {
            from_ns as f64
                + (to_ns - from_ns) as f64 * ((half - from) / (to - from)).clamp(0.0, 1.0)
        };
        // Searched for from outside, so that a closure with a partial opening in between stays one.
        let begins = pictures.windows(2).find(|pair| pair[0].2 > half && pair[1].2 <= half);
        let ends = pictures.windows(2).rev().find(|pair| pair[0].2 <= half && pair[1].2 > half);
        let begin_ns = begins.map_or(first_ns as f64, |pair| crossing(pair[0], pair[1]));
        let end_ns = ends.map_or(last_ns as f64, |pair| crossing(pair[0], pair[1]));
        let secs = (end_ns - begin_ns) / 1e9;
        (secs >= SHORTEST_SECS).then(|| Closure {
            at_ns: f64::midpoint(begin_ns, end_ns).round() as i64,
            frame: pictures[deepest].0,
            secs,
            depth: depth.clamp(0.0, 1.0),
        })
    }
}

/// The median opening in all pictures but the last.
fn before(pictures: &VecDeque<(usize, i64, f64)>) -> f64 {
    let but_last = pictures.iter().take(pictures.len().saturating_sub(1));
    let mut openings: Vec<f64> = but_last.map(|(_, _, open)| *open).collect();
    openings.sort_by(f64::total_cmp);
    openings.get(openings.len() / 2).copied().unwrap_or(1.0)
}

/// The mean of the openings of a picture and its neighbours.
fn around(pictures: &[(usize, i64, f64)], place: usize) -> f64 {
    let near = &pictures[place.saturating_sub(1)..(place + 2).min(pictures.len())];
    near.iter().map(|(_, _, open)| open).sum::<f64>() / near.len() as f64
}
