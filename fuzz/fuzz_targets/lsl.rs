//! Any bytes, in any pieces, into what reads LSL: samples, descriptions, queries or errors, never a panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use teampulse_devices::lsl::{
    Discovery, FeedReply, Format, ProbeReply, ProbeRequest, Query, ReplyReader, RequestReader,
    SampleReader, SampleWriter, StreamInfo, discovered,
};

const FORMATS: [Format; 7] = [
    Format::Float32,
    Format::Double64,
    Format::String,
    Format::Int32,
    Format::Int16,
    Format::Int8,
    Format::Int64,
];

const DOCUMENT: &str = "<info><name>a</name><uid>u</uid><channel_count>3</channel_count>\
    <nominal_srate>100</nominal_srate><channel_format>float32</channel_format><v4data_port>1</v4data_port>\
    <v4service_port>1</v4service_port></info>";

fuzz_target!(|input: (u8, Vec<&[u8]>)| {
    let (choice, pieces) = input;
    let stream = StreamInfo::parse(DOCUMENT).expect("a description");
    let stream = StreamInfo { format: FORMATS[usize::from(choice) % FORMATS.len()], ..stream };
    let reply = FeedReply { is_big_endian: choice & 64 != 0, suppress_subnormals: choice & 128 != 0 };
    let mut samples = SampleReader::new(&stream, reply);
    if !reply.is_big_endian {
        samples.push(&SampleWriter::new(&stream).patterns()).expect("as agreed");
    }
    let (mut replies, mut requests) = (ReplyReader::default(), RequestReader::default());
    for bytes in pieces {
        samples.push(bytes).ok();
        replies.push(bytes, "u").ok();
        requests.push(bytes).ok();
        Discovery::parse(bytes);
        discovered(bytes, "1");
        ProbeRequest::parse(bytes);
        ProbeReply::parse(bytes);
        let text = String::from_utf8_lossy(bytes);
        let described = StreamInfo::parse(&text).unwrap_or_else(|_| stream.clone());
        if let Some(query) = Query::parse(&text) {
            query.matches(&described);
        }
    }
});
