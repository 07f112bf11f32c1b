//! Pauses of a device that its sample indices do not show.

use crate::clock::Stamps;

/// The shortest pause that is looked for [ns].
const SHORTEST_NANOS: f64 = 0.5e9;
/// The minimum lateness of readings after a pause, as a share of the silence.
const LATE: f64 = 0.5;
/// The shortest and the longest time for which readings are compared after a silence [ns].
const LEAST_NANOS: i64 = 100_000_000;
const MOST_NANOS: i64 = 5_000_000_000;
/// The minimum rate at which delays shrink while a backlog arrives, as a share of the elapsed time.
const SHRINKING: f64 = 0.3;

/// Distinguishes a device that paused from one whose readings were held up: readings that were held up arrive faster
/// than they were measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pause {
    newest: Option<Reading>,
    silence: Option<Silence>,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    arrival: i64,
    /// The reading's arrival minus the time of its last sample by the indices [ns].
    delay: f64,
}

/// A silence after which readings are late.
#[derive(Clone, Copy, Debug)]
struct Silence {
    /// How late the readings are [ns].
    late: f64,
    /// The first reading after the silence.
    first: Reading,
}

impl Pause {
    /// Takes a reading whose first sample has this time by the indices [ns]; returns whether the device paused before
    /// this reading or, as only this reading shows, shortly before it.
    pub fn push(&mut self, stamps: &Stamps, device: f64, period_nanos: f64) -> bool {
        let Stamps { count, arrival, .. } = *stamps;
        let length = f64::from(count.saturating_sub(1)) * period_nanos;
        let reading = Reading { arrival, delay: arrival as f64 - device - length };
        let Some(last) = self.newest.replace(reading) else { return false };
        let late = reading.delay - last.delay;
        if late >= SHORTEST_NANOS.max(LATE * arrival.saturating_sub(last.arrival) as f64) {
            self.silence = Some(Silence { late, first: reading });
            return false;
        }
        let Some(Silence { late, first }) = self.silence else { return false };
        let elapsed = arrival.saturating_sub(first.arrival);
        let shrunk = first.delay - reading.delay;
        let is_backlog = elapsed > MOST_NANOS || shrunk > LATE * late;
        let has_paused =
            !is_backlog && elapsed >= LEAST_NANOS && shrunk < SHRINKING * elapsed as f64;
        if is_backlog || has_paused {
            self.silence = None;
        }
        has_paused
    }
}
