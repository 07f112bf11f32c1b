//! Repairing damaged bags.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use mcap::records::{MessageHeader, op};
use teampulse_core::counted::counted;
use teampulse_core::time::Time;
use teampulse_messages::convert::schema_of;

use crate::claim::claim;
use crate::error::{BagError, Found};
use crate::metadata::{
    FILE_NAME, FileSpan, Metadata, ParsedMetadata, ROSBAG2_RECORD, SERIALIZED_KEY, Topic,
};
use crate::private;
use crate::read::block::Entry;
use crate::read::index::{Damage, Index};
use crate::read::parse;
use crate::read::{Bag, DAMAGE_NOTE, absent_text};
use crate::write::chunk::Compression;
use crate::write::part::{Attachment, Part};
use crate::write::spare::SpareFile;
use teampulse_messages::convert::type_name;

/// The result of repairing a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The files, in the order of the bag.
    pub files: Vec<RecoveredFile>,
    /// The files that `metadata.yaml` listed but the folder did not contain; it no longer lists them, and notes their
    /// loss.
    pub absent: Vec<PathBuf>,
}

/// The result of repairing one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecoveredFile {
    /// The file.
    pub path: PathBuf,
    /// The number of messages that the file contains now.
    pub messages: u64,
    /// The number of original messages that are missing now; `None` if it is unknown, because bytes could not be read
    /// and nothing states how many messages there were.
    pub lost_messages: Option<u64>,
    /// The parts that were cut from the file; empty for an intact file, which is not changed.
    pub damage: Vec<Damage>,
    /// Whether any of the file's messages had no checksum, so that changed bytes in them can't be found.
    pub lacked_checksums: bool,
    /// The path of the damaged original, kept if anything was lost from its middle.
    pub original: Option<PathBuf>,
}

impl RecoveredFile {
    /// Whether recorded messages were lost; the end of an unfinished recording does not count.
    pub fn is_lossy(&self) -> bool {
        self.lost_messages.is_some_and(|lost| lost > 0) || self.is_torn()
    }

    fn is_torn(&self) -> bool {
        self.damage.iter().any(|damage| !damage.is_tail)
    }
}

/// Repairs a bag: reads all of it, and rewrites each truncated or damaged file with all intact chunks, in order.
/// `metadata.yaml` is rewritten. A file in a bag's folder is repaired with the whole folder; a lone file stores the
/// notes on its losses in itself.
///
/// A bag that is still being recorded, or being repaired by another program, is refused and not changed. The old file
/// stays until the new one is safely on the disk, and is kept as `<name>.mcap.orig` if anything was lost from its
/// middle.
pub fn recover(path: &Path) -> Result<Report, BagError> {
    let path = folder_with(path).unwrap_or(path);
    let mut bag = Bag::open(path)?;
    if let Some(made) = bag.parts().iter().find(|part| part.is_made) {
        return Err(BagError::NotABag { path: made.path.clone(), found: Found::Foreign });
    }
    if let Some(part) = bag.parts().iter().find(|part| !claim(&part.file)) {
        return Err(BagError::InUse { path: part.path.clone() });
    }
    let stated = bag.stated_messages();
    let lone = (!path.is_dir()).then(|| describe(&bag));
    let parts = bag.parts_mut().iter_mut().zip(stated);
    let recovered = parts.map(|(part, stated)| recover_file(part, stated, lone.clone()));
    let files: Vec<RecoveredFile> = recovered.collect::<Result<_, _>>()?;
    let absent = bag.absent().to_vec();
    drop(bag);
    if path.is_dir() {
        let bag = Bag::open(path)?;
        let mut metadata = describe(&bag);
        note_losses(&files, &mut metadata);
        note_absent(&bag, &mut metadata);
        metadata.save(path).map_err(BagError::io("write", path))?;
    }
    Ok(Report { files, absent })
}

