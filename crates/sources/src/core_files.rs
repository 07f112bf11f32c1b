//! Files with the memory of a process that crashed.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Disables core files: the memory of a process that reads keys, or pictures that are not recorded, must not end up in
/// a file.
pub(crate) fn leave_no_core_file() {
    let limit = getrlimit(Resource::Core);
    // A lower limit is always permitted.
    setrlimit(Resource::Core, Rlimit { current: Some(0), ..limit }).ok();
}
