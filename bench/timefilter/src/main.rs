//! The measurements of `bench/timefilter/run`. Each part prints figures; a bar is the limit that a figure must meet.

#![expect(clippy::print_stdout, reason = "figures go to standard output")]

mod accuracy;
mod calibration;
mod clocks;
mod grid;
mod joining;
mod links;
mod matching;
mod recording;
mod scenarios;
mod soak;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((part, rest)) = arguments.split_first() else { return refuse("no part is named") };
    match (part.as_str(), rest) {
        ("accuracy", rest) => {
            accuracy::measure(rest).map_or_else(|error| refuse(&error.to_string()), judge)
        }
        ("calibration", []) => judge(calibration::measure()),
        ("clocks", []) => judge(clocks::measure()),
        ("grid", rest) => finish(grid::measure(rest)),
        ("joining", []) => judge(joining::measure()),
        ("links", rest) => {
            scenarios::measure(rest).map_or_else(|error| refuse(&error.to_string()), judge)
        }
        ("soak", []) => finish(soak::measure()),
        ("matching", rest) => finish(matching::measure(rest)),
        _ => refuse(&format!("there is no part `{part}`")),
    }
}

fn judge(passed: bool) -> ExitCode {
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn finish(outcome: Result<(), Box<dyn std::error::Error>>) -> ExitCode {
    outcome.map_or_else(|error| refuse(&error.to_string()), |()| ExitCode::SUCCESS)
}

fn refuse(message: &str) -> ExitCode {
    eprintln!("error: {message}");
    ExitCode::from(2)
}