/// The folder of the bag to which a file belongs.
pub fn folder_with(path: &Path) -> Option<&Path> {
    let folder = path.parent().filter(|_| path.is_file())?;
    let text = fs::read_to_string(folder.join(FILE_NAME)).ok()?;
    let name = path.file_name()?.to_str()?;
    ParsedMetadata::read(&text).files.iter().any(|file| file == name).then_some(folder)
}

/// Notes the losses, as the repaired files no longer show them.
fn note_losses(files: &[RecoveredFile], metadata: &mut Metadata) {
    let lossy = files.iter().filter(|file| !file.damage.is_empty() && file.is_lossy());
    let lost = lossy.map(|file| {
        let name = file.path.file_name().unwrap_or_default().to_string_lossy();
        let lost = file.lost_messages.map_or_else(
            || "an unknown number of messages were".into(),
            |lost| counted(lost, "message was", "messages were"),
        );
        format!("{name}: {lost} lost to damage")
    });
    note(lost, metadata);
}

/// Notes the missing files, as the metadata no longer list them.
fn note_absent(bag: &Bag, metadata: &mut Metadata) {
    let files = bag.files_count();
    note(bag.absent().iter().map(|file| absent_text(file, files)), metadata);
}

/// Adds to the notes on damage.
fn note(losses: impl Iterator<Item = String>, metadata: &mut Metadata) {
    let before = metadata.custom.remove(DAMAGE_NOTE);
    let notes: Vec<String> = before.into_iter().chain(losses).collect();
    if !notes.is_empty() {
        metadata.custom.insert(DAMAGE_NOTE.into(), notes.join("; "));
    }
}

/// Repairs a file; a lone file gets the metadata of its bag, in which its losses are noted.
fn recover_file(
    index: &mut Index,
    stated_messages: Option<u64>,
    mut lone: Option<Metadata>,
) -> Result<RecoveredFile, BagError> {
    index.check();
    let mut recovered = RecoveredFile {
        path: index.path.clone(),
        messages: index.span.messages,
        lost_messages: None,
        damage: index.damage.clone(),
        lacked_checksums: index.lacks_checksums,
        original: None,
    };
    if !recovered.damage.is_empty() {
        let found = recovered.clone();
        let noted = |messages| {
            let kept = RecoveredFile { messages, ..found };
            let lost_messages = lost_messages(&kept, stated_messages);
            note_losses(&[RecoveredFile { lost_messages, ..kept }], lone.as_mut()?);
            lone
        };
        replace(index, noted, &mut recovered)?;
    }
    recovered.lost_messages = lost_messages(&recovered, stated_messages);
    Ok(recovered)
}

/// The number of missing messages. If a file has more messages than stated, the statement was made before the file was
/// complete.
fn lost_messages(file: &RecoveredFile, stated_messages: Option<u64>) -> Option<u64> {
    let lost = stated_messages.and_then(|stated| stated.checked_sub(file.messages));
    let is_read = file.damage.iter().all(|damage| damage.lost_bytes == 0);
    lost.or(is_read.then_some(0))
}

/// Replaces a damaged file by its repaired version, with the metadata returned for the number of messages kept.
fn replace(
    index: &Index,
    noted: impl FnOnce(u64) -> Option<Metadata>,
    recovered: &mut RecoveredFile,
) -> Result<(), BagError> {
    let path = &index.path;
    let unfinished = path.with_extension("mcap.recovering");
    recovered.messages =
        rewrite(index, noted, &unfinished).inspect_err(|_| drop(fs::remove_file(&unfinished)))?;
    if recovered.is_torn() {
        let original = free_name(path);
        fs::rename(path, &original).map_err(BagError::io("write", &original))?;
        recovered.original = Some(original);
    }
    let folder = folder_of(path);
    fs::rename(&unfinished, path).map_err(BagError::io("write", path))?;
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(BagError::io("write", folder))
}

