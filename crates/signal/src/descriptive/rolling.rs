//! Descriptive statistics of the newest samples of a stream, kept up to date.

use std::collections::VecDeque;
use std::ops::Range;

use super::kept::Kept;
use super::middle::Middle;
use super::moments::Moments;
use super::summary::{Summary, describe};
use crate::analysis::Span;
use crate::coverage::coverage;
use crate::gaps::is_usable;

/// Descriptive statistics of a stream in sliding windows of several lengths.
///
/// Windows end every hop after the first sample, or less often, as set by their [`Pace`]. The results equal
/// those of [`describe`] for the samples of each window, at a cost that grows with the number of samples
/// that enter and leave, and with the share of the window near its median and MAD: moments and extremes are
/// merged from those of single hops, and medians are searched for among the values near the previous ones;
/// the whole window is scanned only when they have moved away from there. The results are a function of the
/// samples and their order alone. Memory is bounded by the longest window, or by what is
/// [kept](Self::keep_from): each sample is held once, and those near the middle of a window twice.
///
/// ```
/// use teampulse_signal::descriptive::{Pace, Rolling};
///
/// const SECOND_NS: i64 = 1_000_000_000;
/// let pace = Pace { length_ns: 3 * SECOND_NS, hops: 1 };
/// let mut rolling = Rolling::new(1.0, 1, &[pace], SECOND_NS);
/// let mut medians = Vec::new();
/// for (secs, value) in (0..).zip([5.0, 1.0, 3.0, f64::NAN, 2.0]) {
///     // The windows that end before this sample.
///     while rolling.advance(secs * SECOND_NS).is_some() {
///         medians.push(rolling.window(0).channels[0].summary.map(|summary| summary.median));
///     }
///     rolling.push(secs * SECOND_NS, &[value]);
/// }
/// assert_eq!(medians, [Some(5.0), Some(3.0), Some(3.0), Some(2.0)]);
/// ```
#[derive(Clone, Debug)]
pub struct Rolling {
    /// The sampling rate [Hz]; 0 for irregular samples.
    rate_hz: f64,
    hop_ns: i64,
    begin_ns: Option<i64>,
    newest_ns: i64,
    /// The next window end.
    end_ns: i64,
    keep_from_ns: i64,
    /// Nothing before this time is held.
    held_since_ns: i64,
    kept: Kept,
    hops: VecDeque<Hop>,
    windows: Vec<Window>,
}

/// A window's length and how often it ends.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Pace {
    /// The length of the window [ns].
    pub length_ns: i64,
    /// The number of hops between successive ends; at least one.
    pub hops: i64,
}

/// The statistics of the samples of one hop, for each channel.
#[derive(Clone, Debug)]
struct Hop {
    span: Span,
    courses: Box<[Moments]>,
    /// Whether samples were added since the statistics were computed.
    is_stale: bool,
}

/// A window, with the middle values of each channel.
#[derive(Clone, Debug)]
struct Window {
    pace: Pace,
    span: Span,
    middles: Vec<Middle>,
}

/// The statistics of a span.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The span.
    pub span: Span,
    /// Whether it began before the first sample.
    pub is_young: bool,
    /// The statistics of each channel.
    pub channels: Vec<Described>,
}

/// The statistics of a channel in a span.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Described {
    /// The share of the span that has data [0..1]: of the samples expected at the rate or, for irregular samples, of
    /// the time, judged by their [usual interval](coverage).
    pub coverage: f64,
    /// The statistics of the values; `None` without a usable value.
    pub summary: Option<Summary>,
}

/// A span before any sample.
const NEVER: Span = Span { begin_ns: i64::MIN, end_ns: i64::MIN };

impl Rolling {
    /// Creates the statistics of `channels` channels at `rate_hz` [Hz] (0 for irregular samples), windows of these
    /// paces, and hops of `hop_ns` [ns].
    pub fn new(rate_hz: f64, channels: usize, paces: &[Pace], hop_ns: i64) -> Rolling {
        let window = |pace: &Pace| Window {
            pace: Pace { length_ns: pace.length_ns.max(1), hops: pace.hops.max(1) },
            span: NEVER,
            middles: vec![Middle::default(); channels],
        };
        Rolling {
            rate_hz,
            hop_ns: hop_ns.max(1),
            begin_ns: None,
            newest_ns: i64::MIN,
            end_ns: 0,
            keep_from_ns: i64::MAX,
            held_since_ns: i64::MIN,
            kept: Kept::new(channels),
            hops: VecDeque::new(),
            windows: paces.iter().map(window).collect(),
        }
    }

    /// Changes the rate [Hz] from now on.
    pub fn set_rate_hz(&mut self, rate_hz: f64) {
        self.rate_hz = rate_hz;
    }

    /// Keeps all samples from a time [ns] on, for [`describe`](Self::describe).
    pub fn keep_from(&mut self, from_ns: i64) {
        self.keep_from_ns = from_ns;
    }

