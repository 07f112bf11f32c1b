//! `teampulse`: watches the people and the robots of a human-robot team on one clock.

use std::process::ExitCode;

fn main() -> ExitCode {
    teampulse::main()
}
