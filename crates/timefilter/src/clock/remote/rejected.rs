//! Delays that do not fit the known clock, one cluster of which may become the new clock.

/// The number of clusters kept.
const KINDS: usize = 4;
/// The largest difference of delays in one cluster [ns].
const KIND_NANOS: u64 = 1_000_000_000;
/// The number of messages that establish a clock.
const MESSAGES: u32 = 3;

/// The delays of messages with rejected timestamps, clustered.
#[derive(Clone, Debug, Default)]
pub(super) struct RejectedDelays([Option<Kind>; KINDS]);

/// A cluster of similar delays.
#[derive(Clone, Copy, Debug)]
struct Kind {
    lowest: i64,
    messages: u32,
    since: i64,
    last: i64,
}

impl RejectedDelays {
    /// Takes a delay. Returns the lowest delay of its cluster once that has lasted for `patience`.
    pub(super) fn push(&mut self, now: i64, delay: i64, patience: i64) -> Option<i64> {
        let of_kind = |kind: &&mut Kind| kind.lowest.abs_diff(delay) <= KIND_NANOS;
        if let Some(kind) = self.0.iter_mut().flatten().find(of_kind) {
            kind.lowest = kind.lowest.min(delay);
            kind.messages = kind.messages.saturating_add(1);
            kind.last = now;
            let ripe = kind.messages >= MESSAGES && now.saturating_sub(kind.since) >= patience;
            return ripe.then_some(kind.lowest);
        }
        let new = Kind { lowest: delay, messages: 1, since: now, last: now };
        let oldest = self.0.iter_mut().min_by_key(|kind| kind.map_or(i64::MIN, |kind| kind.last));
        *oldest? = Some(new);
        None
    }

    pub(super) fn forget(&mut self) {
        *self = RejectedDelays::default();
    }
}
