//! Any text, as a browser of the dashboard may send it: it is answered or refused in a few bytes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_dashboard::receive_any;

fuzz_target!(|text: &str| {
    assert!(receive_any(text) < 10_000 + 2 * text.len() as u64);
});
