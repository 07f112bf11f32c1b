//! Core files, which hold the memory of a crashed process.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Disables core files: the memory of a process that reads keys, or pictures that are not recorded, must not be written
/// to disk.
pub(crate) fn leave_no_core_file() {
    let limit = getrlimit(Resource::Core);
    // Lowering a limit is always permitted.
    setrlimit(Resource::Core, Rlimit { current: Some(0), ..limit }).ok();
}
