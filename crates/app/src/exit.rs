//! Exit codes: what a script may rely on.

use std::process::ExitCode;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Everything was done.
    Fine = 0,
    /// It could not be done.
    Failed = 1,
    /// The arguments make no sense.
    BadArguments = 2,
    /// It was done, but data was lost in our hands: in our queue or on our disk. What was lost on
    /// its way here is told in the summary and does not change the code.
    DataLost = 3,
    /// The study is wrong.
    BadStudy = 4,
    /// A required device is missing.
    DeviceMissing = 5,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}
