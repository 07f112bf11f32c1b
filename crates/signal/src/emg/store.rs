//! The store of all channels, one row per eighth of a second.

use std::collections::VecDeque;

use super::Thresholds;
use super::channel::{Cell, Channel, Taken};
use super::cocontraction::cocontraction;
use super::faults::Phases;
use super::frames::Frames;
use crate::analysis::Span;
use crate::error::SignalError;

/// The length and the hop of frames [s].
pub(super) const FRAME_SECS: f64 = 0.25;
pub(super) const HOP_SECS: f64 = 0.125;
/// The smallest share of usable samples for a frame to have features.
pub(super) const LEAST_USABLE: f64 = 0.9;

/// The time ranges of a row [ns]: its samples, and the frame that ends with it.
#[expect(clippy::struct_field_names, reason = "a number's name says its unit")]
#[derive(Clone, Copy, Debug)]
struct Row {
    begin_ns: i64,
    last_ns: i64,
    frame_begin_ns: i64,
}

/// Two antagonists, with the MVC of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) channels: [usize; 2],
    pub(super) mvc: Option<[f64; 2]>,
}

/// The sum of the co-contraction index, and the number of samples.
type Contraction = [f64; 2];

#[derive(Clone, Debug)]
pub(super) struct Store {
    rate_hz: f64,
    frames: Frames,
    phases: Phases,
    channels: Vec<Channel>,
    pairs: Vec<Pair>,
    /// The times of the newest samples, one frame.
    times_ns: VecDeque<i64>,
    count: usize,
    next_frame: usize,
    begin_ns: i64,
    contractions_now: Vec<Contraction>,
    rows: VecDeque<Row>,
    cells: VecDeque<Cell>,
    contractions: VecDeque<Contraction>,
    /// The start of each burst [ns], and the burst's channel.
    bursts: VecDeque<(i64, usize)>,
}

impl Store {
    pub(super) fn new(
        rate_hz: f64,
        thresholds: Thresholds,
        channels: usize,
        pairs: Vec<Pair>,
    ) -> Result<Store, SignalError> {
        let frames = Frames::new(rate_hz, FRAME_SECS, HOP_SECS)?.with_thresholds(thresholds);
        let length = frames.length();
        let channels = (0..channels).map(|_| Channel::new(rate_hz, length));
        Ok(Store {
            rate_hz,
            phases: Phases::new(rate_hz),
            channels: channels.collect::<Result<_, _>>()?,
            times_ns: VecDeque::with_capacity(length + 1),
            count: 0,
            next_frame: length,
            begin_ns: 0,
            contractions_now: vec![[0.0; 2]; pairs.len()],
            pairs,
            frames,
            rows: VecDeque::new(),
            cells: VecDeque::new(),
            contractions: VecDeque::new(),
            bursts: VecDeque::new(),
        })
    }

    /// Takes in the next sample of all channels.
    pub(super) fn push(&mut self, at_ns: i64, taken: &[Taken]) {
        if self.channels.first().is_some_and(|channel| channel.cell.samples == 0.0) {
            self.begin_ns = at_ns;
        }
        if self.times_ns.len() == self.frames.length() {
            self.times_ns.pop_front();
        }
        self.times_ns.push_back(at_ns);
        self.phases.advance();
        for (channel, &taken) in self.channels.iter_mut().zip(taken) {
            channel.push(taken, &self.phases);
        }
        self.contract(taken);
        self.count += 1;
        if self.count == self.next_frame {
            self.next_frame += self.frames.hop();
            self.finish_row(at_ns);
        }
    }

    fn contract(&mut self, taken: &[Taken]) {
        for (pair, now) in self.pairs.iter().zip(&mut self.contractions_now) {
            let (Some(mvc), [one, other]) = (pair.mvc, pair.channels) else { continue };
            let is_usable = [one, other].iter().all(|&k| crate::gaps::is_usable(taken[k].raw));
            let index = cocontraction(taken[one].envelope / mvc[0], taken[other].envelope / mvc[1]);
            if let Some(index) = index.filter(|_| is_usable) {
                *now = [now[0] + index, now[1] + 1.0];
            }
        }
    }

