//! What ends a session: a signal, a key, or its duration.

use std::sync::Arc;
use std::time::Duration;

use teampulse_core::clock::Clock;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::Notify;

/// How often the session's clock is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// How long a told clock may stand still before a session of set duration ends.
const STANDSTILL: Duration = Duration::from_secs(10);

/// A way to ask the session to stop, from any thread.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<Notify>);

impl Stop {
    /// Asks the session to stop.
    pub fn ask(&self) {
        self.0.notify_one();
    }

    /// Resolves when somebody asked, on Ctrl-C and SIGTERM, or after `duration_secs` by the
    /// session's clock. After this a second Ctrl-C ends the process at once.
    pub async fn asked(self, clock: Clock, duration_secs: Option<f64>) {
        tokio::select! {
            () = self.0.notified() => {}
            () = signalled() => {}
            () = elapsed(clock, duration_secs) => {}
        }
        tokio::spawn(async {
            signalled().await;
            eprintln!("error: stopped before everything was written");
            std::process::exit(1);
        });
    }
}

async fn signalled() {
    let terminate = signal(SignalKind::terminate());
    let Ok(mut terminate) = terminate else { return std::future::pending().await };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => {}
        _ = terminate.recv() => {}
    }
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