/// The name for a damaged original: `<name>.mcap.orig`, with a numeric suffix if that exists.
fn free_name(path: &Path) -> PathBuf {
    let numbered = (2..).map(|number| path.with_extension(format!("mcap.orig{number}")));
    let mut names = std::iter::once(path.with_extension("mcap.orig")).chain(numbered);
    names.find(|name| !name.exists()).expect("there are more numbers than files")
}

/// Writes everything readable to another file and syncs it; returns the number of messages. `noted` receives that
/// number and returns the metadata to write.
fn rewrite(
    index: &Index,
    noted: impl FnOnce(u64) -> Option<Metadata>,
    path: &Path,
) -> Result<u64, BagError> {
    let file = private::create(path).map_err(BagError::io("write", path))?;
    let disk = file.try_clone().map_err(BagError::io("write", path))?;
    let spare = Arc::new(Mutex::new(SpareFile::new(folder_of(path))));
    let mut part = Part::begin(path, file, spare, Compression::Zstd)?;
    copy_extras(index, &mut part)?;
    if let Some(metadata) = noted(copy_messages(index, &mut part)?) {
        let metadata = BTreeMap::from([(SERIALIZED_KEY.to_owned(), metadata.body())]);
        part.annotate(ROSBAG2_RECORD, &metadata)?;
    }
    let ended = part.finish()?;
    if ended.is_full {
        return Err(BagError::DiskFull { path: folder_of(path).to_owned() });
    }
    disk.sync_all().map_err(BagError::io("write", path))?;
    Ok(ended.file.span.messages)
}

fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Copies attachments and metadata records; unreadable ones are skipped.
fn copy_extras(index: &Index, part: &mut Part<File>) -> Result<(), BagError> {
    for extra in &index.extras {
        let Ok(body) = index.read_extra(extra) else { continue };
        if let Ok(attachment) = parse::attachment(&body)
            && extra.opcode == op::ATTACHMENT
        {
            part.attach(Attachment {
                name: &attachment.name,
                media_type: &attachment.media_type,
                log_time: Time::from_nanos(attachment.log_time as i64),
                bytes: attachment.bytes,
            })?;
        } else if let Ok((name, metadata)) = parse::metadata(&body)
            && extra.opcode == op::METADATA
        {
            part.annotate(&name, &metadata)?;
        }
    }
    Ok(())
}

/// Copies all messages in file order, each to its original channel; returns their number.
fn copy_messages(index: &Index, part: &mut Part<File>) -> Result<u64, BagError> {
    let mut messages = 0;
    let mut channels = BTreeMap::new();
    for (id, channel) in &index.channels {
        channels.insert(*id, part.channel(channel)?);
    }
    for block in &index.blocks {
        let Ok(contents) = block.load(&index.file) else { continue };
        let mut entries = contents.entries;
        entries.sort_by_key(|entry| entry.start);
        for entry in entries {
            let Some(channel_id) = channels.get(&entry.channel).copied() else { continue };
            let Entry { sequence, log_time, publish_time, .. } = entry;
            let header = MessageHeader { channel_id, sequence, log_time, publish_time };
            part.write(&header, &contents.records[entry.start..entry.end])?;
            messages += 1;
        }
    }
    Ok(messages)
}

/// The metadata of a bag for `metadata.yaml`.
fn describe(bag: &Bag) -> Metadata {
    let topics = bag.streams().iter().map(|known| Topic {
        name: known.stream.name.clone(),
        type_name: type_name(&known.stream.shape).to_owned(),
        type_hash: schema_of(&known.stream.shape).hash.clone(),
        qos: known.stream.qos.clone(),
        messages: known.messages,
    });
    let files = bag.parts().iter().map(|part| {
        let name = part.path.file_name().unwrap_or_default();
        FileSpan { path: name.to_string_lossy().into_owned(), span: part.span }
    });
    Metadata {
        version: bag.metadata_version(),
        topics: topics.collect(),
        files: files.collect(),
        custom: bag.notes().clone(),
    }
}
