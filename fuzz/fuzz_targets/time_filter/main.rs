//! Any stamps, values, settings and moments, given to the time filter: no panic, no endless loop,
//! no more memory and no more rows than it says.
#![no_main]

mod bytes;
mod alignment;
mod matching;
mod clocks;

use libfuzzer_sys::fuzz_target;

use self::bytes::Bytes;

fuzz_target!(|input: &[u8]| {
    let mut bytes = Bytes::new(input);
    match bytes.below(4) {
        0 | 1 => alignment::drive(&mut bytes),
        2 => matching::drive(&mut bytes),
        _ => clocks::drive(&mut bytes),
    }
});
