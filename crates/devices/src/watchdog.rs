use std::time::Duration;

/// Expires when recurring data fail to arrive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watchdog {
    fed: Duration,
    patience: Duration,
}

impl Watchdog {
    pub fn new(now: Duration, patience: Duration) -> Self {
        Self { fed: now, patience }
    }

    pub fn feed(&mut self, now: Duration) {
        self.fed = now;
    }

    pub fn deadline(&self) -> Duration {
        self.fed.saturating_add(self.patience)
    }

    pub fn has_expired(&self, now: Duration) -> bool {
        now >= self.deadline()
    }

    pub fn quiet(&self, now: Duration) -> Duration {
        now.saturating_sub(self.fed)
    }
}
