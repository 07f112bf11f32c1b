//! A recording of very many topics.

use std::error::Error;
use std::sync::Arc;

use async_trait::async_trait;
use bytes::Bytes;
use teampulse_bag::{Bag, BagSource, Selection};
use teampulse_core::data::Data;
use teampulse_core::outlet::Outlet;
use teampulse_core::source::{Reading, Source, SourceError};
use teampulse_core::stream::{Schema, Shape, Stream, Subject};
use teampulse_core::time::Time;

use crate::{cpu_secs, session};

/// The number of messages on each topic.
const MESSAGES: u32 = 3;

/// Records this many topics, replays the recording, and prints what each took.
pub async fn run(count: u32) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let (recorded, replayed) = (folder.path().join("recorded"), folder.path().join("replayed"));

    let began_secs = cpu_secs();
    session(Box::new(Topics { count }), &recorded)?.run(std::future::pending()).await;
    let recorded_secs = cpu_secs() - began_secs;

    let began_secs = cpu_secs();
    let source = BagSource::new(Arc::new(Bag::open(&recorded)?), Selection::Raw);
    session(Box::new(source), &replayed)?.run(std::future::pending()).await;
    let replayed_secs = cpu_secs() - began_secs;

    let (written, again) = (Bag::open(&recorded)?, Bag::open(&replayed)?);
    if written.messages_count() != again.messages_count() {
        return Err("the replay differs from the recording".into());
    }
    println!(
        "{{\"topics\": {count}, \"recorded_secs\": {recorded_secs:.2}, \
         \"replayed_secs\": {replayed_secs:.2}}}"
    );
    Ok(())
}

/// The number of topics; each delivers a few messages, and its losses.
struct Topics {
    count: u32,
}

#[async_trait]
impl Source for Topics {
    async fn run(&mut self, outlet: &Outlet) -> Result<(), SourceError> {
        let schema = Arc::new(Schema {
            name: "std_msgs/msg/UInt32".into(),
            encoding: "ros2msg".into(),
            text: "uint32 data".into(),
            hash: String::new(),
        });
        let declare = |k: u32| {
            let shape = Shape::Message(Arc::clone(&schema));
            outlet.declare(Stream::raw(format!("/robot{k}/count"), Subject::session(), shape))
        };
        let streams: Vec<_> = (0..self.count).map(declare).collect();
        for stream in &streams {
            outlet.lost(*stream, 0);
        }
        for second in 0..MESSAGES {
            for (k, stream) in (0_u32..).zip(&streams) {
                let cdr = [&[0, 1, 0, 0], &k.to_le_bytes()[..]].concat();
                let data = Data::Message(Bytes::from(cdr));
                let at = Time::from_stamp(1_700_000_000 + second as i32, k % 1_000_000_000);
                let reading = Reading {
                    index: None,
                    stream: *stream,
                    device_time: None,
                    source_time: None,
                    data,
                };
                if outlet.send(reading, at).await.is_err() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}
