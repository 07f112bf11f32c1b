//! Writing a bag.

pub(crate) mod spare;
pub(crate) mod part;
mod routes;

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mcap::records::MessageHeader;
use teampulse_core::data::Data;
use teampulse_core::sample::Record;
use teampulse_core::stream::{Shape, Stream};
use teampulse_core::time::Time;

use crate::error::BagError;
use crate::metadata::{FileSpan, Metadata, ROSBAG2_RECORD, SERIALIZED_KEY, Span, Version};
use crate::write::part::{Attachment, Compression, Part, nanos};
use crate::write::routes::Routes;
use crate::write::spare::{Spare, SpareFile, free_bytes};
use teampulse_messages::convert::type_name;

/// The metadata record that says which session a file belongs to.
const SESSION_RECORD: &str = "teampulse";

/// A file whose index has become so large is followed by another, whatever the options say [bytes]:
/// the index is in memory until its file ends.
const INDEX_BYTES: u64 = 64 << 20;

/// How a bag is written.
#[derive(Clone, Debug)]
pub struct Options {
    /// The session's name; kept in the bag.
    pub session: String,
    /// How its chunks are compressed.
    pub compression: Compression,
    /// A file of this size is followed by another [bytes]; `None` for no such limit.
    pub split_bytes: Option<u64>,
    /// A file that spans so much time is followed by another [s]; `None` for no such limit.
    pub split_secs: Option<f64>,
    /// The version of `metadata.yaml`.
    pub metadata_version: Version,
    /// Words about the whole recording, kept in the bag.
    pub notes: BTreeMap<String, String>,
    /// The recording ends when the disk has less room than this [bytes].
    pub keep_free_bytes: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            session: String::new(),
            compression: Compression::default(),
            split_bytes: None,
            split_secs: None,
            metadata_version: Version::default(),
            notes: BTreeMap::new(),
            keep_free_bytes: 64 << 20,
        }
    }
}

/// What was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The bag's folder.
    pub folder: PathBuf,
    /// How many files it has.
    pub files: usize,
    /// How many messages, in all files.
    pub messages: u64,
    /// The log time of the first message; [`Time::EPOCH`] without any.
    pub first: Time,
    /// The log time of the last message; [`Time::EPOCH`] without any.
    pub last: Time,
}

/// A bag being written: a folder of MCAP files with a `metadata.yaml`.
///
/// It holds no thread and no timer: the caller says when to [`flush`](BagWriter::flush). After
/// [`BagError::DiskFull`] the bag can still be finished; space for that is kept back from the
/// beginning.
pub struct BagWriter {
    folder: PathBuf,
    name: String,
    options: Options,
    spare: Arc<Mutex<dyn Spare>>,
    part: Part<File>,
    disk: File,
    finished: Vec<FileSpan>,
    routes: Routes,
    descriptions: Vec<Record>,
    custom: BTreeMap<String, String>,
}

impl BagWriter {
    /// Creates the folder and begins its first file.
    pub fn create(folder: &Path, options: &Options) -> Result<BagWriter, BagError> {
        create_folder(folder)?;
        Self::begin(folder, options).inspect_err(|_| {
            // Nothing was recorded; what can't be taken away does no harm.
            drop(fs::remove_dir_all(folder));
        })
    }

