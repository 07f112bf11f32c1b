//! Any text, read as a study: an error or a study, never a panic.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use teampulse::study::Study;

fuzz_target!(|text: String| {
    drop(Study::parse(Path::new("study.toml"), text));
});
