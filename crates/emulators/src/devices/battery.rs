/// A battery that drains evenly and reports each percent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Battery {
    full_percent: f64,
    drain_percent_per_hour: f64,
    reported: u8,
}

impl Battery {
    pub fn new(percent: f64, drain_percent_per_hour: f64) -> Self {
        let mut battery = Self { full_percent: percent, drain_percent_per_hour, reported: 0 };
        battery.reported = battery.percent(0.0);
        battery
    }

    pub fn percent(&self, secs: f64) -> u8 {
        let drained = secs / 3600.0 * self.drain_percent_per_hour;
        (self.full_percent - drained).round().clamp(0.0, 100.0) as u8
    }

    /// Returns when the next percent is used up [s].
    pub fn due_secs(&self) -> f64 {
        if self.reported == 0 || self.drain_percent_per_hour <= 0.0 {
            return f64::INFINITY;
        }
        let left = self.full_percent - (f64::from(self.reported) - 0.5);
        // A little later, so that rounding has surely passed the half.
        left.max(0.0) / self.drain_percent_per_hour * 3600.0 + 1e-6
    }

    /// Reports the level that is due.
    pub fn report(&mut self, secs: f64) -> u8 {
        self.reported = self.percent(secs).min(self.reported.saturating_sub(1));
        self.reported
    }
}
