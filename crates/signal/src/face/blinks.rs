use std::collections::VecDeque;

/// Below this the eyes close, and above this they are open again, by the level of open ones.
const CLOSING: f64 = 0.7;
const OPEN: f64 = 0.8;
/// They are open again above this share of what they were before, too: eyes that look down are half closed already.
const OPEN_OF_BEFORE: f64 = 0.9;
/// How many standard deviations of the noise below open eyes a dip has to be.
const SURE: f64 = 5.0;
/// How far it has to go, with its neighbours, below what came shortly before and what comes after.
const LEAST_DEPTH: f64 = 0.2;
/// The longest blink, at half of its depth [s]; beyond that the eyes are closed.
pub(super) const LONGEST_SECS: f64 = 0.5;
/// The shortest blink [s].
const SHORTEST_SECS: f64 = 0.03;
/// The longest time between two pictures of one dip [ns].
const MOST_APART_NANOS: i64 = 250_000_000;
/// How much of what comes before a dip is kept [ns].
const BEFORE_NANOS: i64 = 400_000_000;
/// The longest dip [ns].
const LONGEST_NANOS: i64 = 60_000_000_000;

/// A time in which the eyes were closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Closure {
    /// Its middle, at half of its depth [ns].
    pub at_ns: i64,
    /// The number of the picture of its deepest [from 0].
    pub frame: usize,
    /// How long it was, at half of its depth [s].
    pub secs: f64,
    /// By how much of open eyes they closed [0..1].
    pub depth: f64,
}

impl Closure {
    pub fn is_blink(&self) -> bool {
        self.secs <= LONGEST_SECS
    }
}

/// Finds where the eyes close.
#[derive(Debug, Default)]
pub(super) struct Blinks {
    /// The pictures since shortly before the dip: number, time [ns], opening.
    pictures: VecDeque<(usize, i64, f64)>,
    is_closing: bool,
    /// The opening before it.
    before: f64,
}

impl Blinks {
    /// Takes in the opening of a picture, by that of open eyes, and its noise; returns what was a closure, once the eyes
    /// are open again.
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
        // Who looks down opens the eyes less afterwards: one noisy picture of that is no blink.
        let edge = pictures.last().map_or(self.before, |(_, _, after)| self.before.min(*after));
        if edge - around(&pictures, deepest) < LEAST_DEPTH {
            return None;
        }
        let half = 1.0 - 0.5 * depth;
        let (first_ns, last_ns) = (pictures.first()?.1, pictures.last()?.1);
        // Where the line between two pictures is at half of the depth.
        let crossing = |(_, from_ns, from): (usize, i64, f64),
                        (_, to_ns, to): (usize, i64, f64)| {
            from_ns as f64
                + (to_ns - from_ns) as f64 * ((half - from) / (to - from)).clamp(0.0, 1.0)
        };
        // From outside, so that eyes that open a little in between are one closure.
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

/// The median opening of all but the last picture.
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
