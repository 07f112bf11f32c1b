//! Runs sessions over recorded data, which end by themselves.

use std::path::Path;

use teampulse_core::clock::Clock;
use teampulse_core::session::Session;
use teampulse_core::sink::SinkError;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::outcome::conclude;
use crate::stop::Stop;

/// Runs a session to the end of the recording. An interruption by a signal is a failure: the output at `out` is then
/// incomplete.
pub async fn read_through(session: Session, out: &Path) -> Exit {
    let stop = Stop::default();
    let mut outcome = stop.clone().run(session, Clock::host(), None).await;
    outcome.sinks = outcome.sinks.into_iter().map(|(name, error)| (name, failed(error))).collect();
    let exit = conclude(outcome);
    if !stop.was_asked() {
        return exit;
    }
    let interrupted = Failure::new(format!("interrupted: {} is incomplete", out.display()));
    interrupted.hint("delete it, and run the command again").show();
    Exit::Failed
}

/// Turns lost data of an output into a failure: writing it was the whole task, and can be repeated.
fn failed(error: SinkError) -> SinkError {
    match error {
        SinkError::Lost { message, hint } | SinkError::Failed { message, hint } => {
            SinkError::Failed { message, hint }
        }
    }
}

#[cfg(test)]
mod tests {
    use async_trait::async_trait;
    use teampulse_core::clocks::Clocks;
    use teampulse_core::outlet::Outlet;
    use teampulse_core::source::{Source, SourceError};
    use teampulse_messages::convert::encode;

    use super::*;

    /// A recording during which Ctrl-C is pressed, or never.
    struct Recording {
        is_interrupted: bool,
    }

    #[async_trait]
    impl Source for Recording {
        async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
            if self.is_interrupted {
                let own = rustix::process::getpid();
                rustix::process::kill_process(own, rustix::process::Signal::INT).ok();
                outlet.closed().await;
            }
            Ok(())
        }
    }

    async fn read(is_interrupted: bool) -> Exit {
        let session =
            Session::of_recording(Recording { is_interrupted }, Clocks::default(), encode);
        read_through(session, Path::new("out")).await
    }

    #[tokio::test]
    async fn what_was_cut_off_is_a_failure() {
        assert_eq!(read(false).await, Exit::Fine);
        assert_eq!(read(true).await, Exit::Failed);
    }
}