    fn begin(folder: &Path, options: &Options) -> Result<BagWriter, BagError> {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let spare: Arc<Mutex<dyn Spare>> = Arc::new(Mutex::new(SpareFile::new(folder)));
        let path = folder.join(format!("{name}_0.mcap"));
        let (part, disk) = begin(&path, &spare, options)?;
        let mut custom = options.notes.clone();
        custom.insert("session".to_owned(), options.session.clone());
        let mut writer = BagWriter {
            folder: folder.to_owned(),
            name,
            options: options.clone(),
            spare,
            part,
            disk,
            finished: Vec::new(),
            routes: Routes::new(options.metadata_version),
            descriptions: Vec::new(),
            custom,
        };
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

    /// Hands all that was written to the disk: what comes after this can be lost, what came before
    /// can't. Also looks after the free space.
    pub fn flush(&mut self) -> Result<(), BagError> {
        if self.part.flush()? {
            self.disk.sync_data().map_err(BagError::io("write", &self.folder))?;
            self.check_room()?;
        }
        self.check_full()
    }

    /// Appends an attachment: the study, a calibration.
    pub fn attach(&mut self, attachment: Attachment<'_>) -> Result<(), BagError> {
        self.part.attach(attachment)?;
        self.check_full()
    }

    /// Keeps a word about the whole recording: it stands in `metadata.yaml` as custom data.
    pub fn note(&mut self, key: &str, value: String) {
        self.custom.insert(key.to_owned(), value);
    }

    /// Ends the bag.
    pub fn finish(mut self) -> Result<Summary, BagError> {
        // Its time has come: the rest fits into what was kept back.
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).release();
        let metadata = self.metadata();
        self.part.annotate(ROSBAG2_RECORD, serialized(&metadata))?;
        self.part.finish()?;
        self.disk.sync_all().map_err(BagError::io("write", &self.folder))?;
        metadata.save(&self.folder).map_err(BagError::io("write", &self.folder))?;
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

    /// Ends the current file and begins the next, with the descriptions of all streams.
    fn split(&mut self, now: Time) -> Result<(), BagError> {
        let number = self.finished.len() + 1;
        let path = self.folder.join(format!("{}_{number}.mcap", self.name));
        let (part, disk) = begin(&path, &self.spare, &self.options)?;
        let metadata = self.metadata();
        self.part.annotate(ROSBAG2_RECORD, serialized(&metadata))?;
        let ended = std::mem::replace(&mut self.part, part).finish()?;
        self.finished.push(ended.file);
        self.routes.begin_file();
        let disk = std::mem::replace(&mut self.disk, disk);
        disk.sync_all().map_err(BagError::io("write", &self.folder))?;
        if ended.is_full {
            return Err(self.disk_full());
        }
        for description in self.descriptions.clone() {
            self.append(&description, now)?;
        }
        self.save_metadata()
    }

    fn keep_description(&mut self, described: &Arc<Stream>, record: &Record) {
        let is_same = |kept: &Record| match &kept.sample.data {
            Data::Description(known) => {
                known.name == described.name
                    && known.origin == described.origin
                    && type_name(&known.shape) == type_name(&described.shape)
            }
            _ => false,
        };
        match self.descriptions.iter().position(is_same) {
            Some(at) => self.descriptions[at] = record.clone(),
            None => self.descriptions.push(record.clone()),
        }
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

    fn check_room(&self) -> Result<(), BagError> {
        let free_bytes = free_bytes(&self.folder).map_err(BagError::io("write", &self.folder))?;
        if free_bytes < self.options.keep_free_bytes { Err(self.disk_full()) } else { Ok(()) }
    }

    fn disk_full(&self) -> BagError {
        BagError::DiskFull { path: self.folder.clone() }
    }
}

fn create_folder(folder: &Path) -> Result<(), BagError> {
    if let Some(parent) = folder.parent() {
        fs::create_dir_all(parent).map_err(BagError::io("create", parent))?;
    }
    fs::create_dir(folder).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => BagError::Exists { path: folder.to_owned() },
        _ => BagError::io("create", folder)(error),
    })
}

/// Begins a file; also gives another handle of it, to sync it by.
fn begin(
    path: &Path,
    spare: &Arc<Mutex<dyn Spare>>,
    options: &Options,
) -> Result<(Part<File>, File), BagError> {
    let file = OpenOptions::new().write(true).create_new(true).open(path);
    let file = file.map_err(BagError::io("create", path))?;
    let disk = file.try_clone().map_err(BagError::io("create", path))?;
    let part = Part::begin(path, file, Arc::clone(spare), options.compression);
    // A file that has no room to begin in would be taken for a damaged part of the bag.
    let mut part = part.inspect_err(|_| drop(fs::remove_file(path)))?;
    let software = concat!("teampulse ", env!("CARGO_PKG_VERSION")).to_owned();
    let session = [("session", options.session.clone()), ("software", software)];
    part.annotate(SESSION_RECORD, session.map(|(key, value)| (key.to_owned(), value)).into())?;
    Ok((part, disk))
}

fn serialized(metadata: &Metadata) -> BTreeMap<String, String> {
    [(SERIALIZED_KEY.to_owned(), metadata.body())].into()
}

/// The second time of a message in the bag: the source's own stamp for what comes from elsewhere
/// (the log time where it has none, as MCAP wants it), and `measured` for what is ours.
fn publish_time(record: &Record, log_time: Time) -> Time {
    match record.stream.shape {
        Shape::Message(_) => record.sample.source_time.unwrap_or(log_time),
        _ => record.sample.measured,
    }
}