    /// Drops everything before a time [ns] and reports no windows that start before it, to bound memory. The
    /// limit never moves back.
    pub fn hold_since(&mut self, since_ns: i64) {
        self.held_since_ns = self.held_since_ns.max(since_ns);
    }

    /// The time of the first sample [ns]; `None` before it.
    pub fn begin_ns(&self) -> Option<i64> {
        self.begin_ns
    }

    /// The time of the newest sample [ns]; `None` before the first.
    pub fn newest_ns(&self) -> Option<i64> {
        self.begin_ns.map(|_| self.newest_ns)
    }

    /// If the next hop ends at or before `at_ns` [ns], advances the windows that [end](Self::ends) there to that time,
    /// and returns it; otherwise returns `None`. Before each [`push`](Self::push), call this until it returns `None`.
    ///
    /// No windows end in a gap that is longer than the longest window.
    pub fn advance(&mut self, at_ns: i64) -> Option<i64> {
        if self.begin_ns.is_none() || at_ns < self.end_ns || self.end_ns == i64::MAX {
            return None;
        }
        if at_ns.saturating_sub(self.newest_ns) > self.longest_ns() {
            self.begin_anew(at_ns);
            return None;
        }
        let end_ns = self.end_ns;
        self.close(end_ns);
        self.end_ns = end_ns.saturating_add(self.hop_ns);
        Some(end_ns)
    }

    /// Takes in a sample measured at `at_ns` [ns]. A late sample is inserted into all windows still to be
    /// reported.
    pub fn push(&mut self, at_ns: i64, numbers: &[f64]) {
        if self.begin_ns.is_none() {
            self.begin_ns = Some(at_ns);
            self.end_ns = at_ns.saturating_add(self.hop_ns);
        }
        self.newest_ns = self.newest_ns.max(at_ns);
        self.kept.insert(at_ns, numbers);
        if at_ns < self.newest_ns {
            self.amend(at_ns);
        }
    }

    /// Whether a window, by index, last ended at a time [ns].
    pub fn ends(&self, place: usize, end_ns: i64) -> bool {
        self.windows[place].span.end_ns == end_ns
    }

    /// The statistics of a window, by index, at its last end.
    pub fn window(&mut self, place: usize) -> View {
        self.freshen();
        let span = self.windows[place].span;
        let mut middles = std::mem::take(&mut self.windows[place].middles);
        let describe = |(channel, middle)| self.described(channel, span, middle);
        let channels = middles.iter_mut().enumerate().map(describe).collect();
        self.windows[place].middles = middles;
        View { span, is_young: self.is_young(span), channels }
    }

    /// The statistics of any span, as far as its samples are kept.
    pub fn describe(&self, span: Span) -> View {
        let places = self.kept.places(span);
        let of_channel = |channel: usize| {
            let points = self.kept.points(channel, places.clone(), span.begin_ns);
            let (secs, values): (Vec<f64>, Vec<f64>) = points.unzip();
            let usable = values.iter().filter(|value| is_usable(**value)).count();
            let coverage = self.coverage(channel, span, usable);
            Described { coverage, summary: describe(&secs, &values) }
        };
        let channels = (0..self.kept.width()).map(of_channel).collect();
        View { span, is_young: self.is_young(span), channels }
    }

    fn longest_ns(&self) -> i64 {
        let lengths_ns = self.windows.iter().map(|window| window.pace.length_ns);
        lengths_ns.fold(self.hop_ns, i64::max)
    }

    /// The number of hops from the first sample to a window end [ns].
    fn hops_until(&self, end_ns: i64) -> i128 {
        let since_ns = i128::from(end_ns) - i128::from(self.begin_ns.unwrap_or(end_ns));
        since_ns / i128::from(self.hop_ns)
    }

    fn is_young(&self, span: Span) -> bool {
        self.begin_ns.is_none_or(|begin_ns| span.begin_ns < begin_ns)
    }

    fn begin_anew(&mut self, at_ns: i64) {
        let [at, end, hop] = [at_ns, self.end_ns, self.hop_ns].map(i128::from);
        let next = end + ((at - end).div_euclid(hop) + 1) * hop;
        self.end_ns = i64::try_from(next).unwrap_or(i64::MAX);
        self.hops.clear();
        self.windows.iter_mut().for_each(Window::clear);
    }

