//! Reading a bag.

pub(crate) mod records;
mod fields;
pub(crate) mod parse;
mod chunk;
mod foreign;
mod sqlite;
mod ros1;
pub(crate) mod block;
pub(crate) mod index;
mod landmark;
mod scan;
pub(crate) mod messages;
mod notes;

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::McapError;
use mcap::records::op;
use teampulse_core::counted::counted;
use teampulse_core::stream::{Origin, Schema, Shape, Stream};
use teampulse_core::time::Time;
use teampulse_messages::convert::description;

use crate::channel::Channel;
use crate::error::{BagError, Found};
use crate::metadata::{FILE_NAME, ParsedMetadata, Span, Version};
use crate::read::foreign::KINDS;
use crate::read::index::{Damage, Index};
use crate::read::messages::Messages;
use crate::read::notes::kept_notes;
use teampulse_messages::convert::type_name;

/// The key of the note that lists what was lost to damage before a bag was repaired or recomputed.
pub const DAMAGE_NOTE: &str = "teampulse.damage";

/// The most missing files that are named for one gap in the numbers of files.
const MOST_MISSING: usize = 1000;

/// A bag: everything known about it without reading its messages.
///
/// Bags of other writers can be opened, too, and so can truncated bags, which are read as far as possible; see
/// [`Bag::damage`].
#[derive(Debug)]
pub struct Bag {
    path: PathBuf,
    parts: Vec<Index>,
    streams: Vec<BagStream>,
    /// The indices of the streams.
    places: HashMap<Key, usize>,
    /// The streams of each part's channels.
    channels: Vec<BTreeMap<u16, Carried>>,
    metadata: ParsedMetadata,
    /// The files that `metadata.yaml` lists but the folder does not contain.
    absent: Vec<PathBuf>,
}

/// The index of a channel's stream, with its type as that channel knows it.
#[derive(Clone, Debug)]
pub(crate) struct Carried {
    pub stream: usize,
    pub schema: Arc<Schema>,
}

/// A stream of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct BagStream {
    /// The stream according to its last description.
    pub stream: Arc<Stream>,
    /// The number of messages of this stream in the bag.
    pub messages: u64,
    /// Whether the stream was recorded by software other than teampulse.
    pub(crate) is_foreign: bool,
    /// Whether stamps must be parsed from the messages.
    pub(crate) has_unread_headers: bool,
    /// The versions of the stream's type, in order of appearance.
    pub(crate) schemas: Vec<Arc<Schema>>,
}

impl Bag {
    /// Opens a bag folder, or a single MCAP file.
    pub fn open(path: &Path) -> Result<Bag, BagError> {
        let (files, metadata) = if path.is_dir() { files_of(path)? } else { only(path) };
        let (files, absent) = present(files);
        let parts = files.iter().map(|file| Index::open(file)).collect::<Result<Vec<_>, _>>()?;
        if !path.is_dir() && parts.iter().all(Index::is_empty_file) {
            return Err(BagError::NotABag { path: path.to_owned(), found: Found::Empty });
        }
        let (streams, places, channels) = (Vec::new(), HashMap::new(), Vec::new());
        let path = path.to_owned();
        let mut bag = Bag { path, parts, streams, places, channels, metadata, absent };
        bag.gather_streams();
        bag.read_descriptions();
        if !bag.notes().keys().any(|key| key.starts_with("lost_source:")) {
            let mut notes = kept_notes(&bag.parts);
            notes.append(&mut bag.metadata.custom);
            bag.metadata.custom = notes;
        }
        Ok(bag)
    }

    /// The path of the bag.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The streams of the bag: topics with one type each, raw and derived separately; in the order of their channels.
    pub fn streams(&self) -> &[BagStream] {
        &self.streams
    }

    /// The number of messages in the bag.
    pub fn messages_count(&self) -> u64 {
        self.span().messages
    }

    /// The log times of the first and the last message; `None` for an empty bag.
    pub fn bounds(&self) -> Option<(Time, Time)> {
        let span = self.span();
        (span.messages > 0).then_some((span.first, span.last))
    }

    /// The writer's notes about the recording: the session's name, counts of lost messages.
    pub fn notes(&self) -> &BTreeMap<String, String> {
        &self.metadata.custom
    }

