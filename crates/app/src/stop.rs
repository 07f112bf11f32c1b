//! The events that end a session: a signal, a key, or its duration.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use teampulse_core::session::{Outcome, Session};
use teampulse_sinks::leave_screen;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::watch;

use crate::exit::Exit;
use crate::output::say;

/// How often the session's clock is checked.
const LOOK: Duration = Duration::from_millis(20);
/// How long a followed clock may stand still before a session with a fixed duration ends.
const STANDSTILL: Duration = Duration::from_secs(10);

/// A handle that asks the session to stop, from any thread.
#[derive(Clone, Debug)]
pub struct Stop(Arc<watch::Sender<u32>>);

impl Default for Stop {
    fn default() -> Stop {
        Stop(Arc::new(watch::Sender::new(0)))
    }
}

impl Stop {
    /// Asks the session to stop; repeated requests have no effect.
    pub fn ask(&self) {
        self.0.send_modify(|asked| *asked = (*asked).max(1));
    }

    /// Whether the session was asked to stop.
    pub fn was_asked(&self) -> bool {
        *self.0.borrow() > 0
    }

    /// Resolves on request, on Ctrl-C, SIGTERM and SIGHUP (a closed terminal), or after `duration_secs` on the
    /// session's clock. After this call, these signals no longer end the process by themselves.
    pub fn asked(self, clock: Clock, duration_secs: Option<f64>) -> impl Future<Output = ()> {
        self.hear_signals();
        async move {
            tokio::select! {
                () = self.reached(1) => {}
                () = elapsed(clock, duration_secs) => self.ask(),
            }
        }
    }

    /// Resolves on a second Ctrl-C or SIGTERM: slow steps are then skipped.
    pub async fn hurried(self) {
        self.reached(2).await;
        say("stopping now: anything not finished within a few seconds is abandoned");
    }

    /// Runs a session until it ends or is asked to stop.
    pub async fn run(self, session: Session, clock: Clock, duration_secs: Option<f64>) -> Outcome {
        let asked = self.clone().asked(clock, duration_secs);
        session.run_until(asked, self.hurried()).await
    }

    async fn reached(&self, times: u32) {
        let mut asked = self.0.subscribe();
        if asked.wait_for(|asked| *asked >= times).await.is_err() {
            // There is no sender any more.
            std::future::pending::<()>().await;
        }
    }

    /// Counts signals. A third Ctrl-C ends the process immediately; SIGTERM never does, as the kernel may send several
    /// when a parent process ends.
    fn hear_signals(&self) {
        let interrupts = [(SignalKind::interrupt(), 3), (SignalKind::terminate(), 2)];
        let heard =
            interrupts.into_iter().filter_map(|(kind, most)| Some((signal(kind).ok()?, most)));
        for (mut signal, most) in heard {
            let stop = self.clone();
            tokio::spawn(async move {
                while signal.recv().await.is_some() {
                    stop.0.send_modify(|asked| *asked = (*asked + 1).min(most).max(*asked));
                    if *stop.0.borrow() > 2 {
                        leave_screen();
                        say("error: stopped before everything was written");
                        std::process::exit(Exit::Failed as i32);
                    }
                }
            });
        }
        if let Some(mut hangup) = hangup() {
            let stop = self.clone();
            tokio::spawn(async move {
                // Both the kernel and the shell report a closed terminal, so a second SIGHUP does not count as urgent.
                while hangup.recv().await.is_some() {
                    stop.ask();
                }
            });
        }
    }
}

/// Listens for SIGHUP, unless it is ignored since the process started, as with `nohup`.
fn hangup() -> Option<Signal> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kind = SignalKind::hangup();
    if is_ignored(kind.as_raw_value(), &status) { None } else { signal(kind).ok() }
}

/// Whether a process ignores a signal, by its `/proc/PID/status`.
fn is_ignored(signal: i32, status: &str) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

async fn elapsed(clock: Clock, duration_secs: Option<f64>) {
    let Some(duration_secs) = duration_secs else { return std::future::pending().await };
    let (began, mut seen) = (clock.now(), clock.now());
    let mut still = Duration::ZERO;
    while clock.now().secs_since(began) < duration_secs && still < STANDSTILL {
        tokio::time::sleep(LOOK).await;
        let now = clock.now();
        still = if now == seen { still + LOOK } else { Duration::ZERO };
        seen = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_proc() {
        let status = "Name:\tx\nSigBlk:\t0000000000000001\nSigIgn:\t0000000000001001\n";
        assert!(is_ignored(1, status) && is_ignored(13, status));
        assert!(!is_ignored(2, status) && !is_ignored(1, ""));
    }

    #[tokio::test]
    async fn a_key_asks_once_and_is_never_a_hurry() {
        let stop = Stop::default();
        stop.ask();
        stop.ask();
        stop.clone().asked(Clock::settable(), None).await;
        let hurried = tokio::time::timeout(Duration::from_millis(1), stop.hurried()).await;
        assert!(hurried.is_err());
    }
}
