//! One file of a bag being written.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use mcap::McapError;
use mcap::records::MessageHeader;
use teampulse_core::time::Time;

use crate::channel::Channel;
use crate::error::BagError;
use crate::metadata::{FileSpan, Span};
use crate::write::chunk::Compression;
use crate::write::file::{CHUNK_BYTES, McapFile};
use crate::write::spare::{Backed, Progress, Spare, is_full};

/// One file of a bag being written, with the reserve needed to finish it on a full disk.
pub(crate) struct Part<F: Write> {
    path: PathBuf,
    file: McapFile<Backed<F>>,
    progress: Arc<Progress>,
    spare: Arc<Mutex<dyn Spare>>,
    span: Span,
    largest_bytes: u64,
    described_bytes: u64,
    pending: bool,
}

/// A finished file.
#[derive(Debug)]
pub(crate) struct Ended {
    pub file: FileSpan,
    /// Whether the disk became full, so that no file may follow.
    pub is_full: bool,
}

/// An attachment of an MCAP file.
#[derive(Clone, Copy, Debug)]
pub struct Attachment<'a> {
    /// The attachment's name: `study.toml`.
    pub name: &'a str,
    /// The attachment's media type: `application/toml`.
    pub media_type: &'a str,
    /// When the attachment was added, by the session's clock.
    pub log_time: Time,
    /// The attachment's contents.
    pub bytes: &'a [u8],
}

impl<F: Write> Part<F> {
    /// Starts the file at `path`, of which `file` is the open handle.
    pub(crate) fn begin(
        path: &Path,
        file: F,
        spare: Arc<Mutex<dyn Spare>>,
        compression: Compression,
    ) -> Result<Part<F>, BagError> {
        let progress = Arc::<Progress>::default();
        let file = Backed::new(file, Arc::clone(&spare), Arc::clone(&progress));
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = McapFile::begin(file, folder, compression).map_err(error(path))?;
        let part = Part {
            path: path.to_owned(),
            file,
            progress,
            spare,
            span: Span::default(),
            largest_bytes: 0,
            described_bytes: 0,
            pending: true,
        };
        part.keep_room()?;
        Ok(part)
    }

    /// Adds a channel, or finds an identical one.
    pub(crate) fn channel(&mut self, channel: &Channel) -> Result<u16, BagError> {
        let Channel { topic, schema, encoding, metadata } = channel;
        let id = self.file.channel(channel).map_err(self.error())?;
        let metadata_bytes: usize =
            metadata.iter().map(|(key, value)| key.len() + value.len() + 8).sum();
        let named = topic.len() + schema.name.len() + encoding.len() + 64;
        self.described_bytes += (schema.text.len() + metadata_bytes + named) as u64;
        self.pending = true;
        Ok(id)
    }

    /// Appends a message to a channel of this file.
    pub(crate) fn write(&mut self, header: &MessageHeader, data: &[u8]) -> Result<(), BagError> {
        if data.len() as u64 > self.largest_bytes {
            self.largest_bytes = data.len() as u64;
            self.keep_room()?;
        }
        self.file.message(header, data).map_err(self.error())?;
        self.span.take(Time::from_nanos(header.log_time as i64));
        self.pending = true;
        Ok(())
    }

    /// Appends an attachment.
    pub(crate) fn attach(&mut self, attachment: Attachment<'_>) -> Result<(), BagError> {
        self.file.attach(&attachment).map_err(self.error())
    }

