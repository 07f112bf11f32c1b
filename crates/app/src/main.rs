//! `teampulse`: watches the people and the robots of a human-robot team on one clock.

use std::process::ExitCode;

/// Records are allocated by one thread and freed by others, which with the C library's allocator would cost a tenth of
/// a session's processor time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    teampulse::main()
}
