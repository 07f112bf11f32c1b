//! Bursts of probes: the fastest of each counts.

use std::collections::VecDeque;

use super::super::Probe;
use super::line::{Line, Point};

/// A burst lasts no longer than this [ns].
const BURST_NANOS: i64 = 1_000_000_000;
/// How many bursts count.
const BURSTS: usize = 30;
/// After so long without a burst the last ones say nothing of now [ns].
const STALE_NANOS: i64 = 60_000_000_000;
/// What takes longer says too little [s].
const SLOWEST_SECS: f64 = 1.0;
/// No clock is further off [s]: 290 years are what fits.
const FURTHEST_SECS: f64 = 9.2e9;
/// A burst that is elsewhere by more than is uncertain and this is another clock's [ns].
const ELSEWHERE_NANOS: f64 = 2_000_000.0;
/// From how many bursts on the skew is known.
const SKEW_BURSTS: usize = 4;
/// No exchange is better known than this [ns].
const FINEST: f64 = 1_000.0;

/// The last bursts of probes.
#[derive(Clone, Debug, Default)]
pub(super) struct Bursts {
    open: Option<(i64, Exchange)>,
    closed: VecDeque<Exchange>,
    /// Whether the last burst was elsewhere.
    astray: bool,
    line: Option<Line>,
    spread: f64,
}

/// The fastest exchange of a burst.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    at: i64,
    offset: i64,
    /// How far the offset may be wrong [ns].
    uncertainty: f64,
}

impl Bursts {
    /// What they allocate at most [B].
    pub(super) const BYTES: usize = BURSTS.next_power_of_two() * size_of::<Exchange>();

    /// How far the other clock is ahead [ns]; `None` where no burst tells.
    pub(super) fn line(&self) -> Option<Line> {
        self.line
    }

    /// Whether its slope was found, not only assumed.
    pub(super) fn knows_skew(&self) -> bool {
        self.closed.len() >= SKEW_BURSTS
    }

    /// How far the line may be wrong [ns]; NaN where there is none.
    pub(super) fn uncertainty_nanos(&self) -> f64 {
        let lowest = self.closed.iter().map(|each| each.uncertainty).reduce(f64::min);
        lowest.map_or(f64::NAN, |lowest| lowest + self.spread)
    }

    /// A probe has ended. What is absurd is passed over.
    pub(super) fn push(&mut self, probe: &Probe) {
        let sound = probe.offset_secs.abs() <= FURTHEST_SECS
            && (0.0..=SLOWEST_SECS).contains(&probe.round_trip_secs);
        if !sound {
            return;
        }
        let exchange = Exchange {
            at: probe.arrival,
            offset: (probe.offset_secs * 1e9) as i64,
            uncertainty: (probe.round_trip_secs * 0.5e9).max(FINEST),
        };
        match &mut self.open {
            Some((_, best)) if best.uncertainty <= exchange.uncertainty => {}
            Some((_, best)) => *best = exchange,
            None => self.open = Some((probe.arrival, exchange)),
        }
    }

    /// Time passes; says whether the line is another now.
    pub(super) fn pass(&mut self, now: i64) -> bool {
        let ended = |(began, _): &mut (i64, Exchange)| now.saturating_sub(*began) > BURST_NANOS;
        if let Some((_, exchange)) = self.open.take_if(ended) {
            self.close(exchange);
            return true;
        }
        let is_stale = |last: &Exchange| now.saturating_sub(last.at) > STALE_NANOS;
        let stale = self.closed.back().is_some_and(is_stale);
        if stale {
            *self = Bursts { open: self.open, ..Bursts::default() };
        }
        stale
    }

    fn close(&mut self, exchange: Exchange) {
        if self.is_elsewhere(&exchange) {
            // One may be an exchange that stalled on one way only; two are a clock that was set.
            if !std::mem::replace(&mut self.astray, true) {
                return;
            }
            self.closed.clear();
        }
        self.astray = false;
        if self.closed.len() == BURSTS {
            self.closed.pop_front();
        }
        self.closed.push_back(exchange);
        self.fit();
    }

    fn is_elsewhere(&self, exchange: &Exchange) -> bool {
        let Some(line) = self.line else { return false };
        let away = exchange.offset.saturating_sub(line.at(exchange.at)) as f64;
        away.abs() > self.uncertainty_nanos() + exchange.uncertainty + ELSEWHERE_NANOS
    }

    fn fit(&mut self) {
        let lowest = self.closed.iter().map(|each| each.uncertainty).fold(f64::MAX, f64::min);
        let points = self.closed.iter().map(|each| {
            let weight = (lowest / each.uncertainty).powi(2);
            Point { at: each.at, nanos: each.offset, weight }
        });
        let fitted = Line::fit(points, 0.5);
        self.line = fitted.map(|(line, _)| line);
        self.spread = fitted.map_or(0.0, |(_, spread)| spread);
    }
}
