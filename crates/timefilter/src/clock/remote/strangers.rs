//! Delays that are not of the clock that is known: one day one of them may be.

/// How many kinds of delays are remembered.
const KINDS: usize = 4;
/// Delays that differ by no more are of one kind [ns].
const KIND_NANOS: u64 = 1_000_000_000;
/// How many messages make a clock.
const MESSAGES: u32 = 3;

/// The delays of messages whose stamps were not believed, sorted into kinds.
#[derive(Clone, Debug, Default)]
pub(super) struct Strangers([Option<Kind>; KINDS]);

/// Delays that are near each other.
#[derive(Clone, Copy, Debug)]
struct Kind {
    lowest: i64,
    messages: u32,
    since: i64,
    last: i64,
}

impl Strangers {
    /// Takes a delay. Gives the lowest of its kind once that has come for so long.
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

    /// Forgets all.
    pub(super) fn forget(&mut self) {
        *self = Strangers::default();
    }
}