    /// The damaged parts of the bag, each with its file.
    pub fn damage(&self) -> impl Iterator<Item = (&Path, &Damage)> {
        let parts = self.parts.iter();
        parts.flat_map(|part| part.damage.iter().map(|damage| (part.path.as_path(), damage)))
    }

    /// The files that the bag's `metadata.yaml` lists but its folder does not contain. All other files are read.
    pub fn absent(&self) -> &[PathBuf] {
        &self.absent
    }

    /// The number of files of the bag, including absent ones.
    pub fn files_count(&self) -> usize {
        self.parts.len() + self.absent.len()
    }

    /// Whether any of the bag's messages have no checksum, so that changed bytes in them can't be found; known after
    /// [`Bag::check`].
    pub fn lacks_checksums(&self) -> bool {
        self.parts.iter().any(|part| part.lacks_checksums)
    }

    /// Whether the bag was still being recorded when it was opened: it is then as complete as at the last sync.
    pub fn is_being_recorded(&self) -> bool {
        self.parts.iter().any(|part| part.is_open)
    }

    /// Whether [`recover`](crate::recover) can repair the bag: it must be plain MCAP, and nobody may be writing it.
    pub fn can_be_repaired(&self) -> bool {
        !self.is_being_recorded() && self.parts.iter().all(|part| !part.is_made)
    }

    /// Reads the whole bag, so that [`Bag::damage`] lists each unreadable part.
    pub fn check(&mut self) {
        self.parts.iter_mut().for_each(Index::check);
    }

    /// A short description of the messages lost to damage; `None` if none are known to be lost. It is
    /// available only after [`Bag::check`]. The missing end of an unfinished file does not count, as
    /// nothing before it was lost.
    pub fn lost_to_damage(&self) -> Option<String> {
        let torn: Vec<&Damage> =
            self.damage().map(|(_, damage)| damage).filter(|damage| !damage.is_tail).collect();
        let bytes: u64 = torn.iter().map(|damage| damage.lost_bytes).sum();
        let unread = (!torn.is_empty()).then(|| {
            format!("{} can't be read (parts: {})", counted(bytes, "byte", "bytes"), torn.len())
        });
        let missing = Some(self.missing()).filter(|missing| *missing > 0);
        let missing =
            missing.map(|missing| counted(missing, "message is missing", "messages are missing"));
        let before = self.notes().get(DAMAGE_NOTE).cloned();
        let absent = self.absent.iter().map(|file| absent_text(file, self.files_count()));
        let damage: Vec<String> =
            before.into_iter().chain(unread).chain(missing).chain(absent).collect();
        (!damage.is_empty()).then(|| damage.join("; "))
    }

    /// The number of messages that are missing, although statistics or `metadata.yaml` state that they were written;
    /// without the messages of [absent](Bag::absent) files.
    pub fn missing(&self) -> u64 {
        let parts = self.parts.iter().zip(self.stated_messages());
        parts.map(|(part, stated)| stated.unwrap_or(0).saturating_sub(part.span.messages)).sum()
    }

    /// The contents of the last attachment with this name; `None` if there is none.
    pub fn attachment(&self, name: &str) -> Result<Option<Vec<u8>>, BagError> {
        let mut found = None;
        for part in &self.parts {
            for extra in part.extras.iter().filter(|extra| extra.opcode == op::ATTACHMENT) {
                let damaged = |error: McapError| BagError::Damaged {
                    path: part.path.clone(),
                    offset: extra.offset,
                    reason: error.to_string(),
                };
                let body = part.read_extra(extra).map_err(damaged)?;
                let attachment = parse::attachment(&body).map_err(damaged)?;
                if attachment.name == name {
                    found = Some(attachment.bytes.to_vec());
                }
            }
        }
        Ok(found)
    }

