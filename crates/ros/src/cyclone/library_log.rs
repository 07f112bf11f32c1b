//! Log messages of the library: forwarded to our log instead of printed to the terminal.

use std::ffi::{CStr, c_void};
use std::ptr;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use cyclors as c;

/// The messages logged while a domain is joined; `None` at any other time.
static JOINING: Mutex<Option<Vec<String>>> = Mutex::new(None);

/// Runs `join`; if it fails, the library's log messages, if any, are the error.
pub(super) fn explain<T>(join: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    listen();
    *lock() = Some(Vec::new());
    let joined = join();
    let said = lock().take().unwrap_or_default();
    match joined {
        Ok(joined) => {
            for line in said {
                tracing::warn!("Cyclone DDS: {line}");
            }
            Ok(joined)
        }
        Err(reason) if said.is_empty() => Err(reason),
        Err(_) => Err(said.join("; ")),
    }
}

/// Installs our log callback, once per process.
fn listen() {
    static ONCE: Once = Once::new();
    // SAFETY: the function is static and needs no data.
    ONCE.call_once(|| unsafe { c::dds_set_log_sink(Some(hear), ptr::null_mut()) });
}

unsafe extern "C" fn hear(_nothing: *mut c_void, said: *const c::dds_log_data_t) {
    // SAFETY: the message is valid for the duration of the call; its text is nul-terminated.
    let (priority, line) =
        unsafe { ((*said).priority, CStr::from_ptr((*said).message).to_string_lossy()) };
    let line = line.trim();
    match &mut *lock() {
        Some(joining) => joining.push(line.to_owned()),
        None if priority & (c::DDS_LC_ERROR | c::DDS_LC_FATAL) != 0 => {
            tracing::error!("Cyclone DDS: {line}");
        }
        None => tracing::warn!("Cyclone DDS: {line}"),
    }
}

fn lock() -> MutexGuard<'static, Option<Vec<String>>> {
    JOINING.lock().unwrap_or_else(PoisonError::into_inner)
}
