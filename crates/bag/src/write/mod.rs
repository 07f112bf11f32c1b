//! Writing a bag.

pub(crate) mod spare;
pub(crate) mod part;
mod file;
pub(crate) mod chunk;
mod summary;
mod out;
mod records;
mod routes;
mod options;

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mcap::records::MessageHeader;
use rustix::process::{Resource, getrlimit};
use teampulse_core::data::Data;
use teampulse_core::sample::{Record, Sample};
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::time::Time;

use crate::claim::claim;
use crate::disk::free_bytes;
use crate::error::BagError;
use crate::metadata::{FileSpan, Metadata, ROSBAG2_RECORD, SERIALIZED_KEY, Span};
use crate::private;
use crate::write::part::{Attachment, Part, nanos};
use crate::write::routes::Routes;
use crate::write::spare::{Spare, SpareFile};
use teampulse_messages::convert::type_name;

pub use options::{Options, Place};

/// The metadata record that states to which session a file belongs.
const SESSION_RECORD: &str = "teampulse";

/// The index size from which a file is followed by another, regardless of the options [bytes]: readers hold
/// the index in memory, where it needs two to three times as much.
const INDEX_BYTES: u64 = 16 << 20;

/// A summary of what was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The bag's folder.
    pub folder: PathBuf,
    /// The number of files.
    pub files: usize,
    /// The number of messages in all files.
    pub messages: u64,
    /// The log time of the first message; [`Time::EPOCH`] if there is none.
    pub first: Time,
    /// The log time of the last message; [`Time::EPOCH`] if there is none.
    pub last: Time,
}

/// A bag being written: a folder of MCAP files with a `metadata.yaml`.
///
/// It uses no thread and no timer: the caller decides when to [`flush`](BagWriter::flush). After
/// [`BagError::DiskFull`] the bag can still be finished; space for that is reserved from the start.
pub struct BagWriter {
    folder: PathBuf,
    name: String,
    options: Options,
    spare: Arc<Mutex<dyn Spare>>,
    part: Part<File>,
    disk: File,
    /// The number of bytes of the current file that were synced.
    synced_bytes: u64,
    finished: Vec<FileSpan>,
    routes: Routes,
    descriptions: Vec<Record>,
    /// The indices of the descriptions with each name.
    described: HashMap<String, Vec<usize>>,
    custom: BTreeMap<String, String>,
    /// The number of messages written since the last complete sync.
    unsynced: u64,
}

impl BagWriter {
    /// Creates the folder, unless it exists for this bag, and starts the first file.
    pub fn create(folder: &Path, options: &Options) -> Result<BagWriter, BagError> {
        match options.place {
            Place::New => create_folder(folder)?,
            Place::Claimed => check_claimed(folder)?,
        }
        Self::begin(folder, options).inspect_err(|_| {
            // Nothing was recorded; if the folder can't be removed, it does no harm.
            drop(fs::remove_dir_all(folder));
        })
    }

    fn begin(folder: &Path, options: &Options) -> Result<BagWriter, BagError> {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let spare: Arc<Mutex<dyn Spare>> = Arc::new(Mutex::new(SpareFile::new(folder)));
        let path = folder.join(format!("{name}_0.mcap"));
        let (part, disk) = begin(&path, &spare, options)?;
        let mut options = options.clone();
        let metadata_version = options.metadata_version;
        if let Some(limit_bytes) = getrlimit(Resource::Fsize).current {
            // Half of this account's file size limit leaves room for the index.
            let most_bytes = limit_bytes / 2;
            options.split_bytes =
                options.split_bytes.or(Some(most_bytes)).map(|at| at.min(most_bytes));
        }
        let mut custom = options.notes.clone();
        custom.insert("session".to_owned(), options.session.clone());
        let mut writer = BagWriter {
            folder: folder.to_owned(),
            name,
            options,
            spare,
            part,
            disk,
            synced_bytes: 0,
            finished: Vec::new(),
            routes: Routes::new(metadata_version),
            descriptions: Vec::new(),
            described: HashMap::new(),
            custom,
            unsynced: 0,
        };
        writer.options.growth.begin(&writer.folder);
        writer.flush()?;
        writer.save_metadata()?;
        Ok(writer)
    }

    /// Appends a sample to its stream's channel.
    pub fn write(&mut self, record: &Record) -> Result<(), BagError> {
        if self.is_split_due(record.sample.log_time) {
            self.split(record.sample.log_time)?;
        }
        self.append(record, record.sample.log_time)?;
        if let Data::Description(described) = &record.sample.data {
            self.keep_description(described, record);
        }
        Ok(())
    }