    /// Appends a metadata record.
    pub(crate) fn annotate(
        &mut self,
        name: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<(), BagError> {
        self.file.annotate(name, metadata).map_err(self.error())
    }

    /// Flushes all written data to the operating system; returns whether there were any.
    pub(crate) fn flush(&mut self) -> Result<bool, BagError> {
        if !std::mem::take(&mut self.pending) {
            return Ok(false);
        }
        self.file.flush().map_err(self.error())?;
        self.keep_room()?;
        Ok(true)
    }

    /// Finishes the file with its index.
    pub(crate) fn finish(mut self) -> Result<Ended, BagError> {
        self.file.finish().map_err(self.error())?;
        Ok(Ended { file: self.file_span(), is_full: self.is_full() })
    }

    /// Whether the disk is full, so that the file must be finished now.
    pub(crate) fn is_full(&self) -> bool {
        self.progress.is_full()
    }

    /// The number of bytes written to the file.
    pub(crate) fn written_bytes(&self) -> u64 {
        self.progress.written_bytes()
    }

    /// The most bytes that the index will need, excluding the channels.
    pub(crate) fn index_bytes(&self) -> u64 {
        self.file.index_bytes()
    }

    /// The times and the number of messages so far.
    pub(crate) fn span(&self) -> Span {
        self.span
    }

    /// The file's entry in `metadata.yaml`.
    pub(crate) fn file_span(&self) -> FileSpan {
        let name = self.path.file_name().unwrap_or_default();
        FileSpan { path: name.to_string_lossy().into_owned(), span: self.span }
    }

    /// Reserves the space needed to finish the file: two chunks of maximum size, and the index of all
    /// chunks so far.
    fn keep_room(&self) -> Result<(), BagError> {
        let summary_bytes = 2 * self.described_bytes + self.index_bytes();
        let bytes = 4 * CHUNK_BYTES + 2 * self.largest_bytes + summary_bytes;
        let mut spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        spare.grow_to(bytes).map_err(|error| self.error()(error.into()))
    }

    fn error(&self) -> impl FnOnce(McapError) -> BagError + use<F> {
        error(&self.path)
    }
}

fn error(path: &Path) -> impl FnOnce(McapError) -> BagError + use<> {
    let path = path.to_owned();
    move |error| match error {
        McapError::Io(error) if is_full(&error) => disk_full(&path),
        McapError::Io(error) => BagError::Io { doing: "write", path, error },
        error => BagError::Format { path, error },
    }
}

fn disk_full(path: &Path) -> BagError {
    BagError::DiskFull { path: path.parent().unwrap_or(path).to_owned() }
}

/// A time as MCAP represents it; times before 1970 become 0.
pub(crate) fn nanos(time: Time) -> u64 {
    u64::try_from(time.nanos()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::io::{self, ErrorKind};
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::read::index::Index;
    use teampulse_core::stream::Schema;

    /// A disk with little free space.
    #[derive(Clone, Default)]
    struct Disk {
        contents: Arc<Mutex<Vec<u8>>>,
        room_bytes: Arc<AtomicU64>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room_bytes = self.room_bytes.load(Ordering::Relaxed);
            let taken = bytes.len().min(room_bytes as usize);
            if taken == 0 {
                return Err(ErrorKind::StorageFull.into());
            }
            self.room_bytes.fetch_sub(taken as u64, Ordering::Relaxed);
            self.contents.lock().unwrap().extend(&bytes[..taken]);
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Space reserved on that disk.
    struct KeptBack {
        disk: Disk,
        bytes: u64,
    }

    impl Spare for KeptBack {
        fn grow_to(&mut self, bytes: u64) -> io::Result<()> {
            let more = bytes.saturating_sub(self.bytes);
            if more > self.disk.room_bytes.load(Ordering::Relaxed) {
                return Err(ErrorKind::StorageFull.into());
            }
            self.disk.room_bytes.fetch_sub(more, Ordering::Relaxed);
            self.bytes += more;
            Ok(())
        }

        fn release(&mut self) {
            self.disk.room_bytes.fetch_add(self.bytes, Ordering::Relaxed);
            self.bytes = 0;
        }
    }

    fn channel() -> Channel {
        let schema = Schema {
            name: "a/msg/X".into(),
            encoding: "ros2msg".into(),
            text: "byte[] data".into(),
            hash: String::new(),
        };
        let metadata = BTreeMap::new();
        Channel { topic: "/x".into(), schema: Arc::new(schema), encoding: "cdr".into(), metadata }
    }

    /// Writes messages of this size until a write fails, then finishes the file; returns the file's
    /// contents.
    fn fill(room_bytes: u64, message_bytes: usize) -> (FileSpan, Index) {
        let disk = Disk::default();
        disk.room_bytes.store(room_bytes, Ordering::Relaxed);
        let spare = Arc::new(Mutex::new(KeptBack { disk: disk.clone(), bytes: 0 }));
        let path = Path::new("x.mcap");
        let mut part = Part::begin(path, disk.clone(), spare, Compression::None).unwrap();
        let channel_id = part.channel(&channel()).unwrap();
        let mut header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
        while !part.is_full() {
            header.log_time += 1;
            if part.write(&header, &vec![7; message_bytes]).is_err() {
                break;
            }
        }
        let ended = part.finish().unwrap();
        assert!(ended.is_full);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &*disk.contents.lock().unwrap()).unwrap();
        (ended.file, Index::open(file.path()).unwrap())
    }

    #[test]
    fn a_full_disk_leaves_a_whole_file() {
        for message_bytes in [1, 1000, 100_000, 3_000_000] {
            for room_bytes in [20_000_000, 20_500_000, 21_000_001] {
                let (ended, index) = fill(room_bytes, message_bytes);
                assert_eq!(index.damage, []);
                assert_eq!(index.span, ended.span);
                assert!(ended.span.messages > 1);
            }
        }
    }
}