    fn close(&mut self, end_ns: i64) {
        let span = Span { begin_ns: end_ns.saturating_sub(self.hop_ns), end_ns };
        self.hops.push_back(Hop { span, courses: self.courses(span), is_stale: false });
        let number = self.hops_until(end_ns);
        for window in &mut self.windows {
            if window.span.begin_ns < self.held_since_ns {
                window.clear();
            }
            let is_held = end_ns.saturating_sub(window.pace.length_ns) >= self.held_since_ns;
            if is_held && number % i128::from(window.pace.hops) == 0 {
                window.slide(end_ns, &self.kept);
            }
        }
        let needed_ns = self.windows.iter().map(|window| window.needs_from_ns(end_ns));
        let before_ns = needed_ns.fold(end_ns.saturating_sub(self.longest_ns()), i64::min);
        let before_ns = before_ns.max(self.held_since_ns);
        while self.hops.front().is_some_and(|hop| hop.span.begin_ns < before_ns) {
            self.hops.pop_front();
        }
        self.kept.forget(before_ns.min(self.keep_from_ns).max(self.held_since_ns));
    }

    /// Marks what a late sample changes; it is recomputed with the next report, once for any number of late
    /// samples.
    fn amend(&mut self, at_ns: i64) {
        let place = self.hops.partition_point(|hop| hop.span.end_ns <= at_ns);
        if let Some(hop) = self.hops.get_mut(place).filter(|hop| hop.span.holds(at_ns)) {
            hop.is_stale = true;
        }
        for window in self.windows.iter_mut().filter(|window| window.span.holds(at_ns)) {
            window.middles.iter_mut().for_each(Middle::clear);
        }
    }

    fn freshen(&mut self) {
        for place in 0..self.hops.len() {
            if self.hops[place].is_stale {
                self.hops[place].courses = self.courses(self.hops[place].span);
                self.hops[place].is_stale = false;
            }
        }
    }

    fn courses(&self, span: Span) -> Box<[Moments]> {
        (0..self.kept.width()).map(|channel| self.course_of_samples(channel, span)).collect()
    }

    fn course_of_samples(&self, channel: usize, span: Span) -> Moments {
        let origin_ns = self.begin_ns.unwrap_or_default();
        Moments::of(self.kept.points(channel, self.kept.places(span), origin_ns))
    }

    /// Merges the hops in a span, and the samples before the first of them.
    fn moments(&self, channel: usize, span: Span) -> Moments {
        let first = self.hops.partition_point(|hop| hop.span.begin_ns < span.begin_ns);
        let until_ns = self.hops.get(first).map_or(span.end_ns, |hop| hop.span.begin_ns);
        let before = self.course_of_samples(channel, Span { end_ns: until_ns, ..span });
        let after = self.hops.partition_point(|hop| hop.span.end_ns <= span.end_ns);
        let hops = self.hops.range(first..after.max(first)).map(|hop| hop.courses[channel]);
        hops.fold(before, Moments::merged)
    }

    fn described(&self, channel: usize, span: Span, middle: &mut Middle) -> Described {
        let moments = self.moments(channel, span);
        let values = self.kept.values(channel, self.kept.places(span));
        let n = moments.count as usize;
        let summary = |(median, mad)| Summary {
            n,
            mean: moments.mean,
            sd: moments.sd(),
            median,
            mad,
            least: moments.least,
            greatest: moments.greatest,
            slope_per_sec: moments.slope_per_sec(),
        };
        let summary = middle.median_and_mad(n, &values).map(summary);
        Described { coverage: self.coverage(channel, span, n), summary }
    }

    fn coverage(&self, channel: usize, span: Span, usable: usize) -> f64 {
        if self.rate_hz > 0.0 {
            return (usable as f64 / (span.secs() * self.rate_hz).round().max(1.0)).min(1.0);
        }
        let places = self.kept.places(span);
        let points = self.kept.times_ns(places.clone()).zip(self.kept.values(channel, places));
        let usable = points.filter(|(_, value)| is_usable(*value));
        let times_ns: Vec<i64> = usable.map(|(at_ns, _)| at_ns).collect();
        coverage(&times_ns, span.begin_ns, span.end_ns)
    }
}

impl Window {
    /// Forgets the position of the window.
    fn clear(&mut self) {
        self.span = NEVER;
        self.middles.iter_mut().for_each(Middle::clear);
    }

    /// The time from which samples are needed [ns], at the end of a hop: removal looks the values up again.
    fn needs_from_ns(&self, end_ns: i64) -> i64 {
        if self.span == NEVER {
            end_ns.saturating_sub(self.pace.length_ns)
        } else {
            self.span.begin_ns
        }
    }

    /// Moves to another end, not before the last one.
    fn slide(&mut self, end_ns: i64, kept: &Kept) {
        let to = Span { begin_ns: end_ns.saturating_sub(self.pace.length_ns), end_ns };
        let from = std::mem::replace(&mut self.span, to);
        let gone = kept.places(Span { end_ns: to.begin_ns.min(from.end_ns), ..from });
        let new = kept.places(Span { begin_ns: to.begin_ns.max(from.end_ns), ..to });
        for (channel, middle) in self.middles.iter_mut().enumerate() {
            let values = |places: &Range<usize>| kept.values(channel, places.clone());
            middle.slide(&values(&gone), &values(&new));
        }
    }
}

#[cfg(test)]
mod tests;