    /// Syncs all written data to the disk: only data written afterwards can be lost. Also checks the free
    /// space.
    pub fn flush(&mut self) -> Result<(), BagError> {
        if self.part.flush()? {
            self.check_there()?;
            self.disk.sync_data().map_err(BagError::io("write", &self.folder))?;
            self.unsynced = 0;
            self.note_sync()?;
        }
        self.check_full()
    }

    /// The number of messages written since the last flush, which may be lost if the disk fails now.
    pub fn unsynced(&self) -> u64 {
        self.unsynced
    }

    /// Appends an attachment: the study, a calibration.
    pub fn attach(&mut self, attachment: Attachment<'_>) -> Result<(), BagError> {
        self.part.attach(attachment)?;
        self.check_full()
    }

    /// Adds a note about the whole recording, stored in `metadata.yaml` as custom data.
    pub fn note(&mut self, key: &str, value: String) {
        self.custom.insert(key.to_owned(), value);
    }

    /// Finishes the bag.
    pub fn finish(mut self) -> Result<Summary, BagError> {
        // The rest needs the reserved space.
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).release();
        let metadata = self.metadata();
        self.part.annotate(ROSBAG2_RECORD, &serialized(&metadata))?;
        self.part.finish()?;
        self.disk.sync_all().map_err(BagError::io("write", &self.folder))?;
        metadata.save(&self.folder).map_err(BagError::io("write", &self.folder))?;
        self.options.growth.add(length(&self.disk).saturating_sub(self.synced_bytes));
        self.options.growth.finish();
        let Span { messages, first, last } = metadata.span();
        Ok(Summary { folder: self.folder, files: metadata.files.len(), messages, first, last })
    }

    fn append(&mut self, record: &Record, log_time: Time) -> Result<(), BagError> {
        let route = match self.routes.find(record) {
            Some(route) => route,
            None => self.routes.register(record, &mut self.part)?,
        };
        let header = MessageHeader {
            channel_id: route.channel,
            sequence: record.sample.index as u32,
            log_time: nanos(log_time),
            publish_time: nanos(publish_time(record, log_time)),
        };
        self.part.write(&header, &record.cdr)?;
        self.unsynced += 1;
        self.routes.count(route);
        self.check_full()
    }

    fn is_split_due(&self, now: Time) -> bool {
        let span = self.part.span();
        let is_long = |limit_secs| span.messages > 0 && now.secs_since(span.first) >= limit_secs;
        let is_large = |limit_bytes| self.part.written_bytes() >= limit_bytes;
        if self.part.index_bytes() >= INDEX_BYTES {
            return true;
        }
        self.options.split_bytes.is_some_and(is_large)
            || self.options.split_secs.is_some_and(is_long)
    }

    /// Finishes the current file and starts the next, with the descriptions of all streams.
    pub fn split(&mut self, now: Time) -> Result<(), BagError> {
        let number = self.finished.len() + 1;
        let path = self.folder.join(format!("{}_{number}.mcap", self.name));
        let (part, disk) = begin(&path, &self.spare, &self.options)?;
        let metadata = self.metadata();
        self.part.annotate(ROSBAG2_RECORD, &serialized(&metadata))?;
        let ended = std::mem::replace(&mut self.part, part).finish()?;
        self.finished.push(ended.file);
        self.routes.begin_file();
        let disk = std::mem::replace(&mut self.disk, disk);
        disk.sync_all().map_err(BagError::io("write", &self.folder))?;
        self.options.growth.add(length(&disk).saturating_sub(self.synced_bytes));
        self.synced_bytes = 0;
        if ended.is_full {
            return Err(self.disk_full());
        }
        // The metadata are saved before the first message: only finished files have a count other than 0.
        self.save_metadata()?;
        for description in self.descriptions.clone() {
            self.append(&description, now)?;
        }
        Ok(())
    }

    fn keep_description(&mut self, described: &Arc<Stream>, record: &Record) {
        let is_same = |kept: &Record| match &kept.sample.data {
            Data::Description(known) => {
                known.origin == described.origin
                    && type_name(&known.shape) == type_name(&described.shape)
            }
            _ => false,
        };
        let mut named = self.described.get(&described.name).into_iter().flatten();
        if let Some(at) = named.find(|at| is_same(&self.descriptions[**at])) {
            self.descriptions[*at] = record.clone();
            return;
        }
        let at = self.descriptions.len();
        self.described.entry(described.name.clone()).or_default().push(at);
        self.descriptions.push(record.clone());
    }

    fn metadata(&self) -> Metadata {
        let mut files = self.finished.clone();
        files.push(self.part.file_span());
        Metadata {
            version: self.options.metadata_version,
            topics: self.routes.topics(),
            files,
            custom: self.custom.clone(),
        }
    }

    fn save_metadata(&self) -> Result<(), BagError> {
        self.metadata().save(&self.folder).map_err(BagError::io("write", &self.folder))
    }

    fn check_full(&self) -> Result<(), BagError> {
        if self.part.is_full() { Err(self.disk_full()) } else { Ok(()) }
    }

    /// Fails if the file was deleted, as further writes would be lost.
    fn check_there(&self) -> Result<(), BagError> {
        let file = self.disk.metadata().map_err(BagError::io("write", &self.folder))?;
        if file.nlink() == 0 {
            return Err(BagError::Deleted { path: self.folder.clone() });
        }
        Ok(())
    }

    /// Reports the number of bytes on the disk; fails if too little space is left.
    fn note_sync(&mut self) -> Result<(), BagError> {
        let free_bytes = free_bytes(&self.folder).map_err(BagError::io("write", &self.folder))?;
        let written_bytes = self.part.written_bytes();
        let more_bytes = written_bytes.saturating_sub(self.synced_bytes);
        self.options.growth.synced(more_bytes, free_bytes);
        self.synced_bytes = written_bytes;
        if free_bytes < self.options.keep_free_bytes { Err(self.disk_full()) } else { Ok(()) }
    }

    fn disk_full(&self) -> BagError {
        BagError::DiskFull { path: self.folder.clone() }
    }
}

