//! LSL: data from liblsl, any bytes in any pieces, and both sides against each other.

use proptest::prelude::*;
use teampulse_devices::lsl::{
    ChannelInfo, Discovery, FeedReply, FeedRequest, Format, LslError, ProbeReply, ProbeRequest,
    Query, ReplyReader, Request, RequestReader, Sample, SampleReader, SampleWriter, StreamInfo,
    Values, discovered,
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

/// A description in liblsl's form.
const DOCUMENT: &str = r#"<?xml version="1.0"?>
<info>
	<name>BioSemi &amp; more</name>
	<type>EEG</type>
	<channel_count>2</channel_count>
	<channel_format>float32</channel_format>
	<source_id>myuid34234</source_id>
	<nominal_srate>100.0000000000000</nominal_srate>
	<version>1.100000000000000</version>
	<created_at>93.25345</created_at>
	<uid>6d58a9c6-e69d-4b5a-9a2f-ca3b0e39a8a5</uid>
	<session_id>default</session_id>
	<hostname>lab</hostname>
	<v4address />
	<v4data_port>16572</v4data_port>
	<v4service_port>16573</v4service_port>
	<v6address />
	<v6data_port>16572</v6data_port>
	<v6service_port>16573</v6service_port>
	<desc>
		<channels>
			<channel><label>C3</label><unit>microvolts</unit><type>EEG</type></channel>
			<channel><label>C4</label><unit>microvolts</unit><type>EEG</type></channel>
		</channels>
	</desc>
</info>
"#;

fn info() -> StreamInfo {
    StreamInfo::parse(DOCUMENT).expect("is a description")
}

fn of(format: Format, channel_count: usize) -> StreamInfo {
    StreamInfo { format, channel_count, ..info() }
}

const REPLY: FeedReply = FeedReply { is_big_endian: false, suppress_subnormals: false };

#[test]
fn a_description_is_read_and_survives_being_written() {
    let info = info();
    assert_eq!((info.name.as_str(), info.kind.as_str()), ("BioSemi & more", "EEG"));
    assert_eq!((info.rate_hz, info.data_port, info.service_port), (100.0, 16572, 16573));
    let channel = ChannelInfo { label: "C4".into(), unit: "microvolts".into(), kind: "EEG".into() };
    assert_eq!(info.channels[1], channel);
    assert_eq!(StreamInfo::parse(&info.full_xml()), Ok(info.clone()));
    let short = StreamInfo { channels: Vec::new(), ..info.clone() };
    assert_eq!(StreamInfo::parse(&info.short_xml()), Ok(short));
}

#[test]
fn a_description_with_an_impossible_value_is_refused() {
    for (right, wrong, field) in [
        ("<channel_count>2", "<channel_count>0", "channel_count"),
        ("<channel_count>2", "<channel_count>99999999", "channel_count"),
        ("float32", "float31", "channel_format"),
        ("100.0000000000000", "-1", "nominal_srate"),
        ("100.0000000000000", "NaN", "nominal_srate"),
        ("<v4data_port>16572", "<v4data_port>70000", "v4data_port"),
    ] {
        let refused = StreamInfo::parse(&DOCUMENT.replace(right, wrong)).expect_err("is wrong");
        assert!(matches!(refused, LslError::Field { field: of, .. } if of == field), "{refused}");
    }
}

#[test]
fn queries_of_liblsl_find_the_streams_that_they_describe() {
    let info = info();
    for (query, is_found) in [
        ("", true),
        ("session_id='default'", true),
        ("session_id='default' and type='EEG'", true),
        ("session_id='default' and type='ECG'", false),
        ("name='BioSemi & more' and starts-with(source_id,'myuid')", true),
        ("type='ECG' or (type=\"EEG\" and channel_count=2)", true),
        ("not(type='EEG')", false),
        ("type!='ECG'", true),
        (
            "channel_count='2' and name='BioSemi & more' and type='EEG' and nominal_srate='100' \
             and source_id='myuid34234' and channel_format='float32'",
            true,
        ),
        ("/info/hostname='lab'", true),
        ("contains(name,'Semi')", true),
        ("desc/manufacturer='x'", false),
    ] {
        let parsed = Query::parse(query).unwrap_or_else(|| panic!("{query}"));
        assert_eq!(parsed.matches(&info), is_found, "{query}");
    }
    for query in ["type=", "type='EEG", "count(//channel)=2", "'a'='a'", &"(".repeat(1000)] {
        assert_eq!(Query::parse(query), None, "{query}");
    }
}

#[test]
fn discovery_and_probes_survive_their_datagrams() {
    let asked = Discovery { query: "type='EEG'".into(), port: 4567, id: "77".into() };
    assert_eq!(asked.encode(), "LSL:shortinfo\r\ntype='EEG'\r\n4567 77\r\n");
    assert_eq!(Discovery::parse(asked.encode().as_bytes()), Some(asked.clone()));
    let reply = asked.reply(&info());
    let found = discovered(reply.as_bytes(), "77").expect("is ours").expect("is a description");
    assert_eq!(found.uid, info().uid);
    assert_eq!(discovered(reply.as_bytes(), "78"), None);
    let probe = ProbeRequest { wave: 7, sent_secs: 1_790_000_000.25 };
    assert_eq!(ProbeRequest::parse(probe.encode().as_bytes()), Some(probe));
    let reply = ProbeReply::parse(b" 7 0.5 93.123456789 93.1235").expect("is one");
    assert_eq!((reply.wave, reply.received_secs), (7, 93.123_456_789));
    assert_eq!(ProbeReply::parse(reply.encode().as_bytes()), Some(reply));
    assert_eq!(ProbeReply::parse(b" 7 0.5 nan 93.1"), None);
}

#[test]
fn the_test_patterns_are_those_of_liblsl() {
    // 123456.789, 4 and -5: what liblsl 1.18 sends ahead of two channels of float32.
    let patterns = SampleWriter::new(&of(Format::Float32, 2)).patterns();
    let first = [2, 201, 118, 190, 159, 12, 36, 254, 64, 0, 0, 128, 64, 0, 0, 160, 192];
    assert_eq!(patterns[..17], first);
    let mut reader = SampleReader::new(&of(Format::Float32, 2), REPLY);
    assert_eq!(reader.push(&patterns), Ok(vec![]));
    let mut reader = SampleReader::new(&of(Format::Int32, 2), REPLY);
    assert_eq!(reader.push(&patterns), Err(LslError::Pattern));
}

#[test]
fn stamps_are_deduced_by_the_rate() {
    let mut reader = SampleReader::new(&of(Format::Int8, 1), REPLY);
    reader.push(&SampleWriter::new(&of(Format::Int8, 1)).patterns()).expect("agreed");
    let mut bytes = vec![2];
    bytes.extend(50.0_f64.to_le_bytes());
    bytes.extend([5, 1, 6, 1, 0xff]);
    let samples = reader.push(&bytes).expect("samples");
    let read: Vec<(f64, Values)> =
        samples.into_iter().map(|sample| (sample.stamp_secs, sample.values)).collect();
    let number = |value: f64| Values::Numbers(vec![value]);
    assert_eq!(
        read,
        [(50.0, number(5.0)), (50.01, number(6.0)), (50.019_999_999_999_996, number(-1.0))]
    );
}

#[test]
fn big_endian_numbers_and_suppressed_subnormals_are_read() {
    let reply = FeedReply { is_big_endian: true, suppress_subnormals: true };
    let mut reader = SampleReader::new(&of(Format::Float32, 1), reply);
    let mut bytes = Vec::new();
    for value in [4.0_f32, 2.0] {
        bytes.push(2);
        bytes.extend(123_456.789_f64.to_be_bytes());
        bytes.extend(value.to_be_bytes());
    }
    bytes.push(2);
    bytes.extend(1.5_f64.to_be_bytes());
    bytes.extend((f32::MIN_POSITIVE / 2.0).to_be_bytes());
    let samples = reader.push(&bytes).expect("samples");
    assert_eq!(samples, [Sample { stamp_secs: 1.5, values: Values::Numbers(vec![0.0]) }]);
}

#[test]
fn texts_of_any_size_of_length_are_read_and_endless_ones_refused() {
    let stream = of(Format::String, 1);
    let open = || {
        let mut reader = SampleReader::new(&stream, REPLY);
        reader.push(&SampleWriter::new(&stream).patterns()).expect("agreed");
        reader
    };
    for length in [&[1, 2][..], &[2, 2, 0], &[4, 2, 0, 0, 0], &[8, 2, 0, 0, 0, 0, 0, 0, 0]] {
        let samples = open().push(&[&[1], length, b"hi"].concat()).expect("samples");
        assert_eq!(samples[0].values, Values::Texts(vec!["hi".into()]));
    }
    let endless = [1, 8, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
    assert!(matches!(open().push(&endless), Err(LslError::Long(_))));
    assert!(matches!(open().push(&[1, 3]), Err(LslError::Byte(3, _))));
    assert!(matches!(open().push(&[9]), Err(LslError::Byte(9, _))));
}

#[test]
fn a_refusal_is_an_error_with_its_words() {
    let refused = ReplyReader::default().push(b"LSL/110 404 Not found", "u");
    assert_eq!(refused, Ok(None), "more may come");
    let refused = ReplyReader::default().push(b"LSL/110 404 Not found\r\n", "u");
    assert_eq!(refused, Err(LslError::Refused("LSL/110 404 Not found".into())));
    assert!(ReplyReader::default().push(b"HTTP/1.1 200 OK\r\n\r\n", "u").is_err());
    let other = REPLY.encode("another");
    assert!(ReplyReader::default().push(other.as_bytes(), "u").is_err());
}

#[test]
fn what_we_ask_for_is_what_we_serve() {
    let asked = FeedRequest::encode(&info(), 360);
    let read = RequestReader::default().push(asked.as_bytes()).expect("is one");
    let Some(Request::Feed(feed)) = read else { panic!("{read:?}") };
    assert_eq!((feed.version, feed.uid, feed.most_waiting), (110, info().uid, 360));
    let full = RequestReader::default().push(b"LSL:fullinfo\r\n");
    assert_eq!(full, Ok(Some(Request::Full)));
    let short = RequestReader::default().push(b"LSL:shortinfo\r\ntype='EEG'\r\n");
    assert_eq!(short, Ok(Some(Request::Short("type='EEG'".into()))));
    assert!(RequestReader::default().push(b"GET / HTTP/1.1\r\n").is_err());
    assert!(RequestReader::default().push(&vec![b'a'; 20_000]).is_err());
}

fn sample(format: Format, channels: usize) -> impl Strategy<Value = Sample> {
    let texts = proptest::collection::vec("[a-zA-Zµ ]{0,300}", channels).prop_map(Values::Texts);
    let numbers = proptest::collection::vec(-100_i8..100, channels)
        .prop_map(|numbers| Values::Numbers(numbers.into_iter().map(f64::from).collect()));
    let values = if format == Format::String { texts.boxed() } else { numbers.boxed() };
    (0.0..1e9_f64, values).prop_map(|(stamp_secs, values)| Sample { stamp_secs, values })
}

fn several() -> impl Strategy<Value = (Format, usize, Vec<Sample>)> {
    (0..FORMATS.len(), 1_usize..5).prop_flat_map(|(format, channels)| {
        let format = FORMATS[format];
        let samples = proptest::collection::vec(sample(format, channels), 0..20);
        (Just(format), Just(channels), samples)
    })
}

proptest! {
    #[test]
    fn the_same_bytes_give_the_same_samples_however_they_are_split(
        (format, channels, samples) in several(),
        pieces in proptest::collection::vec(1_usize..40, 1..200),
    ) {
        let stream = of(format, channels);
        let writer = SampleWriter::new(&stream);
        let mut bytes = REPLY.encode(&stream.uid).into_bytes();
        bytes.extend(writer.patterns());
        for sample in &samples {
            writer.write(sample, &mut bytes);
        }
        let (mut replies, mut reader, mut read) = (ReplyReader::default(), None, Vec::new());
        let mut rest = bytes.as_slice();
        let mut sizes = pieces.iter().cycle();
        while !rest.is_empty() {
            let (piece, after) = rest.split_at((*sizes.next().unwrap()).min(rest.len()));
            rest = after;
            match &mut reader {
                None => {
                    if let Some((reply, more)) = replies.push(piece, &stream.uid).unwrap() {
                        let reader = reader.insert(SampleReader::new(&stream, reply));
                        read.extend(reader.push(&more).unwrap());
                    }
                }
                Some(reader) => read.extend(reader.push(piece).unwrap()),
            }
        }
        prop_assert_eq!(read, samples);
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes: Vec<u8>, pieces in 1_usize..8, format in 0_usize..7) {
        let stream = of(FORMATS[format], 2);
        let mut reader = SampleReader::new(&stream, REPLY);
        reader.push(&SampleWriter::new(&stream).patterns()).unwrap();
        let (mut replies, mut requests) = (ReplyReader::default(), RequestReader::default());
        for piece in bytes.chunks(bytes.len() / pieces + 1) {
            reader.push(piece).ok();
            replies.push(piece, "u").ok();
            requests.push(piece).ok();
        }
        Discovery::parse(&bytes);
        discovered(&bytes, "1");
        ProbeRequest::parse(&bytes);
        ProbeReply::parse(&bytes);
        let text = String::from_utf8_lossy(&bytes);
        StreamInfo::parse(&text).ok();
        Query::parse(&text);
    }

    #[test]
    fn any_markup_is_read_or_refused(document in "[<>/a-z&;!\\[\\]?\" -]{0,200}", query in "[a-z'=() -]{0,60}") {
        StreamInfo::parse(&document).ok();
        if let Some(query) = Query::parse(&query) {
            query.matches(&info());
        }
    }
}