    /// All messages, or those from a log time on.
    pub fn messages(&self, from: Option<Time>) -> Messages<'_> {
        Messages::new(self, from)
    }

    pub(crate) fn parts(&self) -> &[Index] {
        &self.parts
    }

    pub(crate) fn parts_mut(&mut self) -> &mut [Index] {
        &mut self.parts
    }

    /// The number of messages written to each part, according to its statistics, else to `metadata.yaml`. The latter
    /// states 0 for an unfinished file, as it is written when the file begins.
    pub(crate) fn stated_messages(&self) -> Vec<Option<u64>> {
        let stated = |part: &Index| {
            let name = part.path.file_name()?.to_str()?;
            let described = self.metadata.messages.get(name).copied();
            part.stated_messages.max(described.filter(|messages| *messages > 0))
        };
        self.parts.iter().map(stated).collect()
    }

    pub(crate) fn carried(&self, part: usize, channel: u16) -> Option<&Carried> {
        self.channels.get(part)?.get(&channel)
    }

    pub(crate) fn metadata_version(&self) -> Version {
        self.metadata.version
    }

    fn span(&self) -> Span {
        self.parts.iter().fold(Span::default(), |all, part| all.join(part.span))
    }

    fn gather_streams(&mut self) {
        for part in &self.parts {
            let mut channels = BTreeMap::new();
            for (id, channel) in &part.channels {
                let stream = place_of(&mut self.streams, &mut self.places, channel);
                self.streams[stream].messages += part.counts.get(id).copied().unwrap_or(0);
                channels.insert(*id, Carried { stream, schema: Arc::clone(&channel.schema) });
            }
            self.channels.push(channels);
        }
    }

    /// Describes streams of other writers that have no description, by their topics and types.
    pub fn describe_foreign(&mut self, describe: impl Fn(&str, &str) -> Option<Stream>) {
        for known in self.streams.iter_mut().filter(|known| known.is_foreign) {
            let is_blank = known.stream.channels.is_empty();
            let description = describe(&known.stream.name, type_name(&known.stream.shape));
            if let Some(description) = description.filter(|_| is_blank) {
                known.stream = Arc::new(described(&known.stream, &description));
            }
        }
    }

    /// Completes the streams from their descriptions. An unreadable description is skipped: the stream
    /// stays as its channel describes it.
    fn read_descriptions(&mut self) {
        let mut described = Vec::new();
        for part in &self.parts {
            for place in &part.describing {
                let Ok(contents) = part.blocks[*place].load(&part.file) else { continue };
                let entries = contents.entries.iter();
                described.extend(entries.filter_map(|entry| {
                    let channel = part.channels.get(&entry.channel)?;
                    let record = contents.records.get(entry.start..entry.end)?;
                    part.describes(entry.channel)
                        .then(|| description(&channel.schema, record).ok())?
                }));
            }
        }
        for description in described {
            self.describe(&description);
        }
    }

    fn describe(&mut self, description: &Stream) {
        if let Some(place) = self.place(description) {
            let known = &mut self.streams[place];
            known.stream = Arc::new(described(&known.stream, description));
        }
    }

    /// The index of the stream to which a description belongs.
    pub(crate) fn place(&self, description: &Stream) -> Option<usize> {
        self.places.get(&key(description)).copied()
    }
}

/// The stream of a channel, completed by its description: the type and the quality of service stay those of
/// the channel.
pub(crate) fn described(channel: &Stream, description: &Stream) -> Stream {
    Stream {
        shape: channel.shape.clone(),
        publisher: channel.publisher.clone(),
        qos: channel.qos.clone(),
        ..description.clone()
    }
}

/// The key of a stream in a bag: its name, its origin and its type.
type Key = (String, Origin, String);

fn key(stream: &Stream) -> Key {
    (stream.name.clone(), stream.origin, type_name(&stream.shape).to_owned())
}

/// The index of a channel's stream in the bag, which is added if it is new; a definition that is found later replaces
/// an empty one.
fn place_of(
    streams: &mut Vec<BagStream>,
    places: &mut HashMap<Key, usize>,
    channel: &Channel,
) -> usize {
    let stream = channel.stream();
    let schema = Arc::clone(&channel.schema);
    let key = key(&stream);
    let Some(&place) = places.get(&key) else {
        places.insert(key, streams.len());
        let stream = Arc::new(stream);
        let has_unread_headers = channel.has_unread_headers();
        let is_foreign = channel.is_foreign();
        let schemas = vec![schema];
        streams.push(BagStream { stream, messages: 0, is_foreign, has_unread_headers, schemas });
        return streams.len() - 1;
    };
    let known = &mut streams[place];
    if !known.schemas.contains(&schema) {
        known.schemas.push(schema);
    }
    if let Shape::Message(schema) = &known.stream.shape
        && schema.text.is_empty()
    {
        known.stream = Arc::new(stream);
    }
    place
}

