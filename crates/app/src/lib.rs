//! The `teampulse` program: its commands, its studies, its exit codes.

mod commands;
mod computers;
pub mod study;
pub mod exit;
mod failure;
mod machine;
mod network;
mod output;
mod setup;
mod stop;

use std::process::ExitCode;

use clap::Parser;
use tracing_subscriber::EnvFilter;

/// Watches the people and the robots of a human-robot team on one clock.
///
/// Exit codes: 0 fine · 1 failed · 2 bad arguments · 3 finished, but data was lost · 4 the study is
/// wrong · 5 a required device is missing.
#[derive(Debug, Parser)]
#[command(name = "teampulse", version, about, long_about, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: commands::Command,
}

/// Does what the arguments of the process ask for.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    log_to_stderr();
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => {
            eprintln!("error: failed to start: {error}");
            return exit::Exit::Failed.into();
        }
    };
    let ended = runtime.block_on(arguments.command.run());
    runtime.shutdown_background();
    match ended {
        Ok(exit) => exit.into(),
        Err(failure) => {
            let exit = failure.exit;
            failure.show();
            exit.into()
        }
    }
}

/// Warnings and errors of the libraries go to standard error; `RUST_LOG` says otherwise.
fn log_to_stderr() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        .init();
}
