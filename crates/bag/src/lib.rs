#![doc = include_str!("../README.md")]

pub mod private;
pub mod disk;
mod claim;
mod spill;
mod error;
mod schema;
mod channel;
mod metadata;
mod growth;
mod write;
mod read;
mod recover;
mod sink;
mod pace;
mod source;
mod recorded;
mod recording;

pub use error::{BagError, Found};
pub use growth::{Growth, OnDisk, Stage};
pub use metadata::Version;
pub use pace::Pace;
pub use read::index::Damage;
pub use read::messages::{Message, Messages};
pub use read::{Bag, BagStream, DAMAGE_NOTE, absent_text};
pub use recorded::Recorded;
pub use recording::{Broken, Complete, Opening, Recording, STOPPED};
pub use recover::{RecoveredFile, Report, folder_with, recover};
pub use sink::{BagSink, CONTINUES_NOTE, ENDED_NOTE, JOINED_NOTE, STUDY_NAME};
pub use source::{Adapter, BagSource, Selection, Unread};
pub use spill::Spill;
pub use write::chunk::Compression;
pub use write::part::Attachment;
pub use write::{BagWriter, Options, Place, Summary};
