//! Any text as a definition, and any bytes as its message.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{Fields, numbers};
use teampulse_messages::value::flatten;

fuzz_target!(|input: (&str, &[u8])| {
    let (text, cdr) = input;
    let Ok(definition) = Definition::parse("a_msgs/msg/A", text) else { return };
    assert_eq!(definition.hash().len(), "RIHS01_".len() + 64);
    let fields =
        Fields::compile(&definition, &numbers(&definition)).expect("what is listed is there");
    let listed = flatten(&definition, cdr, 100);
    assert!(listed.is_err() || fields.read(cdr, &mut Vec::new()).is_ok());
});
