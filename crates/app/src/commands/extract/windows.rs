//! Successive windows of a recording.

use teampulse_signal::analysis::Span;

/// Windows of equal length that start at regular intervals from the start of a recording.
pub struct Windows {
    begin_ns: i64,
    /// `None` for a single window.
    lengths: Option<Lengths>,
    /// The number of hops before the start of the next window.
    next: i64,
}

/// The length of windows and the hop between their starts [ns].
#[derive(Clone, Copy, Debug)]
pub struct Lengths {
    pub window_ns: i64,
    pub hop_ns: i64,
}

impl Lengths {
    /// The first time at which a live analysis reports, so that one report falls on the end of the first window [ns
    /// after the start].
    pub fn first_ns(self) -> i64 {
        (self.window_ns - 1).rem_euclid(self.hop_ns) + 1
    }

    /// Windows of `window_secs` [s] that start every `hop_secs` [s], or without overlap.
    pub fn new(window_secs: Option<f64>, hop_secs: Option<f64>) -> Option<Lengths> {
        let nanos = |secs: f64| (secs * 1e9).round() as i64;
        let window_ns = nanos(window_secs?);
        Some(Lengths { window_ns, hop_ns: hop_secs.map_or(window_ns, nanos) })
    }
}

impl Windows {
    /// Creates the windows of a recording that starts at this time [ns].
    pub fn new(begin_ns: i64, lengths: Option<Lengths>) -> Windows {
        Windows { begin_ns, lengths, next: 0 }
    }

    /// Whether a reported window is one of these windows; windows up to it are not reported again.
    pub fn take(&mut self, span: Span) -> bool {
        let Some(Lengths { hop_ns, .. }) = self.lengths else { return false };
        let from_begin_ns = span.begin_ns - self.begin_ns;
        if from_begin_ns < 0 || from_begin_ns % hop_ns != 0 {
            return false;
        }
        self.next = from_begin_ns / hop_ns + 1;
        true
    }

    /// Skips windows that end before a time [ns], as there are no data for them.
    pub fn skip_until(&mut self, end_ns: i64) {
        let Some(Lengths { window_ns, hop_ns }) = self.lengths else { return };
        let from_first_ns = end_ns - self.begin_ns - window_ns;
        self.next = self.next.max(from_first_ns.div_euclid(hop_ns));
    }

    /// Returns the remaining windows of a recording that ends at this time [ns]: those that end by then, and a shorter
    /// last one if they do not reach its end.
    pub fn rest(mut self, end_ns: i64) -> Vec<Span> {
        let Some(Lengths { window_ns, hop_ns }) = self.lengths else {
            return vec![Span { begin_ns: self.begin_ns, end_ns }];
        };
        let span = |number: i64| {
            let begin_ns = self.begin_ns + number * hop_ns;
            Span { begin_ns, end_ns: begin_ns + window_ns }
        };
        let mut rest = Vec::new();
        while span(self.next).end_ns <= end_ns {
            rest.push(span(self.next));
            self.next += 1;
        }
        let told_until_ns = if self.next > 0 { span(self.next - 1).end_ns } else { self.begin_ns };
        if told_until_ns < end_ns && span(self.next).begin_ns < end_ns {
            rest.push(Span { end_ns, ..span(self.next) });
        }
        rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEC: i64 = 1_000_000_000;

    fn reported(window: Option<f64>, hop: Option<f64>, end_secs: i64) -> Vec<(i64, i64)> {
        let rest = Windows::new(3 * SEC, Lengths::new(window, hop)).rest((3 + end_secs) * SEC);
        rest.iter().map(|span| (span.begin_ns / SEC - 3, span.end_ns / SEC - 3)).collect()
    }

    #[test]
    fn without_a_length_there_is_one_window() {
        assert_eq!(reported(None, None, 5), [(0, 5)]);
    }

    #[test]
    fn the_remainder_is_a_shorter_window() {
        assert_eq!(reported(Some(2.0), None, 5), [(0, 2), (2, 4), (4, 5)]);
        assert_eq!(reported(Some(2.0), None, 4), [(0, 2), (2, 4)]);
        assert_eq!(reported(Some(9.0), None, 4), [(0, 4)]);
    }

    #[test]
    fn windows_may_overlap() {
        assert_eq!(reported(Some(3.0), Some(1.0), 5), [(0, 3), (1, 4), (2, 5)]);
    }

    #[test]
    fn a_reported_window_is_not_repeated() {
        let mut windows = Windows::new(0, Lengths::new(Some(2.0), Some(1.0)));
        let span = |begin: i64| Span { begin_ns: begin * SEC, end_ns: (begin + 2) * SEC };
        assert!(!windows.take(span(-1)));
        assert!(windows.take(span(0)) && windows.take(span(1)));
        assert_eq!(windows.rest(4 * SEC), [span(2)]);
    }
}