/// The text that reports a missing file of a bag with this many files.
pub fn absent_text(file: &Path, files: usize) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    format!("{name}, one of its {files} files, is missing")
}

/// Splits files into existing and missing ones. If none exists, all count as existing, so that opening them reports the
/// error.
fn present(files: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let (present, absent): (Vec<PathBuf>, Vec<PathBuf>) =
        files.into_iter().partition(|file| file.symlink_metadata().is_ok());
    if present.is_empty() { (absent, present) } else { (present, absent) }
}

fn only(file: &Path) -> (Vec<PathBuf>, ParsedMetadata) {
    (vec![file.to_owned()], ParsedMetadata::default())
}

/// The files of a bag's folder, in order: as listed in `metadata.yaml`, otherwise by number.
fn files_of(folder: &Path) -> Result<(Vec<PathBuf>, ParsedMetadata), BagError> {
    let text = fs::read_to_string(folder.join(FILE_NAME)).unwrap_or_default();
    let metadata = ParsedMetadata::read(&text);
    let not_a_bag = |found| Err(BagError::NotABag { path: folder.to_owned(), found });
    let is_compressed =
        !matches!(metadata.compression_mode.to_ascii_uppercase().as_str(), "" | "NONE");
    if is_compressed && !matches!(metadata.compression_format.as_str(), "" | "zstd") {
        return not_a_bag(Found::Compressed);
    }
    // Older versions prefixed file names with the folder's name.
    let named =
        metadata.files.iter().filter_map(|file| Some(folder.join(Path::new(file).file_name()?)));
    let mut files: Vec<PathBuf> = named.collect();
    let is_listed = !files.is_empty();
    let found = files_in(folder)?;
    for found in if is_listed { found } else { with_gaps(&found) } {
        // A decompressed copy that rosbag2 left beside the compressed file counts as the same file.
        if !files.iter().any(|file| unpacked_name(file) == unpacked_name(&found)) {
            files.push(found);
        }
    }
    // Files may be listed by their final names, or by their names before compression.
    for file in &mut files {
        let packed = PathBuf::from(format!("{}.zstd", file.display()));
        if !file.exists() && packed.exists() {
            *file = packed;
        }
    }
    if files.is_empty() { not_a_bag(Found::NoFiles) } else { Ok((files, metadata)) }
}

/// Numbered files from 0 on, including the missing ones between them.
fn with_gaps(files: &[PathBuf]) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = Vec::with_capacity(files.len());
    for file in files {
        if let (Some((name, number, kind)), Some(last)) = (numbered(file), all.last())
            && let Some((_, before, _)) = numbered(last).filter(|(other, ..)| *other == name)
            && files.contains(&file.with_file_name(format!("{name}_0.{kind}")))
        {
            let missing = (before..number).skip(1).take(MOST_MISSING);
            all.extend(missing.map(|at| file.with_file_name(format!("{name}_{at}.{kind}"))));
        }
        all.push(file.clone());
    }
    all
}

/// Splits the name of a numbered file: `b_1.mcap` into `b`, 1 and `mcap`.
fn numbered(file: &Path) -> Option<(&str, u64, &str)> {
    let (stem, kind) = file.file_name()?.to_str()?.split_once('.')?;
    let (name, number) = stem.rsplit_once('_')?;
    Some((name, number.parse().ok()?, kind))
}

/// A file's name without the extension for compression.
fn unpacked_name(file: &Path) -> PathBuf {
    if file.extension().is_some_and(|kind| kind == "zstd") {
        file.with_extension("")
    } else {
        file.to_owned()
    }
}

/// The files of recordings in a folder, in numerical order for each recording; compressed files come after plain ones.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, BagError> {
    let entries = fs::read_dir(folder).map_err(BagError::io("open", folder))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_part = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        KINDS.iter().any(|kind| name.ends_with(kind))
    };
    let mut files: Vec<PathBuf> = paths.filter(is_part).collect();
    files.sort_by_cached_key(|path| {
        let path = unpacked_name(path);
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (name, number) = stem.rsplit_once('_').unwrap_or((&stem, ""));
        (name.to_owned(), number.parse::<u64>().unwrap_or(u64::MAX), stem.clone())
    });
    Ok(files)
}
