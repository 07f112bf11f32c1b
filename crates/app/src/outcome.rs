//! Reports what went wrong in a session that has ended, on standard error and by the exit code.

use teampulse_core::counted::counted;
use teampulse_core::panics::at;
use teampulse_core::session::{Outcome, WorkerEnd};
use teampulse_core::sink::SinkError;
use teampulse_core::worker::WorkerCounts;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output::say;

/// Prints what went wrong in a session that has ended, and returns its exit code.
pub fn conclude(outcome: Outcome) -> Exit {
    let mut exit = Exit::Fine;
    let mut blame = |failure: Failure, code| {
        failure.show();
        exit = if exit == Exit::Failed { exit } else { code };
    };
    if outcome.dropped > 0 {
        let dropped = counted(outcome.dropped, "sample was", "samples were");
        let message = format!("{dropped} dropped in our own queue");
        blame(Failure::new(message), Exit::DataLost);
    }
    for (name, error) in outcome.sinks {
        let failure = Failure::new(format!("{name}: failed to {error}"));
        match error {
            SinkError::Lost { hint, .. } => blame(failure.hint(hint), Exit::DataLost),
            SinkError::Failed { hint, .. } => blame(failure.hint(hint), Exit::Failed),
        }
    }
    for WorkerEnd { name, counts: WorkerCounts { taken, skipped }, error } in outcome.workers {
        if taken + skipped == 0 {
            say(format!("{name}: no samples arrived on its streams"));
        } else if skipped > 0 {
            let all = counted(taken + skipped, "sample", "samples");
            say(format!("{name}: processed {taken} of {all}"));
        }
        if let Some(error) = error {
            let failure = Failure::new(format!("{name}: failed to {error}"));
            blame(failure.hint(error.hint), Exit::DataLost);
        }
    }
    for broken in outcome.features {
        let failure = Failure::new(format!("{broken}{}", at(&broken.panic)));
        let hint = "all raw data was recorded; please report this bug in teampulse";
        blame(failure.hint(hint), Exit::DataLost);
    }
    for what in outcome.undone {
        blame(Failure::new(format!("ended before all work was finished: {what}")), Exit::DataLost);
    }
    for (name, error) in outcome.sources {
        blame(Failure::new(format!("{name}: failed to {error}")), Exit::Failed);
    }
    for panic in outcome.pump.iter().chain(&outcome.strays) {
        let failure = Failure::new(format!("a part of teampulse panicked: {panic}{}", at(panic)));
        blame(failure.hint("please report this bug in teampulse"), Exit::Failed);
    }
    exit
}