/// The length of a file [bytes]; 0 if it is unknown.
fn length(file: &File) -> u64 {
    file.metadata().map_or(0, |file| file.len())
}

fn create_folder(folder: &Path) -> Result<(), BagError> {
    if let Some(parent) = folder.parent() {
        private::create_folders(parent).map_err(BagError::io("create", parent))?;
    }
    private::create_folder(folder).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => BagError::Exists { path: folder.to_owned() },
        _ => BagError::io("create", folder)(error),
    })
}

/// Checks that a folder created for a bag does not contain one yet.
fn check_claimed(folder: &Path) -> Result<(), BagError> {
    let entries = fs::read_dir(folder).map_err(BagError::io("record to", folder))?;
    let is_bag = |name: &Path| name.extension().is_some_and(|end| end == "mcap");
    let mut names = entries.flatten().map(|entry| entry.path());
    if names.any(|name| is_bag(&name)) {
        return Err(BagError::Exists { path: folder.to_owned() });
    }
    Ok(())
}

/// Starts a file; also returns a second handle for syncing it.
fn begin(
    path: &Path,
    spare: &Arc<Mutex<dyn Spare>>,
    options: &Options,
) -> Result<(Part<File>, File), BagError> {
    let file = private::create_new(path).map_err(BagError::io("create", path))?;
    // If a reader happens to hold the lock on the new file, the file is recorded without a lock.
    claim(&file);
    let disk = file.try_clone().map_err(BagError::io("create", path))?;
    let part = Part::begin(path, file, Arc::clone(spare), options.compression);
    // A file that has no room for its start would be taken for a damaged part of the bag.
    let mut part = part.inspect_err(|_| drop(fs::remove_file(path)))?;
    let software = concat!("teampulse ", env!("CARGO_PKG_VERSION")).to_owned();
    let session = [("session", options.session.clone()), ("software", software)];
    part.annotate(SESSION_RECORD, &session.map(|(key, value)| (key.to_owned(), value)).into())?;
    Ok((part, disk))
}

fn serialized(metadata: &Metadata) -> BTreeMap<String, String> {
    [(SERIALIZED_KEY.to_owned(), metadata.body())].into()
}

/// The publish time of a message in the bag: the source's stamp, whether plausible or not. If there is none, it is the
/// log time for external messages (as MCAP requires) and `measured` for our own.
fn publish_time(record: &Record, log_time: Time) -> Time {
    let Sample { measured, source_time, .. } = record.sample;
    match record.stream.shape {
        Shape::Message(_) => source_time.unwrap_or(log_time),
        _ => source_time.unwrap_or(measured),
    }
}
