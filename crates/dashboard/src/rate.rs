//! A limit on the rate of requests.

use teampulse_core::clock::Stopwatch;

/// An allowance that refills with time.
#[derive(Debug)]
pub struct Allowance {
    per_sec: f64,
    most: f64,
    left: f64,
    since: Stopwatch,
}

impl Allowance {
    /// Allows `per_sec` per second, and `most` in a burst.
    pub fn new(per_sec: f64, most: f64) -> Allowance {
        Allowance { per_sec, most, left: most, since: Stopwatch::start() }
    }

    /// Takes one from the allowance; returns whether one was left.
    pub fn take(&mut self) -> bool {
        let elapsed_secs = self.since.elapsed().as_secs_f64();
        self.since = Stopwatch::start();
        self.left = (self.left + elapsed_secs * self.per_sec).min(self.most);
        let is_left = self.left >= 1.0;
        if is_left {
            self.left -= 1.0;
        }
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_at_once_are_allowed_and_more_are_not() {
        let mut allowance = Allowance::new(0.0, 3.0);
        assert_eq!([(); 5].map(|()| allowance.take()), [true, true, true, false, false]);
    }
}
