//! The running sources of a session: each is run again when its device went away, and is left out when
//! it panics.

use std::time::Duration;

use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::fault::{lasting, passing};
use crate::outlet::Outlet;
use crate::panics::{at, watched_async};
use crate::source::{Source, SourceError};

/// The pauses before a source is run again double from the first to the last. All sources of today
/// are on this machine or on its network: trying again costs nothing.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LAST_PAUSE: Duration = Duration::from_secs(5);
/// The next pause of a source that has run for this long is the first again.
const WELL: Duration = Duration::from_secs(30);

/// Running sources.
#[derive(Default)]
pub(super) struct Sources {
    running: JoinSet<(String, Ended)>,
    names: Vec<String>,
}

/// How a source ended.
enum Ended {
    /// It has no more data.
    Done,
    /// The session can't go on without it.
    Fatal(SourceError),
    /// It panicked; the others go on.
    Panicked(SourceError),
}

impl Sources {
    pub(super) fn start(&mut self, name: String, source: Box<dyn Source>, outlet: Outlet) {
        self.names.push(name.clone());
        self.running.spawn(async move {
            let ended = mind(&name, source, &outlet).await;
            (name, ended)
        });
    }

    /// Waits until every source has ended, or one of them has failed for good.
    pub(super) async fn all_ended(&mut self, failed: &mut Vec<(String, SourceError)>) {
        while let Some(ended) = self.running.join_next().await {
            // A task that can't be joined was aborted: it is still in the list of names.
            let Ok((name, ended)) = ended else { continue };
            if let Some(index) = self.names.iter().position(|known| *known == name) {
                self.names.swap_remove(index);
            }
            match ended {
                Ended::Done => {}
                Ended::Panicked(error) => failed.push((name, error)),
                Ended::Fatal(error) => {
                    failed.push((name, error));
                    return;
                }
            }
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.running.is_empty()
    }

    /// Abandons those that still run; returns their names.
    pub(super) fn abandon(&mut self) -> Vec<String> {
        self.running.abort_all();
        std::mem::take(&mut self.names)
    }
}

/// Runs a source, and runs it again after a pause whenever its device went away.
async fn mind(name: &str, mut source: Box<dyn Source>, outlet: &Outlet) -> Ended {
    let mut pause = FIRST_PAUSE;
    loop {
        let began = Instant::now();
        match watched_async(source.run(outlet)).await {
            Ok(Ok(())) => return Ended::Done,
            Ok(Err(_)) if outlet.is_closed() => return Ended::Done,
            Ok(Err(SourceError::Gone { message, hint })) => {
                if began.elapsed() >= WELL {
                    pause = FIRST_PAUSE;
                }
                tracing::warn!(%name, %hint, "failed to {message}; trying again in {pause:?}");
                outlet.happen(passing(format!("{name}: failed to {message}")));
            }
            Ok(Err(fatal)) => return Ended::Fatal(fatal),
            Err(panic) => {
                let message = format!("go on: it panicked: {panic}");
                outlet.happen(lasting(format!("{name}: failed to {message}")));
                let hint = format!("a fault of teampulse{}; please report it", at(&panic));
                return Ended::Panicked(SourceError::Fatal { message, hint });
            }
        }
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = outlet.closed() => return Ended::Done,
        }
        pause = (pause * 2).min(LAST_PAUSE);
    }
}
