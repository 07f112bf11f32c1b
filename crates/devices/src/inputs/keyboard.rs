use std::collections::BTreeMap;

use super::seconds::{SECOND_NS, Tally};
use super::spread::Spread;
use super::{Act, Which};

/// A time between presses longer than this is a pause, not an interval of typing \[s\]. This is the usual threshold in
/// writing research (Wengelin 2006, "Examining pauses in writing").
pub const PAUSE_SECS: f64 = 2.0;
const PAUSE_NS: i64 = (PAUSE_SECS * 1e9) as i64;
/// A key held down for longer than this does not count as typing \[ns\].
const LONGEST_HOLD_NS: i64 = 10 * SECOND_NS;
/// A held key repeats more often than this; a press after a longer time means that the release was lost \[ns\].
const REPEAT_NS: i64 = 2 * SECOND_NS;
/// How long times are kept while there are too few for a mean \[ns\].
const KEPT_NS: i64 = 10 * SECOND_NS;
/// The largest number of keys that can be down at a time.
const MOST_DOWN: usize = 64;

pub(super) const CHANNELS: [(&str, &str); 9] = [
    ("presses", "1"),
    ("corrections", "1"),
    ("holds", "1"),
    ("hold_mean", "ms"),
    ("hold_sd", "ms"),
    ("intervals", "1"),
    ("interval_mean", "ms"),
    ("interval_sd", "ms"),
    ("idle", "s"),
];

/// The activity at keyboards.
#[derive(Default)]
pub(super) struct Keyboard {
    presses: u32,
    corrections: u32,
    holds: Spread,
    intervals: Spread,
    down: BTreeMap<Which, Held>,
    last_press_ns: Option<i64>,
}

/// A key that is down.
struct Held {
    since_ns: i64,
    /// When the key was last pressed or repeated.
    seen_ns: i64,
}

impl Tally for Keyboard {
    fn take(&mut self, at_ns: i64, act: &Act) {
        match act {
            Act::Key { which, is_down: true, corrects } => self.press(at_ns, *which, *corrects),
            Act::Key { which, is_down: false, .. } => self.release(at_ns, *which),
            Act::Lost(_) => {
                self.down.clear();
                self.last_press_ns = None;
            }
            _ => {}
        }
    }

    fn close(&mut self, _: i64, idle_ns: i64) -> Vec<f64> {
        if idle_ns >= KEPT_NS {
            (self.holds, self.intervals) = Default::default();
        }
        let presses = std::mem::take(&mut self.presses);
        let corrections = std::mem::take(&mut self.corrections);
        let counts = [f64::from(presses), f64::from(corrections)];
        counts.into_iter().chain(self.holds.take()).chain(self.intervals.take()).collect()
    }
}

impl Keyboard {
    fn press(&mut self, at_ns: i64, which: Which, corrects: bool) {
        if let Some(held) = self.down.get_mut(&which)
            && at_ns.saturating_sub(held.seen_ns) < REPEAT_NS
        {
            held.seen_ns = held.seen_ns.max(at_ns);
            return;
        }
        if self.down.len() >= MOST_DOWN {
            self.down.clear();
        }
        self.down.insert(which, Held { since_ns: at_ns, seen_ns: at_ns });
        self.presses += 1;
        self.corrections += u32::from(corrects);
        let before_ns = self.last_press_ns.replace(at_ns);
        let interval_ns = before_ns.map(|before_ns| at_ns.saturating_sub(before_ns));
        if let Some(interval_ns) = interval_ns.filter(|ns| (0..=PAUSE_NS).contains(ns)) {
            self.intervals.add(interval_ns);
        }
    }

    fn release(&mut self, at_ns: i64, which: Which) {
        let held_ns = self.down.remove(&which).map(|held| at_ns.saturating_sub(held.since_ns));
        if let Some(held_ns) = held_ns.filter(|ns| (0..=LONGEST_HOLD_NS).contains(ns)) {
            self.holds.add(held_ns);
        }
    }
}
