//! Bursts of probes; the fastest probe of each burst is used.

use std::collections::VecDeque;

use super::super::Probe;
use super::line::{LinearFit, Point};

/// The longest duration of a burst [ns].
const BURST_NANOS: i64 = 1_000_000_000;
/// The number of bursts that are kept.
const BURSTS: usize = 30;
/// How long after the last burst the offset remains valid [ns].
const STALE_NANOS: i64 = 60_000_000_000;
/// The longest round trip that is used [s].
const SLOWEST_SECS: f64 = 1.0;
/// The largest offset that is accepted [s]: 290 years, the range of timestamps.
const FURTHEST_SECS: f64 = 9.2e9;
/// The deviation, beyond the uncertainty, at which a burst belongs to a different clock [ns].
const ELSEWHERE_NANOS: f64 = 2_000_000.0;
/// The number of bursts from which the skew is known.
const SKEW_BURSTS: usize = 4;
/// The assumed drift of a clock while its skew is unknown [1].
const SKEWED: f64 = 5e-4;
/// The smallest uncertainty of a probe [ns].
const FINEST: f64 = 1_000.0;

/// The last bursts of probes.
#[derive(Clone, Debug, Default)]
pub(super) struct Bursts {
    open: Option<(i64, Exchange)>,
    closed: VecDeque<Exchange>,
    /// The last burst, if it deviated from the line.
    astray: Option<Exchange>,
    /// The deviation of the last burst from the previous line, and how fast it may have grown.
    away: Away,
    /// When a burst last agreed with the line.
    agreed: Option<i64>,
    line: Option<LinearFit>,
    spread: f64,
    /// How far the clock was set forward, if the last burst has shown that [ns].
    set: Option<i64>,
}

/// The fastest probe of a burst.
#[derive(Clone, Copy, Debug)]
struct Exchange {
    at: i64,
    offset: i64,
    /// The uncertainty of the offset [ns].
    uncertainty: f64,
}

/// A deviation from the line.
#[derive(Clone, Copy, Debug, Default)]
struct Away {
    nanos: f64,
    /// The rate at which it may grow [1].
    rate: f64,
}

impl Away {
    fn between(exchange: &Exchange, at: i64, offset: i64) -> Away {
        let nanos = exchange.offset.saturating_sub(offset) as f64;
        let since = exchange.at.saturating_sub(at).max(BURST_NANOS) as f64;
        Away { nanos: nanos.abs(), rate: nanos.abs() / since }
    }
}

impl Bursts {
    /// The most memory that it allocates [B].
    pub(super) const BYTES: usize = BURSTS.next_power_of_two() * size_of::<Exchange>();

    /// The offset of the other clock, positive when ahead [ns]; `None` without a recent burst.
    pub(super) fn line(&self) -> Option<LinearFit> {
        self.line
    }

    /// Whether the slope was estimated rather than assumed.
    pub(super) fn knows_skew(&self) -> bool {
        self.closed.len() >= SKEW_BURSTS
    }

    /// The uncertainty of the line [ns]; NaN without one.
    pub(super) fn uncertainty_nanos(&self) -> f64 {
        let lowest = self.closed.iter().map(|each| each.uncertainty).reduce(f64::min);
        lowest.map_or(f64::NAN, |lowest| lowest + self.spread)
    }

    /// How far the clock may be from the line according to the last burst and the time since then [ns].
    pub(super) fn doubt_nanos(&self, now: i64) -> f64 {
        let newest = self.astray.as_ref().or(self.closed.back());
        let Some(newest) = newest else { return 0.0 };
        let rate = if self.knows_skew() { self.away.rate } else { self.away.rate.max(SKEWED) };
        self.away.nanos + rate * now.saturating_sub(newest.at).max(0) as f64
    }

    /// When a burst last agreed with the line; `None` before the first.
    pub(super) fn agreed(&self) -> Option<i64> {
        self.agreed
    }

    /// How far the clock was set forward, if this has become known since the last call [ns].
    pub(super) fn take_set(&mut self) -> Option<i64> {
        self.set.take()
    }

    /// Takes a probe. Implausible ones are ignored.
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

    /// Advances to `now`; returns whether the line has changed.
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
        self.away = Away::default();
        let mut agreed = self.line.map(|_| exchange.at);
        if let Some(line) = self.line.filter(|_| self.is_elsewhere(&exchange)) {
            // A single deviating burst may be due to a delay in one direction; two mean that the clock was
            // set.
            let Some(before) = self.astray.replace(exchange) else {
                let last = self.closed.back().map_or(line.origin, |last| last.at);
                self.away = Away::between(&exchange, last, line.at(exchange.at));
                return;
            };
            let apart = Away::between(&exchange, before.at, before.offset);
            let unsure = before.uncertainty + exchange.uncertainty + ELSEWHERE_NANOS;
            if apart.nanos > unsure {
                self.away = apart;
            }
            self.closed.clear();
            self.set = Some(exchange.offset.saturating_sub(line.at(exchange.at)));
            agreed = None;
        }
        self.astray = None;
        self.agreed = agreed;
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
        let fitted = LinearFit::fit(points, 0.5);
        self.line = fitted.map(|(line, _)| line);
        self.spread = fitted.map_or(0.0, |(_, spread)| spread);
    }
}
