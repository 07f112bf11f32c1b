//! Small files of each format, byte by byte from their documentation.

use std::io::{Cursor, Write};

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A zip with these files.
pub fn zipped(files: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in files {
        zip.start_file(*name, SimpleFileOptions::default()).expect("in memory");
        zip.write_all(text.as_bytes()).expect("in memory");
    }
    zip.finish().expect("in memory").into_inner()
}

pub fn e4() -> Vec<u8> {
    zipped(&[
        ("info.txt", "about the files"),
        (
            "ACC.csv",
            "1700000000.00, 1700000000.00, 1700000000.00\n32.0, 32.0, 32.0\n0,0,64\n-32,0,64\n",
        ),
        ("BVP.csv", "1700000000.00\n64.0\n-0.5\n1.25\n"),
        ("EDA.csv", "1700000000.00\n4.0\n0.0\n1.5\n"),
        ("TEMP.csv", "1700000000.00\n4.0\n33.5\n"),
        ("HR.csv", "1700000010.00\n1.0\n61.0\n"),
        ("IBI.csv", "1700000000.00, IBI\n1.5,0.8125\n2.3,0.8\n"),
        ("tags.csv", "1700000001.25\n"),
    ])
}

fn long(number: i64) -> Vec<u8> {
    let mut rest = ((number << 1) ^ (number >> 63)) as u64;
    let mut bytes = Vec::new();
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
    bytes
}

fn text(text: &str) -> Vec<u8> {
    [long(text.len() as i64), text.as_bytes().to_vec()].concat()
}

pub fn embrace_plus() -> Vec<u8> {
    embrace_plus_at(4.0)
}

/// With this rate of the skin conductance [Hz].
pub fn embrace_plus_at(rate_hz: f32) -> Vec<u8> {
    let schema = r#"{"type":"record","name":"r","fields":[{"name":"rawData","type":{"type":"record","name":"d",
        "fields":[{"name":"eda","type":{"type":"record","name":"s","fields":[
        {"name":"timestampStart","type":"long"},{"name":"samplingFrequency","type":"float"},
        {"name":"values","type":{"type":"array","items":"float"}}]}},
        {"name":"temperature","type":"s"},
        {"name":"tags","type":{"type":"record","name":"t","fields":[
        {"name":"tagsTimeMicros","type":["null",{"type":"array","items":"long"}]}]}}]}}]}"#;
    let sync = [7; 16];
    let part = |rate_hz: f32, values: &[f32]| {
        let numbers: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let start = long(1_700_000_000_000_000);
        [start, rate_hz.to_le_bytes().to_vec(), long(values.len() as i64), numbers, long(0)]
            .concat()
    };
    let tags = [long(1), long(1), long(1_700_000_000_500_000), long(0)].concat();
    let record = [part(rate_hz, &[0.25, 0.5]), part(4.0, &[33.0]), tags].concat();
    let header =
        [b"Obj\x01".to_vec(), long(1), text("avro.schema"), text(schema), long(0), sync.to_vec()];
    let block = [long(1), long(record.len() as i64), record, sync.to_vec()];
    [header.concat(), block.concat()].concat()
}

/// A chunk of an XDF.
pub fn chunk(tag: u16, content: &[u8]) -> Vec<u8> {
    let length = (content.len() + 2) as u32;
    [&[4][..], &length.to_le_bytes(), &tag.to_le_bytes(), content].concat()
}

/// The header of a stream.
fn header(id: u32, name: &str, format: &str, rate_hz: f64) -> Vec<u8> {
    let xml = format!(
        "<?xml version=\"1.0\"?><info><name>{name}</name><type>{name}</type><channel_count>1</channel_count>\
         <nominal_srate>{rate_hz}</nominal_srate><channel_format>{format}</channel_format></info>"
    );
    chunk(2, &[&id.to_le_bytes(), xml.as_bytes()].concat())
}

/// One stream of skin conductance at 4 Hz with these stamps [s].
pub fn xdf_with_stamps(stamps_secs: &[f64], rate_hz: f64) -> Vec<u8> {
    xdf_with_offsets(stamps_secs, rate_hz, &[])
}

/// With offsets of its clock, each at a time [s].
pub fn xdf_with_offsets(stamps_secs: &[f64], rate_hz: f64, offsets: &[(f64, f64)]) -> Vec<u8> {
    let mut file = b"XDF:".to_vec();
    file.extend(header(1, "EDA", "int16", rate_hz));
    for (at_secs, secs) in offsets {
        let offset = [&1_u32.to_le_bytes()[..], &at_secs.to_le_bytes(), &secs.to_le_bytes()];
        file.extend(chunk(4, &offset.concat()));
    }
    let mut samples =
        [&1_u32.to_le_bytes()[..], &[4], &(stamps_secs.len() as u32).to_le_bytes()].concat();
    for stamp_secs in stamps_secs {
        samples.extend([&[8][..], &stamp_secs.to_le_bytes(), &3_i16.to_le_bytes()].concat());
    }
    file.extend(chunk(3, &samples));
    file
}

