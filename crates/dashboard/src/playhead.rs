//! The position in a recording, which all viewers share.

use std::sync::Arc;

use teampulse_core::clock::Stopwatch;
use teampulse_core::time::Time;
use tokio::sync::watch;

/// The slowest and the fastest rate of playback.
pub const RATES: (f64, f64) = (0.1, 20.0);

/// The position in a recording, and how it moves; shared among clones.
#[derive(Clone, Debug)]
pub struct Playhead {
    first: Time,
    last: Time,
    state: Arc<watch::Sender<Position>>,
}

/// A moving position.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    at: Time,
    since: Stopwatch,
    /// The playback speed relative to real time.
    pub rate: f64,
    /// Whether playback is paused.
    pub is_paused: bool,
    /// How often the position was moved to another time.
    pub jumps: u64,
}

impl Position {
    fn now(&self, last: Time) -> Time {
        if self.is_paused {
            return self.at;
        }
        let passed = self.since.elapsed().as_secs_f64() * self.rate;
        let nanos = self.at.nanos().saturating_add((passed * 1e9) as i64);
        Time::from_nanos(nanos).min(last)
    }

    /// The same position, counted from now.
    fn kept(self, last: Time) -> Position {
        Position { at: self.now(last), since: Stopwatch::start(), ..self }
    }
}

impl Playhead {
    /// Starts at a time of a recording from `first` to `last`, at this multiple of the recorded speed.
    pub fn new((first, last): (Time, Time), at: Time, rate: f64) -> Playhead {
        let (at, since) = (at.clamp(first, last), Stopwatch::start());
        let rate = if rate.is_finite() { rate.max(RATES.0 / 100.0) } else { 1.0 };
        let position = Position { at, since, rate, is_paused: false, jumps: 0 };
        Playhead { first, last, state: Arc::new(watch::Sender::new(position)) }
    }

    /// The start of the recording.
    pub fn first(&self) -> Time {
        self.first
    }

    /// The end of the recording.
    pub fn last(&self) -> Time {
        self.last
    }

    /// The time that is shown.
    pub fn now(&self) -> Time {
        self.position().now(self.last)
    }

    /// Whether the end of the recording is reached.
    pub fn is_over(&self) -> bool {
        self.now() >= self.last
    }

    /// The moving position.
    pub fn position(&self) -> Position {
        *self.state.borrow()
    }

    /// Returns a receiver of every change in how the position moves.
    pub fn changes(&self) -> watch::Receiver<Position> {
        self.state.subscribe()
    }

    /// Pauses or resumes; at the end, resuming starts from the beginning.
    pub fn set_paused(&self, is_paused: bool) {
        if !is_paused && self.is_over() {
            self.jump(self.first);
        }
        self.change(|position| position.is_paused = is_paused);
    }

    /// Sets the rate, limited to [`RATES`].
    pub fn set_rate(&self, rate: f64) {
        self.change(|position| position.rate = limited(rate));
    }

    /// Moves to another time.
    pub fn jump(&self, to: Time) {
        let to = to.clamp(self.first, self.last);
        self.change(|position| (position.at, position.jumps) = (to, position.jumps + 1));
    }

    /// Moves the position back to the time up to which everything has been shown, if it is more than `behind_secs`
    /// ahead of it and not paused.
    pub fn wait_for(&self, shown: Time, behind_secs: f64) {
        let is_far = |now: Time| now.secs_since(shown) > behind_secs;
        self.state.send_if_modified(|position| {
            let is_behind = !position.is_paused && is_far(position.now(self.last));
            if is_behind {
                *position = Position { at: shown, since: Stopwatch::start(), ..*position };
            }
            is_behind
        });
    }

    fn change(&self, change: impl FnOnce(&mut Position)) {
        self.state.send_modify(|position| {
            *position = position.kept(self.last);
            change(position);
        });
    }
}

fn limited(rate: f64) -> f64 {
    if rate.is_finite() { rate.clamp(RATES.0, RATES.1) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn secs(secs: u32) -> Time {
        Time::from_stamp(1000 + secs as i32, 0)
    }

    fn paused_at(at: u32) -> Playhead {
        let playhead = Playhead::new((secs(0), secs(60)), secs(at), 1.0);
        playhead.set_paused(true);
        playhead.jump(secs(at));
        playhead
    }

    #[test]
    fn a_pause_holds_the_position_and_a_jump_moves_it_within_the_recording() {
        let playhead = paused_at(20);
        assert_eq!(playhead.now(), secs(20));
        playhead.jump(secs(50));
        assert_eq!(playhead.now(), secs(50));
        playhead.jump(secs(500));
        assert_eq!(playhead.now(), secs(60));
        assert!(playhead.is_over());
        playhead.jump(Time::EPOCH);
        assert_eq!((playhead.now(), playhead.position().jumps), (secs(0), 4));
    }

    #[test]
    fn it_moves_on_at_its_rate_and_not_beyond_the_end() {
        let playhead = paused_at(10);
        playhead.set_rate(1e9);
        assert!((playhead.position().rate - 20.0).abs() < 1e-9);
        playhead.set_rate(f64::NAN);
        assert!((playhead.position().rate - 1.0).abs() < 1e-9);
        playhead.set_paused(false);
        assert!(playhead.now() >= secs(10));
        playhead.jump(secs(60));
        assert_eq!(playhead.now(), secs(60));
    }

    #[test]
    fn at_the_end_it_goes_on_from_the_beginning() {
        let playhead = paused_at(60);
        playhead.set_paused(false);
        assert!(playhead.now() < secs(60) && !playhead.position().is_paused);
    }
}
