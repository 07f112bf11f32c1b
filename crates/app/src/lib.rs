//! The `teampulse` program: its commands, its studies, its exit codes.

mod commands;
mod components;
mod computers;
pub mod study;
pub mod exit;
mod failure;
mod folder;
mod machine;
mod network;
mod outcome;
mod output;
mod setup;
mod controls;
mod notes;
mod required;
mod supplies;
mod room;
mod absent;
mod stop;
mod recorded;
mod tidied;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser};
pub use components::Components;
use teampulse_core::panics::{at, install_hook, watched};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

/// Watches the people and the robots of a human-robot team on one clock.
///
/// Exit codes: 0 fine · 1 failed · 2 bad arguments · 3 finished, but data was lost inside teampulse, or
/// a feature or a worker failed for good · 4 the study is invalid · 5 a device, robot, person or LSL stream of the
/// study is missing.
#[derive(Debug, Parser)]
#[command(name = "teampulse", version, about, long_about, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: commands::Command,
}

/// Runs the command given by the arguments of the process.
pub fn main() -> ExitCode {
    main_with(Components::default())
}

/// Like [`main`], for a program that adds components of its own.
pub fn main_with(components: Components) -> ExitCode {
    components.use_in_this_program();
    let matches = taking_negative_numbers(Arguments::command()).get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    log_to_stderr();
    install_hook();
    machine::allow_many_files();
    machine::share_one_heap();
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => {
            output::say(format!("error: failed to start: {error}"));
            return exit::Exit::Failed.into();
        }
    };
    let ended = watched(|| {
        runtime.block_on(async {
            machine::outlive_large_files();
            arguments.command.run().await
        })
    });
    runtime.shutdown_background();
    let ended = ended.unwrap_or_else(|panic| {
        let failure = failure::Failure::new(format!("teampulse panicked: {panic}{}", at(&panic)));
        Err(failure.hint("this is a bug in teampulse; please report it"))
    });
    match ended {
        Ok(exit) => exit.into(),
        Err(failure) => {
            let exit = failure.exit;
            failure.show();
            exit.into()
        }
    }
}

/// Lets a negative number after an option be its value rather than another option.
fn taking_negative_numbers(command: clap::Command) -> clap::Command {
    let taking = |option: clap::Arg| {
        let takes_values = !option.is_positional() && option.get_action().takes_values();
        if takes_values { option.allow_negative_numbers(true) } else { option }
    };
    command.mut_args(taking).mut_subcommands(taking_negative_numbers)
}

/// Sends warnings and errors of the libraries to standard error, unless `RUST_LOG` sets another filter.
#[expect(clippy::disallowed_methods, reason = "the variable that programs in Rust read for this")]
fn log_to_stderr() {
    let asked: Option<Targets> = std::env::var("RUST_LOG").ok().and_then(|text| text.parse().ok());
    let filter = asked.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| teampulse_sinks::WarningOutput)
        .with_ansi(false)
        .with_target(false)
        .without_time()
        // `eprintln!` would panic once the terminal is closed.
        .log_internal_errors(false);
    tracing_subscriber::registry().with(lines).with(filter).init();
}
