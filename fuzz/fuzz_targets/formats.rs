//! Any bytes as a file of a device: signals or an error, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_formats::{edf, embrace_plus, read, xdf};

fuzz_target!(|bytes: &[u8]| {
    let _ = read(bytes);
    let _ = embrace_plus::read(&[embrace_plus::MAGIC, bytes].concat());
    let _ = xdf::read(&[xdf::MAGIC, bytes].concat());
    let _ = edf::read(&[edf::EDF_MAGIC, bytes].concat());
});
