//! The lower envelope of the delays of a computer's messages.

use std::collections::VecDeque;

use super::line::{LinearFit, Point};

/// The fastest message of so much time counts [ns].
const BIN_NANOS: i64 = 2_000_000_000;
/// How many bins count: two minutes.
const BINS: usize = 60;
/// A bin's fastest message may be later than the envelope by so much and still belong to it [ns].
const BELONGS_NANOS: i64 = 100_000_000;
/// After so many bins in a row that do not, the envelope is elsewhere.
const ELSEWHERE: usize = 10;
/// How far below the fastest messages the envelope is.
const EXPECTILE: f64 = 0.05;
/// From how many bins on the skew is known.
const SKEW_BINS: usize = 8;
/// How fast the spread forgets, a message.
const FORGETS: f64 = 0.005;

/// The lower envelope of delays: what the fastest messages take, by their stamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Envelope {
    line: Option<LinearFit>,
    bins: VecDeque<Point>,
    open: Option<Bin>,
    /// The lowest delays of the last bins that did not belong.
    raised: Vec<i64>,
    messages: u64,
    square: f64,
}

/// A bin that is being filled.
#[derive(Clone, Copy, Debug)]
struct Bin {
    number: i64,
    messages: u64,
    lowest: Point,
    /// The lowest but one: a single stamp that is wrong is not the fastest message.
    second: Point,
}

/// What passing time brings to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing.
    Nothing,
    /// A better line.
    LinearFit,
    /// For long all delays were higher than the line: this is the lowest of them [ns].
    Elsewhere(i64),
}

impl Envelope {
    /// What it allocates at most [B].
    pub(super) const BYTES: usize = (BINS + 1).next_power_of_two() * size_of::<Point>()
        + ELSEWHERE.next_power_of_two() * size_of::<i64>();

    /// An envelope of which one point is known.
    pub(super) fn new(now: i64, nanos: i64) -> Envelope {
        let line = Some(LinearFit { origin: now, nanos, slope: 0.0 });
        Envelope { line, ..Envelope::default() }
    }

    /// What the fastest messages take; `None` before that is known.
    pub(super) fn line(&self) -> Option<LinearFit> {
        self.line
    }

    /// Whether its slope was found, not only assumed.
    pub(super) fn knows_skew(&self) -> bool {
        self.bins.len() >= SKEW_BINS
    }

    /// How far messages lie above it, root mean square [ns]; NaN before the first.
    pub(super) fn spread_nanos(&self) -> f64 {
        if self.messages == 0 { f64::NAN } else { self.square.sqrt() }
    }

    /// A message came with this delay [ns]; the first one begins an envelope of which nothing is
    /// known.
    pub(super) fn push(&mut self, now: i64, nanos: i64) {
        let line = *self.line.get_or_insert(LinearFit { origin: now, nanos, slope: 0.0 });
        self.messages += 1;
        let late = nanos.saturating_sub(line.at(now)) as f64;
        let forgets = FORGETS.max(1.0 / self.messages as f64);
        self.square += forgets * (late * late - self.square);
        let point = Point { at: now, nanos, weight: 1.0 };
        if let Some(bin) = &mut self.open {
            bin.push(point);
        } else {
            let number = now.div_euclid(BIN_NANOS);
            self.open = Some(Bin { number, messages: 1, lowest: point, second: point });
        }
    }

    /// Time passes.
    pub(super) fn pass(&mut self, now: i64) -> Found {
        let number = now.div_euclid(BIN_NANOS);
        match self.open.take_if(|bin| bin.number != number) {
            Some(bin) => self.close(bin.fastest()),
            None => Found::Nothing,
        }
    }

    fn close(&mut self, fastest: Point) -> Found {
        let expected = self.line.map_or(fastest.nanos, |line| line.at(fastest.at));
        if fastest.nanos.saturating_sub(expected) > BELONGS_NANOS {
            self.raised.push(fastest.nanos);
            if self.raised.len() < ELSEWHERE {
                return Found::Nothing;
            }
            let raised = std::mem::take(&mut self.raised);
            return raised.into_iter().min().map_or(Found::Nothing, Found::Elsewhere);
        }
        self.raised.clear();
        let oldest = fastest.at.saturating_sub(BIN_NANOS * BINS as i64);
        self.bins.retain(|point| point.at > oldest);
        self.bins.push_back(fastest);
        self.line = LinearFit::fit(self.bins.iter().copied(), EXPECTILE).map(|(line, _)| line);
        Found::LinearFit
    }
}

impl Bin {
    fn push(&mut self, point: Point) {
        self.messages += 1;
        if point.nanos < self.lowest.nanos {
            self.second = std::mem::replace(&mut self.lowest, point);
        } else if point.nanos < self.second.nanos || self.messages == 2 {
            self.second = point;
        }
    }

    fn fastest(&self) -> Point {
        if self.messages > 3 { self.second } else { self.lowest }
    }
}