    fn finish_row(&mut self, last_ns: i64) {
        let frame_begin_ns = self.times_ns.front().copied().unwrap_or(last_ns);
        self.rows.push_back(Row { begin_ns: self.begin_ns, last_ns, frame_begin_ns });
        let frames = &mut self.frames;
        self.cells.extend(self.channels.iter_mut().map(|channel| channel.finish(frames)));
        for now in &mut self.contractions_now {
            self.contractions.push_back(std::mem::take(now));
        }
    }

    pub(super) fn begin_burst(&mut self, at_ns: i64, channel: usize) {
        self.bursts.push_back((at_ns, channel));
    }

    /// The number of a channel's bursts that begin in a span.
    pub(super) fn bursts(&self, span: Span, channel: usize) -> usize {
        let inside = |&&(at_ns, of): &&(i64, usize)| of == channel && span.holds(at_ns);
        self.bursts.iter().filter(inside).count()
    }

    /// The rows that overlap a span, each with the share of it inside the span; the last may be incomplete.
    fn parts(&self, span: Span) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = self.rows.partition_point(|row| row.last_ns < span.begin_ns);
        let period_ns = 1e9 / self.rate_hz;
        let now = self.times_ns.back().map(|&last_ns| (self.begin_ns, last_ns));
        let now = now.filter(|_| self.channels.iter().any(|channel| channel.cell.samples > 0.0));
        let times = self.rows.iter().map(|row| (row.begin_ns, row.last_ns)).chain(now);
        let parts = times.enumerate().skip(first);
        let parts = parts.take_while(move |(_, (begin_ns, _))| *begin_ns < span.end_ns);
        parts.map(move |(index, (begin_ns, last_ns))| {
            let since = |at_ns: i64| at_ns.saturating_sub(begin_ns) as f64;
            let length = since(last_ns) + period_ns;
            let overlap = since(span.end_ns).min(length) - since(span.begin_ns).max(0.0);
            (index, (overlap / length).clamp(0.0, 1.0))
        })
    }

    fn cell(&self, row: usize, channel: usize) -> &Cell {
        let place = row * self.channels.len() + channel;
        self.cells.get(place).unwrap_or(&self.channels[channel].cell)
    }

    /// The sums of a channel over a span, without features.
    pub(super) fn sums(&self, span: Span, channel: usize) -> Cell {
        let mut sums = Cell::default();
        for (row, share) in self.parts(span) {
            let cell = self.cell(row, channel);
            sums.samples += share * cell.samples;
            sums.envelope += share * cell.envelope;
            sums.faults = sums.faults.with(&cell.faults.scaled(share));
        }
        sums
    }

    /// The mean co-contraction of a pair in a span; `None` without a sample.
    pub(super) fn contraction(&self, span: Span, pair: usize) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for (row, share) in self.parts(span) {
            let place = row * self.pairs.len() + pair;
            let now = self.contractions.get(place).unwrap_or(&self.contractions_now[pair]);
            (sum, count) = (sum + share * now[0], count + share * now[1]);
        }
        (count > 0.0).then(|| sum / count)
    }

    /// The cells of the frames that lie in a span, with the times of their last samples [ns].
    pub(super) fn frames_in(
        &self,
        span: Span,
        channel: usize,
    ) -> impl Iterator<Item = (i64, &Cell)> {
        let first = self.rows.partition_point(|row| row.frame_begin_ns < span.begin_ns);
        let rows = self.rows.iter().enumerate().skip(first);
        let rows = rows.take_while(move |(_, row)| row.last_ns < span.end_ns);
        rows.map(move |(index, row)| (row.last_ns, self.cell(index, channel)))
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    pub(super) fn forget(&mut self, before_ns: i64) {
        while self.rows.front().is_some_and(|row| row.last_ns < before_ns) {
            self.rows.pop_front();
            self.cells.drain(..self.channels.len());
            self.contractions.drain(..self.pairs.len());
        }
        while self.bursts.front().is_some_and(|&(at_ns, _)| at_ns < before_ns) {
            self.bursts.pop_front();
        }
    }
}
