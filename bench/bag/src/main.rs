//! Measures how many messages per CPU-second the bag writer takes: `bench-bag FOLDER MESSAGES BYTES`.
//!
//! It writes eight uncompressed topics with payloads of noisy doubles made beforehand. Measured is the processor time
//! of the whole process between the first message and the closed bag.
#![expect(clippy::print_stdout, reason = "the number is its output")]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use bytes::Bytes;
use rustix::time::{ClockId, clock_gettime};
use teampulse_bag::{BagWriter, Compression, Options};
use teampulse_core::data::Data;
use teampulse_core::sample::{Record, Sample, Turn};
use teampulse_core::stream::{Schema, Shape, Stream, StreamId, Subject};
use teampulse_core::time::Time;

const TOPICS: u32 = 8;
/// The number of different payloads.
const PAYLOADS: usize = 64;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, messages, bytes] = arguments.as_slice() else {
        return Err("usage: bench-bag FOLDER MESSAGES BYTES".into());
    };
    let (messages, bytes) = (messages.parse()?, bytes.parse()?);
    let mut records = records(bytes);
    let begun_secs = cpu_secs();
    let options = Options { compression: Compression::None, ..Options::default() };
    let mut writer = BagWriter::create(Path::new(folder), &options)?;
    for k in 0..messages {
        let place = k as usize % records.len();
        let record = &mut records[place];
        record.sample.index = k / u64::from(TOPICS);
        record.sample.log_time = Time::from_nanos(1_700_000_000_000_000_000 + k as i64 * 1_000_000);
        writer.write(record)?;
    }
    writer.finish()?;
    println!("{:.0}", messages as f64 / (cpu_secs() - begun_secs));
    Ok(())
}

/// Makes records of all topics in turn, each with a separate payload.
fn records(bytes: usize) -> Vec<Record> {
    let streams: Vec<Arc<Stream>> = (0..TOPICS).map(|k| Arc::new(stream(k))).collect();
    let record = |k: usize| {
        let id = k as u32 % TOPICS;
        let cdr = payload(k, bytes);
        let sample = Sample {
            stream: StreamId(id),
            measured: Time::EPOCH,
            log_time: Time::EPOCH,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Message(cdr.clone()),
        };
        Record { stream: Arc::clone(&streams[id as usize]), sample, cdr }
    };
    (0..PAYLOADS).map(record).collect()
}

fn stream(k: u32) -> Stream {
    let schema = Schema {
        name: "std_msgs/msg/ByteMultiArray".into(),
        encoding: "ros2msg".into(),
        text: "byte[] data".into(),
        hash: String::new(),
    };
    Stream::raw(format!("/robot{k}/data"), Subject::robot("r"), Shape::Message(Arc::new(schema)))
}

/// Makes doubles of a slow wave with noise, like those of sensors.
fn payload(k: usize, bytes: usize) -> Bytes {
    let mut state = k as u64 + 1;
    let double = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let noise = (state >> 40) as f64 / f64::from(1u32 << 24);
        ((n as f64 * 0.01).sin() + 0.01 * noise).to_le_bytes()
    };
    (0..bytes.div_ceil(8)).flat_map(double).take(bytes).collect()
}

fn cpu_secs() -> f64 {
    let used = clock_gettime(ClockId::ProcessCPUTime);
    used.tv_sec as f64 + used.tv_nsec as f64 / 1e9
}
