//! The running sources of a session: each is restarted when its device goes away, and dropped when it panics.

use std::time::Duration;

use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::fault::{lasting, passing, with_hint};
use crate::outlet::Outlet;
use crate::panics::{at, watched_async};
use crate::session::Outcome;
use crate::source::{Source, SourceError};

/// The pauses before a source is run again double from the first to the last. All sources are on this machine or on its
/// network, so retrying costs nothing.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LAST_PAUSE: Duration = Duration::from_secs(5);
/// After a source has run for this long, its pauses start from the first one again.
const WELL: Duration = Duration::from_secs(30);
/// A source whose runs all ended sooner than this has not opened its device.
const OPENED: Duration = Duration::from_secs(2);

/// Running sources.
#[derive(Default)]
pub(super) struct Sources {
    running: JoinSet<(String, Ended, Option<SourceError>)>,
    names: Vec<String>,
}

/// How a source ended.
#[derive(Debug)]
enum Ended {
    /// The source has no more data.
    Done,
    /// The session can't go on without it.
    Fatal(SourceError),
    /// The source panicked; the others go on.
    Panicked(SourceError),
}

impl Sources {
    pub(super) fn start(&mut self, name: String, source: Box<dyn Source>, outlet: Outlet) {
        self.names.push(name.clone());
        self.running.spawn(async move {
            let mut unopened = None;
            let ended = mind(&name, source, &outlet, &mut unopened).await;
            (name, ended, unopened)
        });
    }

    /// Waits until every source has ended, or one of them has failed for good.
    pub(super) async fn all_ended(&mut self, outcome: &mut Outcome) {
        while let Some(ended) = self.running.join_next().await {
            // A task that can't be joined was aborted: it is still in the list of names.
            let Ok((name, ended, unopened)) = ended else { continue };
            if let Some(index) = self.names.iter().position(|known| *known == name) {
                self.names.swap_remove(index);
            }
            match ended {
                Ended::Done => outcome.unopened.extend(unopened.map(|error| (name, error))),
                Ended::Panicked(error) => outcome.sources.push((name, error)),
                Ended::Fatal(error) => {
                    outcome.sources.push((name, error));
                    return;
                }
            }
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.running.is_empty()
    }

    /// Abandons the sources that are still running, and returns their names.
    pub(super) fn abandon(&mut self) -> Vec<String> {
        self.running.abort_all();
        std::mem::take(&mut self.names)
    }
}

/// Runs a source, and restarts it after a pause whenever its device goes away.
///
/// `unopened` is the last reason why the device could not be opened, as long as it never was.
async fn mind(
    name: &str,
    mut source: Box<dyn Source>,
    outlet: &Outlet,
    unopened: &mut Option<SourceError>,
) -> Ended {
    let mut pause = FIRST_PAUSE;
    let mut was_open = false;
    loop {
        let began = Instant::now();
        let ended = watched_async(source.run(outlet)).await;
        was_open |= began.elapsed() >= OPENED;
        *unopened = unopened.take().filter(|_| !was_open);
        match ended {
            Ok(Ok(())) => return Ended::Done,
            Ok(Err(_)) if outlet.is_closed() => return Ended::Done,
            Ok(Err(SourceError::Gone { message, hint })) => {
                if began.elapsed() >= WELL {
                    pause = FIRST_PAUSE;
                }
                tracing::debug!("{name} restarts in {pause:?}");
                let label = format!("{name}: failed to {message}");
                outlet.happen(passing(with_hint(label, &hint)));
                *unopened = Some(SourceError::Gone { message, hint }).filter(|_| !was_open);
            }
            Ok(Err(fatal)) => return Ended::Fatal(fatal),
            Err(panic) => {
                let message = format!("continue: it panicked: {panic}");
                outlet.happen(lasting(format!("{name}: failed to {message}")));
                let hint = format!("this is a bug in teampulse{}; please report it", at(&panic));
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use async_trait::async_trait;

    use super::*;
    use crate::clock::Clock;
    use crate::outlet::Queue;
    use crate::streams::Streams;

    /// A strap whose connections each last this many seconds, until it has been connected this many times.
    struct Strap {
        lasts_secs: u64,
        connected: Arc<Mutex<Vec<Instant>>>,
        most: usize,
    }

    #[async_trait]
    impl Source for Strap {
        async fn run(&mut self, _: &Outlet) -> Result<(), SourceError> {
            let connections = {
                let mut connected = self.connected.lock().expect("nobody panicked");
                connected.push(Instant::now());
                connected.len()
            };
            if connections == self.most {
                return Ok(());
            }
            tokio::time::sleep(Duration::from_secs(self.lasts_secs)).await;
            Err(SourceError::Gone { message: "go on".into(), hint: String::new() })
        }
    }

    /// How long a strap is away between connections that last this long.
    async fn away(lasts_secs: u64) -> Vec<Duration> {
        let connected = Arc::default();
        let strap = Strap { lasts_secs, connected: Arc::clone(&connected), most: 11 };
        let outlet = Queue::new().outlet(Clock::host(), Streams::default());
        let mut unopened = None;
        let ended = mind("strap", Box::new(strap), &outlet, &mut unopened).await;
        assert!(matches!(ended, Ended::Done), "{ended:?}");
        assert_eq!(unopened.is_some(), lasts_secs < 2, "{unopened:?}");
        let connected = connected.lock().expect("nobody panicked");
        let lasted = Duration::from_secs(lasts_secs);
        connected.windows(2).map(|pair| (pair[1] - pair[0]).saturating_sub(lasted)).collect()
    }

    #[tokio::test(start_paused = true)]
    async fn a_strap_that_is_lost_every_ten_minutes_is_tried_again_as_soon_the_tenth_time() {
        let away = away(600).await;
        eprintln!("tried again {:?} after the first loss, {:?} after the tenth", away[0], away[9]);
        assert!(away.iter().all(|pause| pause.abs_diff(FIRST_PAUSE) < Duration::from_millis(5)));
    }

    #[tokio::test(start_paused = true)]
    async fn one_that_is_lost_at_once_is_tried_again_less_and_less_often() {
        let away = away(1).await;
        assert!(away.iter().is_sorted(), "{away:?}");
        assert!(away[9].abs_diff(LAST_PAUSE) < Duration::from_millis(5));
    }
}
