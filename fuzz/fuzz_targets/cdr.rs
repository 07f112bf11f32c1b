//! Any bytes, read as any message that is known: an error or a message, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_messages::audio::{AUDIO_DATA, AUDIO_DATA_STAMPED, AudioBlock, AudioInfo};
use teampulse_messages::catalogue::{names, shipped};
use teampulse_messages::convert;
use teampulse_messages::definition::Definition;
use teampulse_messages::fields::{Fields, numbers};
use teampulse_messages::hri;
use teampulse_messages::standard::rmw_dds_common::ParticipantEntitiesInfo;
use teampulse_messages::value::flatten;

fuzz_target!(|input: (usize, &[u8])| {
    let (which, cdr) = input;
    let name = names().nth(which % names().count()).expect("types are shipped");
    let schema = shipped(name).expect("a listed type is shipped");
    let definition = Definition::of(&schema).expect("what is shipped is a definition");
    let fields =
        Fields::compile(&definition, &numbers(&definition)).expect("what is listed is there");
    let listed = flatten(&definition, cdr, 100);
    let read = fields.read(cdr, &mut Vec::new());
    assert!(listed.is_err() || read.is_ok());
    drop(convert::decode(name, cdr));
    drop(ParticipantEntitiesInfo::decode(cdr));
    for kind in hri::Kind::ALL {
        for frame in [None, Some([640, 480])] {
            let seen = kind.read(cdr, frame);
            assert!(seen.is_err() || seen.is_ok_and(|seen| seen.numbers.len() == kind.channels(frame).len()));
        }
    }
    let info = AudioInfo::read(cdr);
    for name in [AUDIO_DATA, AUDIO_DATA_STAMPED] {
        let block = AudioBlock::read(name, &cdr.to_vec().into()).expect("the type has sound");
        if let (Ok(info), Ok(block)) = (&info, block) {
            assert!(info.first_channel(&block.data).count() <= block.data.len());
        }
    }
});
