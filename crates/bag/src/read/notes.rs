//! The notes of a recording whose `metadata.yaml` has none.

use std::collections::BTreeMap;

use teampulse_core::data::Data;
use teampulse_core::stream::Shape;
use teampulse_messages::convert::decode;

use crate::read::block::Block;
use crate::read::index::Index;
use teampulse_messages::convert::type_name;

/// The number of blocks at the end of a file that are searched for statuses, which are written every
/// second.
const LAST_BLOCKS: usize = 8;

/// The notes from the last copy of `metadata.yaml` in the files or, if there is no copy, the losses from the last
/// statuses.
pub(crate) fn kept_notes(parts: &[Index]) -> BTreeMap<String, String> {
    let kept = |part: &Index| part.extras.iter().rev().find_map(|extra| part.read_notes(extra));
    let mut parts = parts.iter().rev();
    match parts.next() {
        Some(last) => kept(last).unwrap_or_else(|| last_losses(last)),
        None => BTreeMap::new(),
    }
}

fn last_losses(part: &Index) -> BTreeMap<String, String> {
    let mut notes = BTreeMap::new();
    let status = type_name(&Shape::Status);
    if part.channels.values().any(|channel| channel.schema.name == status) {
        let first = part.blocks.len().saturating_sub(LAST_BLOCKS);
        part.blocks[first..].iter().for_each(|block| note_losses(part, block, &mut notes));
    }
    notes
}

/// Adds the losses in the statuses of a block to the notes; an unreadable block is skipped.
fn note_losses(part: &Index, block: &Block, notes: &mut BTreeMap<String, String>) {
    let Ok(contents) = block.load(&part.file) else { return };
    let status = type_name(&Shape::Status);
    for entry in &contents.entries {
        let channel = part.channels.get(&entry.channel);
        if channel.is_some_and(|channel| channel.schema.name == status)
            && let Ok(decoded) = decode(status, &contents.records[entry.start..entry.end])
            && let Data::Status(status) = decoded.data
        {
            let on_the_way = status.lost_source.map_or("unknown".into(), |lost| lost.to_string());
            notes.insert(format!("lost_source:{}", status.name), on_the_way);
            notes.insert(format!("lost_queue:{}", status.name), status.lost_queue.to_string());
        }
    }
}
