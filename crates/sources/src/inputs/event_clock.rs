/// A change of the offset larger than this is a step of the clock, not a delay \[ns\].
const STEP_NS: i64 = 1_000_000_000;

/// Converts the times of a device's events to the session's clock, by the smallest delay seen so far.
#[derive(Debug, Default)]
pub(super) struct EventClock {
    /// The session's time minus the event's time \[ns\].
    offset_ns: Option<i64>,
}

impl EventClock {
    /// Returns the session's time of an event that is read at `now_ns` \[ns\].
    pub(super) fn session_ns(&mut self, event_ns: i64, now_ns: i64) -> i64 {
        let found_ns = now_ns.saturating_sub(event_ns);
        let is_better =
            |known_ns: i64| found_ns < known_ns || found_ns.saturating_sub(known_ns) > STEP_NS;
        if self.offset_ns.is_none_or(is_better) {
            self.offset_ns = Some(found_ns);
        }
        event_ns.saturating_add(self.offset_ns.unwrap_or(found_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_keep_their_distance_however_late_they_are_read() {
        let mut clock = EventClock::default();
        let read = [(1000, 51_000), (2000, 52_400), (3000, 53_000), (4000, 59_000)];
        let times = read.map(|(event_ns, now_ns)| clock.session_ns(event_ns, now_ns));
        assert_eq!(times, [51_000, 52_000, 53_000, 54_000]);
    }

    #[test]
    fn a_step_of_the_clock_of_events_is_followed() {
        let mut clock = EventClock::default();
        clock.session_ns(10 * STEP_NS, 10 * STEP_NS);
        assert_eq!(clock.session_ns(2 * STEP_NS, 11 * STEP_NS), 11 * STEP_NS);
        assert_eq!(clock.session_ns(90 * STEP_NS, 12 * STEP_NS), 12 * STEP_NS);
    }
}
