#![doc = include_str!("../README.md")]

mod metadata;
mod qos_yaml;
mod error;
mod schema;
mod channel;
mod spare;
mod part;
mod writer;
mod records;
mod chunk;
mod block;
mod index;
mod scan;
mod reader;
mod messages;
mod recover;
mod sink;
mod pace;
mod source;

pub use error::{BagError, Found};
pub use index::Damage;
pub use messages::{Message, Messages};
pub use metadata::Version;
pub use pace::Pace;
pub use part::{Attachment, Compression};
pub use reader::{Bag, BagStream};
pub use recover::{RecoveredFile, Report, recover};
pub use sink::{BagSink, STUDY_NAME};
pub use source::{BagSource, Selection};
pub use writer::{BagWriter, Options, Summary};