/// A sample a second with these numbers.
pub fn xdf_with_integers(numbers: &[i64]) -> Vec<u8> {
    let mut file = [b"XDF:".to_vec(), header(1, "EDA", "int64", 1.0)].concat();
    let mut samples = [&1_u32.to_le_bytes()[..], &[1, numbers.len() as u8]].concat();
    for (secs, number) in numbers.iter().enumerate() {
        samples.extend([&[8][..], &(secs as f64).to_le_bytes(), &number.to_le_bytes()].concat());
    }
    file.extend(chunk(3, &samples));
    file
}

/// The boundary after which readers continue.
fn boundary() -> Vec<u8> {
    let fixed = *b"\x43\xA5\x46\xDC\xCB\xF5\x41\x0F\xB3\x0E\xD5\x46\x73\x83\xCB\xE4";
    chunk(5, &fixed)
}

/// Four chunks of ten samples at 4 Hz, which begin this far apart [s] and have one stamp each, with a boundary after
/// each; returns the offset of each chunk, too.
pub fn xdf_with_boundaries(step_secs: f64) -> (Vec<u8>, Vec<usize>) {
    let mut file = [b"XDF:".to_vec(), header(1, "EDA", "int16", 4.0)].concat();
    let mut starts = Vec::new();
    for number in 0..4 {
        starts.push(file.len());
        file.extend(chunk(3, &ten_samples(Some(f64::from(number) * step_secs))));
        file.extend(boundary());
    }
    (file, starts)
}

/// The content of a chunk of ten samples, of which only the first may have a stamp [s].
pub fn ten_samples(stamp_secs: Option<f64>) -> Vec<u8> {
    let stamp = stamp_secs.map_or(vec![0], |secs| [&[8][..], &secs.to_le_bytes()].concat());
    let following = [&[0][..], &3_i16.to_le_bytes()].concat().repeat(9);
    [&1_u32.to_le_bytes()[..], &[1, 10], &stamp, &3_i16.to_le_bytes(), &following].concat()
}

/// An ECG of 100 Hz and a marker, both by a clock that is 10 s behind that of the recorder.
pub fn xdf() -> Vec<u8> {
    let mut file = b"XDF:".to_vec();
    file.extend(chunk(
        1,
        b"<?xml version=\"1.0\"?><info><version>1.0</version><datetime>2026-01-05T11:15:00+0100</datetime></info>",
    ));
    file.extend(header(1, "ECG", "int16", 100.0));
    file.extend(header(2, "Markers", "string", 0.0));
    for id in 1_u32..=2 {
        let offset = [&id.to_le_bytes()[..], &50_f64.to_le_bytes(), &10_f64.to_le_bytes()].concat();
        file.extend(chunk(4, &offset));
    }
    let mut samples = [&1_u32.to_le_bytes()[..], &[1, 3]].concat();
    samples.extend([&[8][..], &50_f64.to_le_bytes(), &5_i16.to_le_bytes()].concat());
    samples.extend([&[0][..], &(-6_i16).to_le_bytes()].concat());
    samples.extend([&[0][..], &7_i16.to_le_bytes()].concat());
    file.extend(chunk(3, &samples));
    let mark =
        [&2_u32.to_le_bytes()[..], &[1, 1, 8], &51_f64.to_le_bytes(), &[1, 3], b"tap"].concat();
    file.extend(chunk(3, &mark));
    file
}

/// Two records of one second, the second of them two seconds late: an ECG at 4 Hz, and a tap.
pub fn edf() -> Vec<u8> {
    edf_to(1.0)
}

/// With this physical maximum of the ECG; its minimum is -1.
pub fn edf_to(most: f64) -> Vec<u8> {
    let field = |text: &str, width: usize| format!("{text:<width$}");
    let both = |first: &str, second: &str, width| field(first, width) + &field(second, width);
    let header = [
        field("0", 8),
        field("X X X X", 80),
        field("Startdate X X X X", 80),
        field("01.01.26", 8),
        field("12.00.00", 8),
        field("768", 8),
        field("EDF+D", 44),
        field("2", 8),
        field("1", 8),
        field("2", 4),
        both("ECG", "EDF Annotations", 16),
        both("", "", 80),
        both("mV", "", 8),
        both("-1", "-1", 8),
        both(&most.to_string(), "1", 8),
        both("-32767", "-32768", 8),
        both("32767", "32767", 8),
        both("", "", 80),
        both("4", "16", 8),
        both("", "", 32),
    ];
    let record = |samples: [i16; 4], annotations: &str| {
        let mut bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
        bytes.extend(annotations.as_bytes());
        bytes.resize(8 + 32, 0);
        bytes
    };
    let first = record([0, 32767, 0, -32767], "+0\x14\x14\0");
    let second = record([32767; 4], "+3\x14\x14\0+3.5\x14tap\x14\0");
    [header.concat().into_bytes(), first, second].concat()
}
