//! The clocks of senders, each with a name.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use teampulse_core::clock::Stopwatch;

/// The time after the first reply to a probe at which a clock is known: the time filter ends a burst of probes after a
/// second.
const KNOWN_AFTER: Duration = Duration::from_millis(1100);
/// How long a clock remains known without replies: less than the time filter's minute.
const KNOWN_FOR: Duration = Duration::from_secs(50);
/// Clocks whose offsets differ by less than this count as the same [s].
const SAME_SECS: f64 = 0.1;
/// The largest number of clocks of a computer; later ones share the last name.
const MOST: usize = 100;

/// The clocks of all sending computers, distinguished by their offsets: a rebooted computer has a new clock.
#[derive(Clone, Debug, Default)]
pub(super) struct SenderClocks(Arc<Mutex<BTreeMap<String, Vec<SenderClock>>>>);

/// A clock of a sending computer, for all streams that it stamps.
#[derive(Clone, Copy, Debug)]
struct SenderClock {
    /// How far the clock is ahead of the session's, by the last reply [s].
    offset_secs: f64,
    /// The time since the first reply and since the last one.
    first_reply: Stopwatch,
    last_reply: Stopwatch,
}

/// The clock that stamps a stream, as identified by a reply to a probe.
#[derive(Clone, Debug)]
pub(super) struct RepliedClock {
    /// The name of the clock.
    pub name: String,
    /// The time since the clock's first reply, to a probe for this or any other stream.
    first_reply: Stopwatch,
}

impl RepliedClock {
    /// Whether the time filter knows the clock by now.
    pub fn is_known(&self) -> bool {
        self.first_reply.elapsed() > KNOWN_AFTER
    }
}

impl SenderClock {
    fn begin(offset_secs: f64) -> SenderClock {
        let now = Stopwatch::start();
        SenderClock { offset_secs, first_reply: now, last_reply: now }
    }

    fn reply(&mut self, offset_secs: f64) {
        if self.last_reply.elapsed() > KNOWN_FOR {
            self.first_reply = Stopwatch::start();
        }
        self.last_reply = Stopwatch::start();
        self.offset_secs = offset_secs;
    }
}

impl SenderClocks {
    /// Returns the clock of a computer that replied to a probe and is this far ahead [s].
    pub fn replied(&self, hostname: &str, offset_secs: f64) -> RepliedClock {
        let mut clocks = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let clocks = clocks.entry(hostname.to_owned()).or_default();
        let is_it = |known: &SenderClock| (known.offset_secs - offset_secs).abs() < SAME_SECS;
        if !clocks.iter().any(is_it) && clocks.len() < MOST {
            clocks.push(SenderClock::begin(offset_secs));
        }
        let number = clocks.iter().position(is_it).unwrap_or(clocks.len() - 1);
        let clock = &mut clocks[number];
        clock.reply(offset_secs);
        let name = match number {
            0 => format!("LSL on {hostname}"),
            number => format!("LSL on {hostname} ({})", number + 1),
        };
        RepliedClock { name, first_reply: clock.first_reply }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_computer_that_was_switched_on_again_has_another_clock() {
        let clocks = SenderClocks::default();
        let name = |hostname, offset_secs| clocks.replied(hostname, offset_secs).name;
        assert_eq!(name("lab", -1.7e9), "LSL on lab");
        assert_eq!(name("lab", -1.7e9 + 0.05), "LSL on lab");
        assert_eq!(name("lab", -1.7e9 + 0.12), "LSL on lab", "it drifts");
        assert_eq!(name("lab", -1.8e9), "LSL on lab (2)");
        assert_eq!(name("other", -1.8e9), "LSL on other");
    }
}
