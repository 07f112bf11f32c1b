//! Exit codes, for scripts.

use std::process::ExitCode;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Everything was done.
    Fine = 0,
    /// The command failed.
    Failed = 1,
    /// The arguments are invalid.
    BadArguments = 2,
    /// The command finished, but data was lost inside teampulse, in a queue or on the disk, or a feature or a worker
    /// failed for good. Losses on the way to teampulse are reported in the summary and do not change the exit code.
    DataLost = 3,
    /// The study is invalid.
    BadStudy = 4,
    /// A device, robot, person or LSL stream of the study is missing, or was missing during the whole session.
    DeviceMissing = 5,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}
