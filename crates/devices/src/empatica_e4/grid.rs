/// Counts samples that the server stamped at a fixed rate.
#[derive(Debug, Default)]
pub(super) struct Grid {
    last_ns: Option<i64>,
    next_index: u64,
}

/// What happened between a sample and the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Before {
    Nothing,
    Lost(u64),
    /// The server restarted its count at an earlier time.
    StepBack,
}

impl Grid {
    /// Returns the index of a sample, and what happened before it. Without a rate, losses can't be detected.
    pub fn place(&mut self, time_ns: i64, rate_hz: Option<f64>) -> (u64, Before) {
        let before = match (self.last_ns.replace(time_ns), rate_hz) {
            (Some(last_ns), _) if time_ns < last_ns => Before::StepBack,
            (Some(last_ns), Some(rate_hz)) => {
                let periods = time_ns.saturating_sub(last_ns) as f64 * rate_hz / 1e9;
                let lost = (periods.round() as u64).saturating_sub(1);
                if lost == 0 { Before::Nothing } else { Before::Lost(lost) }
            }
            _ => Before::Nothing,
        };
        let lost = if let Before::Lost(lost) = before { lost } else { 0 };
        let index = self.next_index.saturating_add(lost);
        self.next_index = index.saturating_add(1);
        (index, before)
    }
}
