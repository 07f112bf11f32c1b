//! The lower envelope of the delays of a computer's messages.

use std::collections::VecDeque;

use super::line::{LinearFit, Point};

/// The duration of a bin, which contributes its fastest message [ns].
const BIN_NANOS: i64 = 2_000_000_000;
/// The number of bins kept: two minutes.
const BINS: usize = 60;
/// How far the fastest message of a bin may be above the envelope and still belong to it [ns].
const BELONGS_NANOS: i64 = 100_000_000;
/// The number of consecutive bins above the envelope after which it has moved.
const ELSEWHERE: usize = 10;
/// The expectile of delays that the envelope follows.
const EXPECTILE: f64 = 0.05;
/// The number of bins from which the skew is known.
const SKEW_BINS: usize = 8;
/// The forgetting factor of the spread, per message.
const FORGETS: f64 = 0.005;

/// The lower envelope of delays: the delay of the fastest messages, according to their timestamps.
#[derive(Clone, Debug, Default)]
pub(super) struct Envelope {
    line: Option<LinearFit>,
    bins: VecDeque<Point>,
    open: Option<Bin>,
    /// The lowest delays of the last bins above the envelope.
    raised: Vec<i64>,
    messages: u64,
    square: f64,
}

/// The bin that is being filled.
#[derive(Clone, Copy, Debug)]
struct Bin {
    number: i64,
    messages: u64,
    lowest: Point,
    /// The second lowest: a single wrong timestamp must not pass for the fastest message.
    second: Point,
}

/// The result of advancing time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing has changed.
    Nothing,
    /// The line was refitted.
    LinearFit,
    /// All delays have been above the line for long; the lowest of them [ns].
    Elsewhere(i64),
}

impl Envelope {
    /// The most memory that it allocates [B].
    pub(super) const BYTES: usize = (BINS + 1).next_power_of_two() * size_of::<Point>()
        + ELSEWHERE.next_power_of_two() * size_of::<i64>();

    /// Creates an envelope from one known point.
    pub(super) fn new(now: i64, nanos: i64) -> Envelope {
        let line = Some(LinearFit { origin: now, nanos, slope: 0.0 });
        Envelope { line, ..Envelope::default() }
    }

    /// Continues with delays that are `nanos` longer from now on, as after the clock was set [ns].
    pub(super) fn shift(&mut self, now: i64, nanos: i64) {
        let Some(line) = self.line else { return };
        let delay = line.at(now).saturating_add(nanos);
        self.line = Some(LinearFit { origin: now, nanos: delay, slope: 0.0 });
        self.bins.clear();
        self.raised.clear();
        self.open = None;
    }

    /// The delay of the fastest messages; `None` until it is known.
    pub(super) fn line(&self) -> Option<LinearFit> {
        self.line
    }

    /// Whether the slope was estimated rather than assumed.
    pub(super) fn knows_skew(&self) -> bool {
        self.bins.len() >= SKEW_BINS
    }

    /// The root mean square of delays above the envelope [ns]; NaN before the first message.
    pub(super) fn spread_nanos(&self) -> f64 {
        if self.messages == 0 { f64::NAN } else { self.square.sqrt() }
    }

    /// Takes the delay of a message [ns]; the first one starts the envelope if there is none yet.
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

    /// Advances to `now`, which may close a bin.
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
