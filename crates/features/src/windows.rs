//! The newest readings of a stream, in windows of several lengths.

use teampulse_core::data::Reason;
use teampulse_core::time::Time;
use teampulse_signal::coverage::coverage;
use teampulse_signal::window::Window;

use crate::whole_seconds::WholeSeconds;

/// The most readings that a window keeps; a faster stream is thinned evenly.
const MOST_READINGS: usize = 600;

/// The share of a window that must have data before a value is given.
const LEAST_COVERAGE: f64 = 0.5;

/// The newest readings of a stream, in windows of several lengths that end at whole seconds.
#[derive(Debug)]
pub(crate) struct Windows<T> {
    each: Vec<(f64, Window<T>)>,
    first: Option<Time>,
    seconds: WholeSeconds,
}

/// One window at its end.
pub(crate) struct View<'a, T> {
    /// Length of the window [s].
    pub(crate) secs: f64,
    /// The readings in the order of their times, each with its time before the end [s], ≤ 0.
    pub(crate) readings: Vec<(f64, &'a T)>,
    /// The share of the window with data [0..1].
    pub(crate) coverage: f64,
    /// The reason why the window has no value; `None` when it has enough data.
    pub(crate) lack: Option<Reason>,
}

impl<T: Copy> Windows<T> {
    /// Empty windows of these lengths [s].
    pub(crate) fn new(lengths_secs: &[f64]) -> Windows<T> {
        let window = |&secs: &f64| (secs, Window::new((secs * 1e9) as i64, MOST_READINGS));
        let each = lengths_secs.iter().map(window).collect();
        Windows { each, first: None, seconds: WholeSeconds::default() }
    }

    /// Takes in a reading at its true time, whether it arrived in order or late.
    pub(crate) fn insert(&mut self, measured: Time, reading: T) {
        self.see(measured);
        for (_, window) in &mut self.each {
            window.insert(measured.nanos(), reading);
        }
    }

    /// Takes in a reading at its true time; two that share a slot are combined with `merged`.
    pub(crate) fn insert_merged(&mut self, measured: Time, reading: T, merged: fn(T, T) -> T) {
        self.see(measured);
        for (_, window) in &mut self.each {
            window.insert_merged(measured.nanos(), reading, |held, new| *held = merged(*held, new));
        }
    }

    /// The whole second that has passed by `now`, at which all windows now end; `None` in between
    /// and before the first reading.
    pub(crate) fn due(&mut self, now: Time) -> Option<Time> {
        let end = self.seconds.passed(now)?;
        for (_, window) in &mut self.each {
            window.advance(end.nanos());
        }
        self.first.map(|_| end)
    }

    /// The windows at their `end`, in the order of their lengths.
    pub(crate) fn views(&self, end: Time) -> impl Iterator<Item = View<'_, T>> {
        self.each.iter().map(move |(secs, window)| self.view(*secs, window, end))
    }

    fn view<'a>(&self, secs: f64, window: &'a Window<T>, end: Time) -> View<'a, T> {
        let times_ns: Vec<i64> = window.iter().map(|(at_ns, _)| at_ns).collect();
        let begin_ns = end.nanos().saturating_sub((secs * 1e9) as i64);
        let coverage = coverage(&times_ns, begin_ns, end.nanos());
        let is_young = self.first.is_none_or(|first| first.nanos() > begin_ns);
        let reason = if is_young { Reason::Short } else { Reason::Gap };
        let before_end = |at_ns: i64| Time::from_nanos(at_ns).secs_since(end);
        View {
            secs,
            readings: window.iter().map(|(at_ns, reading)| (before_end(at_ns), reading)).collect(),
            coverage,
            lack: (coverage < LEAST_COVERAGE).then_some(reason),
        }
    }

    fn see(&mut self, measured: Time) {
        self.first = Some(self.first.map_or(measured, |first| first.min(measured)));
    }
}

impl<T> View<'_, T> {
    /// A number of each reading, in the order of their times.
    pub(crate) fn numbers(&self, number: impl Fn(&T) -> f64) -> Vec<f64> {
        self.readings.iter().map(|(_, reading)| number(reading)).collect()
    }

    /// The times of the readings before the end [s], ascending to at most 0.
    pub(crate) fn times_secs(&self) -> Vec<f64> {
        self.readings.iter().map(|(secs, _)| *secs).collect()
    }

    /// The share of the readings for which the predicate holds [0..1]; 0 without readings.
    pub(crate) fn share(&self, is: impl Fn(&T) -> bool) -> f64 {
        let count = self.readings.iter().filter(|(_, reading)| is(reading)).count();
        count as f64 / self.readings.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(range: std::ops::Range<i32>) -> Windows<f64> {
        let mut windows = Windows::new(&[10.0]);
        assert_eq!(windows.due(Time::from_stamp(0, 0)), None);
        for secs in range {
            windows.insert(Time::from_stamp(secs, 500_000_000), f64::from(secs));
            windows.due(Time::from_stamp(secs + 1, 0));
        }
        windows
    }

    fn lack_at(windows: &mut Windows<f64>, secs: i32) -> Option<Reason> {
        let end = windows.due(Time::from_stamp(secs, 0)).unwrap_or(Time::from_stamp(secs, 0));
        windows.views(end).next().unwrap().lack
    }

    #[test]
    fn a_young_window_is_short_and_a_torn_one_has_a_gap() {
        assert_eq!(lack_at(&mut filled(0..3), 3), Some(Reason::Short));
        assert_eq!(lack_at(&mut filled(0..20), 20), None);
        assert_eq!(lack_at(&mut filled(0..20), 28), Some(Reason::Gap));
        assert_eq!(lack_at(&mut filled(0..20), 1000), Some(Reason::Gap));
    }

    #[test]
    fn half_a_window_is_enough() {
        assert_eq!(lack_at(&mut filled(0..4), 4), Some(Reason::Short));
        assert_eq!(lack_at(&mut filled(0..5), 5), None);
    }

    #[test]
    fn a_fast_stream_keeps_a_bounded_number_of_readings() {
        let mut windows = Windows::new(&[10.0]);
        for k in 0..20_000 {
            let now = Time::from_nanos(k * 1_000_000);
            windows.due(now);
            windows.insert(now, k);
        }
        let end = windows.due(Time::from_stamp(20, 0)).unwrap();
        let view = windows.views(end).next().unwrap();
        assert!((MOST_READINGS - 5..=MOST_READINGS).contains(&view.readings.len()));
        assert_eq!(view.lack, None);
    }

    #[test]
    fn times_count_back_from_the_end() {
        let windows = filled(0..20);
        let view = windows.views(Time::from_stamp(20, 0)).next().unwrap();
        assert_eq!(view.times_secs().first(), Some(&-9.5));
        assert_eq!(view.times_secs().last(), Some(&-0.5));
        assert_eq!(view.share(|&secs| secs >= 15.0), 0.5);
    }
}
