//! Making a damaged bag whole again.

use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use mcap::McapResult;
use mcap::records::{MessageHeader, Record, op};
use teampulse_core::time::Time;

use crate::error::BagError;
use crate::index::{Damage, Index};
use crate::metadata::{FILE_NAME, FileSpan, Metadata, Topic, Version};
use crate::part::{Attachment, Compression, Part};
use crate::reader::Bag;
use crate::schema::type_name;
use crate::spare::SpareFile;

/// What was done to a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Each file, in the bag's order.
    pub files: Vec<RecoveredFile>,
}

/// What was done to one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecoveredFile {
    /// The file.
    pub path: PathBuf,
    /// How many messages it holds now.
    pub messages: u64,
    /// What was cut from it; empty for a file that was whole and was left as it is.
    pub damage: Vec<Damage>,
}

/// Makes a bag whole: each file that was cut or damaged is written anew with all that can be read
/// of it, in its order, and then takes the place of the old one. `metadata.yaml` is written again.
///
/// The old file stays until the new one is safely on the disk.
pub fn recover(path: &Path) -> Result<Report, BagError> {
    let bag = Bag::open(path)?;
    let files = bag.parts().iter().map(recover_file).collect::<Result<Vec<_>, _>>()?;
    let is_folder = path.is_dir();
    if is_folder {
        let bag = Bag::open(path)?;
        describe(&bag).save(path).map_err(BagError::io("write", path))?;
    }
    Ok(Report { files })
}

fn recover_file(index: &Index) -> Result<RecoveredFile, BagError> {
    let damage = index.damage.clone();
    let path = index.path.clone();
    if damage.is_empty() {
        return Ok(RecoveredFile { path, messages: index.span.messages, damage });
    }
    let unfinished = path.with_extension("mcap.recovering");
    let file = OpenOptions::new().write(true).create(true).truncate(true).open(&unfinished);
    let file = file.map_err(BagError::io("write", &unfinished))?;
    let disk = file.try_clone().map_err(BagError::io("write", &unfinished))?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let spare = Arc::new(Mutex::new(SpareFile::new(folder)));
    let mut part = Part::begin(&unfinished, file, spare, Compression::Zstd)?;
    copy_extras(index, &mut part)?;
    copy_messages(index, &mut part)?;
    let messages = part.finish()?.span.messages;
    disk.sync_all().map_err(BagError::io("write", &unfinished))?;
    fs::rename(&unfinished, &path).map_err(BagError::io("write", &path))?;
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(BagError::io("write", folder))?;
    Ok(RecoveredFile { path, messages, damage })
}

/// Copies attachments and metadata records; one that can't be read is left out.
fn copy_extras(index: &Index, part: &mut Part<File>) -> Result<(), BagError> {
    for extra in &index.extras {
        let copied = index.read_extra(extra, |record| match record {
            Record::Attachment { header, data, .. } => part.attach(Attachment {
                name: &header.name,
                media_type: &header.media_type,
                log_time: Time::from_nanos(header.log_time as i64),
                bytes: &data,
            }),
            Record::Metadata(metadata) => part.annotate(&metadata.name, metadata.metadata),
            _ => Ok(()),
        });
        if let Ok(written) = copied {
            written?;
        }
    }
    Ok(())
}

/// Copies all messages as they stand in the file, each to the channel that it was in.
fn copy_messages(index: &Index, part: &mut Part<File>) -> Result<(), BagError> {
    for block in &index.blocks {
        let Ok(contents) = block.load(&index.file) else { continue };
        let mut entries = contents.entries;
        entries.sort_by_key(|entry| entry.start);
        for entry in entries {
            let Some(channel) = index.channels.get(&entry.channel) else { continue };
            let header = MessageHeader {
                channel_id: part.channel(channel)?,
                sequence: entry.sequence,
                log_time: entry.log_time,
                publish_time: entry.publish_time,
            };
            part.write(&header, &contents.records[entry.start..entry.end])?;
        }
    }
    Ok(())
}

/// What `metadata.yaml` has to say about a bag.
fn describe(bag: &Bag) -> Metadata {
    let topics = bag.streams().iter().map(|known| Topic {
        name: known.stream.name.clone(),
        type_name: type_name(&known.stream.shape).to_owned(),
        type_hash: hash(known),
        qos: known.stream.qos.clone(),
        messages: known.messages,
    });
    let files = bag.parts().iter().map(|part| {
        let name = part.path.file_name().unwrap_or_default();
        FileSpan { path: name.to_string_lossy().into_owned(), span: part.span }
    });
    Metadata {
        version: Version::V9,
        topics: topics.collect(),
        files: files.collect(),
        custom: bag.notes().clone(),
    }
}
